//! Blender (Synthetic-NeRF) captures: `transforms_{train,val,test}.json` beside RGBA images.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::image::{header_size_px, read_composited};
use super::normalise::random_points_world;
use super::pose::world_to_camera;
use super::{
    Capture, DatasetError, EXTENT, LoadOptions, LoadReport, Normalisation, SkippedView, Split, View, ViewFault,
};
use crate::camera::Camera;

mod transforms;

use transforms::{Frame, Transforms, read_optional, read_transforms};

/// The file that tells this layout.
pub(super) const TRAIN_FILE: &str = "transforms_train.json";
const TEST_FILE: &str = "transforms_test.json";
const VAL_FILE: &str = "transforms_val.json";

/// Fewer views than this leave depth undetermined almost everywhere.
const MIN_TRAIN_VIEWS: usize = 3;

/// Whether the folder is of this layout.
pub(super) fn is_layout_of(path: &Path) -> bool {
    path.join(TRAIN_FILE).is_file()
}

/// A frame whose pose and image header are sound.
struct Candidate {
    path: PathBuf,
    size_px: (u32, u32),
    rotation: DMat3,
    translation: DVec3,
}

/// Loads the Blender capture in `path`.
///
/// # Errors
/// As [`super::load`].
pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<(Capture, LoadReport), DatasetError> {
    let train_file = path.join(TRAIN_FILE);
    let mut notes = Vec::new();
    let train = read_transforms(&train_file)?;
    let test = read_optional(path, TEST_FILE)?;
    if let Some(val) = read_optional(path, VAL_FILE)? {
        notes.push(format!("views in `{VAL_FILE}`, not used: {}", val.frames.len()));
    }

    let train_candidates = candidates(path, &train);
    let Some(source_size_px) = commonest_size_px(&train_candidates) else {
        let named = train.frames.iter().zip(&train_candidates);
        let faults = named.filter_map(|(frame, found)| Some(format!("{}: {}", frame.name(), found.as_ref().err()?)));
        return Err(too_few_views(train_file, &train, faults.collect()));
    };
    let mut reader = Reader {
        options,
        source_size_px,
        n_without_alpha: 0,
        skipped: Vec::new(),
        camera_angle_x: train.camera_angle_x,
    };
    let train_views = reader.views(Split::Train, &train, train_candidates);
    if train_views.len() < MIN_TRAIN_VIEWS {
        let faults = reader.skipped.iter().map(ToString::to_string).collect();
        return Err(too_few_views(train_file, &train, faults));
    }
    let test_views = match &test {
        Some(test) => {
            reader.camera_angle_x = test.camera_angle_x;
            reader.views(Split::Test, test, candidates(path, test))
        }
        None => Vec::new(),
    };

    if test_views.is_empty() {
        let why = if test.is_some() { "lists no usable view" } else { "is missing" };
        notes.push(format!(
            "no views are held out, so quality on unseen views cannot be measured: `{}` {why}; move some frames of \
             `{TRAIN_FILE}` into it",
            path.join(TEST_FILE).display()
        ));
    }
    if reader.n_without_alpha > 0 {
        notes.push(format!(
            "images without an alpha channel: {}; what they show behind the object is trained as part of it; export \
             RGBA to have the background {} there",
            reader.n_without_alpha, options.background
        ));
    }

    let centres: Vec<DVec3> = train_views.iter().map(|view| view.camera.centre_world()).collect();
    let normalisation =
        Normalisation::of_cameras(&centres).map_err(|spread| DatasetError::NoBaseline { path: train_file, spread })?;
    let normalised = |views: Vec<View>| -> Vec<View> {
        views.into_iter().map(|view| View { camera: normalisation.camera(&view.camera), ..view }).collect()
    };
    let random = random_points_world(options.n_random_points, options.seed);
    let capture = Capture {
        train: normalised(train_views),
        test: normalised(test_views),
        points: random.into_iter().map(|point| normalisation.point(point)).collect(),
        normalisation,
        extent: EXTENT,
        background: options.background.rgb(),
    };
    let report = LoadReport {
        layout: "Blender",
        background: options.background,
        n_train: capture.train.len(),
        n_test: capture.test.len(),
        source_size_px,
        size_px: options.loaded_size_px(source_size_px.0, source_size_px.1),
        n_points: capture.points.len(),
        skipped: reader.skipped,
        notes,
    };
    Ok((capture, report))
}

