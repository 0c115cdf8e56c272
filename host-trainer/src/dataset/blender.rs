//! Blender (Synthetic-NeRF) captures: `transforms_{train,val,test}.json` beside RGBA images.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};
use rayon::prelude::*;
use serde::Deserialize;

use super::image::{header_size_px, read_composited};
use super::normalise::random_points_world;
use super::pose::world_to_camera;
use super::{
    Capture, DatasetError, EXTENT, LoadOptions, LoadReport, Normalisation, SkippedView, Split, View, ViewFault,
};
use crate::camera::Camera;

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

#[derive(Deserialize)]
struct Transforms {
    /// Horizontal field of view of all frames, radians.
    camera_angle_x: f64,
    frames: Vec<Frame>,
}

#[derive(Deserialize)]
struct Frame {
    /// Relative to the capture, usually without extension.
    file_path: String,
    /// Camera to world, OpenGL axes; `null` stands for a number that is none.
    transform_matrix: Vec<Vec<Option<f64>>>,
}

impl Frame {
    /// The path as people write it.
    fn name(&self) -> &str {
        self.file_path.trim_start_matches("./")
    }
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
        notes.push(format!("the {} views of `{VAL_FILE}` are not used", val.frames.len()));
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
            "{} images have no alpha channel, so what they show behind the object is trained as part of it; export \
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

/// Reads a transforms file that need not be there.
fn read_optional(folder: &Path, name: &str) -> Result<Option<Transforms>, DatasetError> {
    let path = folder.join(name);
    if path.exists() { read_transforms(&path).map(Some) } else { Ok(None) }
}

fn read_transforms(path: &Path) -> Result<Transforms, DatasetError> {
    let text = std::fs::read_to_string(path).map_err(|source| DatasetError::Read { path: path.to_owned(), source })?;
    let parsed = serde_json::from_str::<Transforms>(&text).or_else(|error| {
        // Python writes the bare words NaN and Infinity, which JSON lacks; read as null they cost one view, not all.
        // The first error is the one to tell: its column is right.
        serde_json::from_str(&null_non_finite(&text)).map_err(|_| error)
    });
    let transforms = parsed.map_err(|source| DatasetError::Transforms { path: path.to_owned(), source })?;
    let angle = transforms.camera_angle_x;
    if angle > 0.0 && angle < std::f64::consts::PI {
        Ok(transforms)
    } else {
        Err(DatasetError::FieldOfView { path: path.to_owned(), found: angle })
    }
}

/// Replaces the bare words `NaN`, `Infinity` and `-Infinity` outside strings by `null`.
fn null_non_finite(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut inside_string = false;
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let word = ["NaN", "-Infinity", "Infinity"].into_iter().find(|word| !inside_string && rest.starts_with(word));
        let taken = match word {
            Some(word) => {
                out.push_str("null");
                word.len()
            }
            None => {
                // A backslash takes the next character with it, so that \" does not end the string.
                let escaped = if c == '\\' { rest[1..].chars().next().map_or(0, char::len_utf8) } else { 0 };
                inside_string ^= c == '"';
                out.push_str(&rest[..c.len_utf8() + escaped]);
                c.len_utf8() + escaped
            }
        };
        rest = &rest[taken..];
    }
    out
}

fn candidates(folder: &Path, transforms: &Transforms) -> Vec<Result<Candidate, ViewFault>> {
    transforms.frames.par_iter().map(|frame| candidate(folder, frame)).collect()
}

fn candidate(folder: &Path, frame: &Frame) -> Result<Candidate, ViewFault> {
    let rows: Vec<Vec<f64>> = frame
        .transform_matrix
        .iter()
        .map(|row| row.iter().map(|number| number.unwrap_or(f64::NAN)).collect())
        .collect();
    let (rotation, translation) = world_to_camera(&rows)?;
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
