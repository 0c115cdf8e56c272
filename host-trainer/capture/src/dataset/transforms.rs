//! Frames of transforms files, whichever layout they belong to.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::folder_names::FolderNames;
use super::image::{ImageHeader, read_header};
use super::image_folder::{FULL_SIZE, REDUCED};
use super::listing::{ListedView, Listing, Note, Shot, unused_images};
use super::mask_file::MaskFile;
use super::named_path::NamedPath;
use super::points::Points;
use super::pose::world_to_camera;
use super::{DatasetError, Layout, Split, ViewFault, found_files};
use crate::camera::Camera;

mod camera;
mod json;

pub(super) use json::{Frame, Intrinsics, Transforms, read_transforms};

/// Camera models whose parameters the fields of a transforms file spell out.
const PERSPECTIVE_MODELS: [&str; 7] =
    ["OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "PERSPECTIVE", FULL_MODEL];
const FISHEYE_MODELS: [&str; 5] =
    ["OPENCV_FISHEYE", "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE", "SIMPLE_FISHEYE", "FISHEYE"];
/// The model of which k4, k5 and k6 stand below the fraction.
const FULL_MODEL: &str = "FULL_OPENCV";

/// The name of a frame, and its camera or why it has none.
pub type FrameCamera = (String, Result<Camera, ViewFault>);

/// The cameras of a transforms file by the names of their frames, each or why it cannot be used; photographs need not be there, and
/// distortion is passed over. World: the file's own, OpenCV cameras.
///
/// * `side_px`: width and height where the file says none.
///
/// # Errors
/// [`DatasetError`] where the file cannot be read.
pub fn cameras_of_transforms(path: &Path, side_px: u32) -> Result<Vec<FrameCamera>, DatasetError> {
    let Transforms { mut shared, mut frames, .. } = read_transforms(path)?;
    // Some write sizes with fractions.
    for lens in frames.iter_mut().map(|frame| &mut frame.own).chain([&mut shared]) {
        (lens.w, lens.h) = (lens.w.map(f64::round), lens.h.map(f64::round));
    }
    let camera = |frame: &Frame| {
        let (rotation, translation) = world_to_camera(&frame.rows())?;
        let side = |own: Option<f64>, shared: Option<f64>| own.or(shared).map(|side| side as u32);
        let width_px = side(frame.own.w, shared.w).unwrap_or(side_px);
        let height_px = side(frame.own.h, shared.h).unwrap_or(width_px);
        let header = ImageHeader {
            size_px: (width_px, height_px),
            has_alpha: false,
            is_grey: false,
            is_depth_like: false,
            exif_orientation: 1,
            has_other_primaries: false,
        };
        let lens = camera::lens(&frame.own, &shared, path, &header, header.size_px)?;
        let (focal_px, principal_px) = (lens.focal_px, lens.principal_px);
        Ok(Camera { rotation, translation, focal_px, principal_px, width_px, height_px })
    };
    Ok(frames.iter().map(|frame| (frame.name().to_owned(), camera(frame))).collect())
}

impl Transforms {
    /// Refuses a camera model of all frames that cannot be undistorted.
    ///
    /// # Errors
    /// [`DatasetError::CameraModel`].
    pub(super) fn check_model(&self, path: &Path) -> Result<(), DatasetError> {
        match unknown_model(&self.shared) {
            Some(model) => {
                Err(DatasetError::CameraModel { path: path.to_owned(), camera: "all frames".to_owned(), model })
            }
            None => Ok(()),
        }
    }

    /// The first part that all frames' paths share, such as `images`.
    pub(super) fn image_folder(&self) -> Option<&str> {
        let mut folders = self.frames.iter().map(|frame| frame.path().first_folder());
        let first = folders.next()??;
        folders.all(|folder| folder == Some(first)).then_some(first)
    }
}

/// Lists frames of a layout that brings no list of splits, in their order, each with a lens of its own.
///
/// * `source`: what lists the frames; `images`: the folder that their paths start from.
/// * `of_reader`: notes of the layout's reader, which go behind those made here.
/// * `split`: of the frame at a place; none leaves it out.
pub(super) fn list_frames(
    layout: Layout,
    source: PathBuf,
    images: &Path,
    frames: &[Frame],
    points: Option<(PathBuf, Points)>,
    of_reader: Vec<Note>,
    split: impl Fn(usize) -> Option<Split> + Sync,
) -> Listing {
    let (names, shared) = (FolderNames::default(), Intrinsics::default());
    let view = |(i, frame): (usize, &Frame)| Some(frame.view(split(i)?, &names, images, None, &shared));
    let mut views: Vec<ListedView> = frames.par_iter().enumerate().filter_map(view).collect();
    let found: Vec<PathBuf> = frames.iter().filter_map(|frame| frame.image(&names, images, None)).collect();
    let unposed = unused_images(images, found.iter().map(PathBuf::as_path));
    let mut notes = found_files::check(&mut views, &names);
    if points.is_none() {
        notes.push(Note::no_points("the capture brings no points"));
    }
    let mut listing = Listing { layout, source, views, points, unposed, notes };
    if !listing.has_test_views() {
        listing.notes.push(Note::no_test_views(&listing.views));
    }
    listing.notes.extend(of_reader);
    listing
}

impl Frame {
    /// The frame as a view.
    ///
    /// * `images`: a folder that stands in for the first part of the frame's path.
    pub(super) fn view(
        &self,
        split: Split,
        names: &FolderNames,
        folder: &Path,
        images: Option<&str>,
        shared: &Intrinsics,
    ) -> ListedView {
        let shot = self.shot(names, folder, images, shared);
        ListedView { split, written: self.path().written().to_owned(), name: self.name().to_owned(), shot }
    }

    /// Width and height of the photograph that the frame's numbers are for unless they say it: of a reduced one, as `images_2` has them,
    /// that of the full size where it is there.
    fn numbers_px(&self, names: &FolderNames, folder: &Path, images: Option<&str>, header: &ImageHeader) -> (u32, u32) {
        let is_reduced = |name: &str| name.starts_with(REDUCED);
        let full = match images {
            Some(images) => is_reduced(images).then(|| self.image(names, folder, None)),
            None => folder
                .file_name()
                .is_some_and(|name| is_reduced(&name.to_string_lossy()))
                .then(|| self.image(names, &folder.with_file_name(FULL_SIZE), None)),
        };
        full.flatten().and_then(|path| read_header(&path).ok()).map_or(header.size_px, |full| full.size_px)
    }

    /// The frame's photograph, or why it cannot be used.
    fn shot(
        &self,
        names: &FolderNames,
        folder: &Path,
        images: Option<&str>,
        shared: &Intrinsics,
    ) -> Result<Shot, ViewFault> {
        let (rotation, translation) = world_to_camera(&self.rows())?;
        if let Some(model) = unknown_model(&self.own) {
            return Err(ViewFault::CameraModel { model });
        }
        let path = self
            .image(names, folder, images)
            .ok_or_else(|| ViewFault::of_missing(self.path().expected(folder, images), "the capture"))?;
        let header = read_header(&path).map_err(|message| ViewFault::of_header(&path, message))?;
        let lens = camera::lens(&self.own, shared, &path, &header, self.numbers_px(names, folder, images, &header))?;
        let mut masks: Vec<MaskFile> = MaskFile::dynamic(names, &path).into_iter().collect();
        if let Some(named) = self.mask_path.as_deref().map(NamedPath::new) {
            let missing = || ViewFault::of_missing_mask(named.expected(folder, None));
            masks.push(MaskFile::new(named.mask(names, folder).ok_or_else(missing)?));
        }
        Ok(Shot { path, header, rotation, translation, lens, masks, depth: None })
    }

    /// The frame's image file, where it is there; `images` as for [`Self::view`].
    pub(super) fn image(&self, names: &FolderNames, folder: &Path, images: Option<&str>) -> Option<PathBuf> {
        self.path().image(names, folder, images)
    }

    /// The frame's mask, where it names one that is there.
    pub(super) fn mask(&self, names: &FolderNames, folder: &Path) -> Option<PathBuf> {
        NamedPath::new(self.mask_path.as_deref()?).mask(names, folder)
    }
}

/// The name of a camera model whose distortion the fields do not spell out.
fn unknown_model(intrinsics: &Intrinsics) -> Option<String> {
    let model = intrinsics.camera_model.as_deref()?;
    let known = model.to_ascii_uppercase();
    let mut all = PERSPECTIVE_MODELS.iter().chain(&FISHEYE_MODELS);
    (!all.any(|model| *model == known)).then(|| model.to_owned())
}