fn candidates(folder: &Path, transforms: &Transforms) -> Vec<Result<Candidate, ViewFault>> {
    transforms.frames.par_iter().map(|frame| candidate(folder, frame)).collect()
}

fn candidate(folder: &Path, frame: &Frame) -> Result<Candidate, ViewFault> {
    let (rotation, translation) = world_to_camera(&frame.rows())?;
    let literal = folder.join(frame.name());
    let mut with_extension = literal.clone().into_os_string();
    with_extension.push(".png");
    let with_extension = PathBuf::from(with_extension);
    let path = if literal.is_file() {
        literal
    } else if with_extension.is_file() {
        with_extension
    } else {
        return Err(ViewFault::Missing { path: literal });
    };
    match header_size_px(&path) {
        Ok(size_px) => Ok(Candidate { path, size_px, rotation, translation }),
        Err(message) => Err(ViewFault::Unreadable { path, message }),
    }
}

/// The size most candidates have, the first of equals; `None` without candidates.
fn commonest_size_px(candidates: &[Result<Candidate, ViewFault>]) -> Option<(u32, u32)> {
    // Count and, to break ties, how early the size was first seen.
    let mut counts = BTreeMap::new();
    for (i, candidate) in candidates.iter().flatten().enumerate() {
        counts.entry(candidate.size_px).or_insert((0_usize, std::cmp::Reverse(i))).0 += 1;
    }
    counts.into_iter().max_by_key(|&(_, rank)| rank).map(|(size_px, _)| size_px)
}

fn too_few_views(path: PathBuf, transforms: &Transforms, faults: Vec<String>) -> DatasetError {
    let listed = transforms.frames.len();
    DatasetError::TooFewViews { path, usable: listed - faults.len(), listed, needed: MIN_TRAIN_VIEWS, faults }
}

/// Decodes the images of one split after the other and keeps account of what it meets.
struct Reader<'a> {
    options: &'a LoadOptions,
    /// The size every image of the capture must have.
    source_size_px: (u32, u32),
    camera_angle_x: f64,
    n_without_alpha: usize,
    skipped: Vec<SkippedView>,
}

impl Reader<'_> {
    /// The usable views of a split, in the file's order, cameras in capture units.
    fn views(
        &mut self,
        split: Split,
        transforms: &Transforms,
        candidates: Vec<Result<Candidate, ViewFault>>,
    ) -> Vec<View> {
        let this = &*self;
        let names: Vec<&str> = transforms.frames.iter().map(Frame::name).collect();
        let read: Vec<Result<(View, bool), ViewFault>> =
            candidates.into_par_iter().zip(&names).map(|(candidate, name)| this.view(candidate?, name)).collect();
        let mut views = Vec::with_capacity(read.len());
        for (result, name) in read.into_iter().zip(names) {
            match result {
                Ok((view, has_alpha)) => {
                    self.n_without_alpha += usize::from(!has_alpha);
                    views.push(view);
                }
                Err(fault) => self.skipped.push(SkippedView { split, name: name.to_owned(), fault }),
            }
        }
        views
    }

    fn view(&self, candidate: Candidate, name: &str) -> Result<(View, bool), ViewFault> {
        let Candidate { path, size_px, rotation, translation } = candidate;
        if size_px != self.source_size_px {
            return Err(ViewFault::Size { path, found_px: size_px, needed_px: self.source_size_px });
        }
        let (image, has_alpha) = read_composited(&path, self.options.background)
            .map_err(|message| ViewFault::Unreadable { path, message })?;
        let (source_width_px, source_height_px) = size_px;
        let focal_px = 0.5 * f64::from(source_width_px) / (0.5 * self.camera_angle_x).tan();
        let camera = Camera {
            rotation,
            translation,
            focal_px: [focal_px; 2],
            principal_px: [0.5 * f64::from(source_width_px), 0.5 * f64::from(source_height_px)],
            width_px: source_width_px,
            height_px: source_height_px,
        };
        let (width_px, height_px) = self.options.loaded_size_px(source_width_px, source_height_px);
        let view = View {
            name: name.to_owned(),
            camera: camera.resized(width_px, height_px),
            image: if (width_px, height_px) == size_px { image } else { image.area_resized(width_px, height_px) },
        };
        Ok((view, has_alpha))
    }
}

#[cfg(test)]
mod tests;
