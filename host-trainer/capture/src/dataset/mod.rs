//! Captures: photographs with poses, normalised.
//!
//! [`load`] tells the layout of a folder by the files in it; that layout's reader lists the views (poses, lenses, image
//! headers), and what all layouts share makes a capture of the listing: pixels in `image`, `lens` and `undistort`, the
//! common frame in `normalise`, without the cameras that `apart` sets aside; what the pixels show in `scene_kind`, initial points in
//! `starting_points`, those of a capture that brings none in `made_points`; `storage` says where the pixels of large captures lie.
//! A view that cannot be used is left out and named in the [`LoadReport`]; only a capture that cannot be trained on
//! at all is an error. [`diagnose()`] looks at the same listing and says what may go wrong.

use std::path::Path;

use glam::DVec3;
use pocketsplat_files::out_of_reach;

mod apart;
mod assemble;
mod axes;
mod blender;
mod bundler;
mod cache;
mod camera_models;
mod colmap;
mod depth_map;
mod detect;
mod diagnose;
mod error;
mod folder_names;
mod found_files;
mod frame_size;
mod framing;
mod frusta;
mod image;
mod image_file;
mod image_folder;
mod image_names;
mod layout;
mod lens;
mod listing;
mod llff;
mod looks;
mod made_points;
mod mask;
mod mask_file;
mod matching;
mod metashape;
mod missing_masks;
mod named_path;
mod nerfstudio;
mod no_poses;
mod non_finite;
mod normalise;
mod nsvf;
mod opensfm;
mod options;
mod photo;
mod photograph;
mod ply;
mod points;
mod polycam;
mod pose;
mod quaternion;
mod realitycapture;
mod record3d;
mod report;
mod scene_kind;
mod severity;
mod sources;
mod spacing;
mod split;
mod starting_points;
mod storage;
mod text_file;
mod transforms;
mod undistort;
mod unprojected;
mod unread_masks;
mod view;
mod view_fault;

pub use cache::{FileFault, remove_cache};
pub use colmap::{colmap_focal_lengths_px, colmap_posed_names, colmap_reprojection_errors_px};
pub use detect::layout_of;
pub use diagnose::{Diagnosis, Finding, MAX_FOCAL_RATIO, MaskedView, diagnose};
pub use error::DatasetError;
pub use frame_size::{FrameSize, NoFrameSize};
pub use image_names::{FILM_EXTENSIONS, PHOTOGRAPH_EXTENSIONS, PHOTOGRAPH_FOLDERS, TELEPHONE_EXTENSIONS};
pub use layout::Layout;
pub use made_points::PointsFile;
pub use mask::Mask;
pub use options::{Background, LoadOptions, MOST_IN_MEMORY_BYTES, MOST_RANDOM_POINTS, PointsChoice};
pub use photograph::Photograph;
pub use pose::PoseFault;
pub use report::{LoadReport, SkippedView};
pub use scene_kind::SceneKind;
pub use severity::Severity;
pub use sources::files_read;
pub use spacing::{PUBLISHED_VOXEL_SIZE, ROOM_VOXEL_SIZE, nearest_squared, suggested_voxel_size};
pub use split::Split;
pub use transforms::{FrameCamera, cameras_of_transforms};
pub use view::{PhotographError, View};
pub use view_fault::ViewFault;

/// An 8-bit RGB image, row-major, interleaved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Width, pixels.
    pub width_px: u32,
    /// Height, pixels.
    pub height_px: u32,
    /// `[height, width, 3]`.
    pub rgb: Vec<u8>,
}

/// The similarity that takes the capture's world to the normalised frame: `p_norm = (p_world − centre) · scale`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normalisation {
    /// Mean centre of the training cameras, capture units.
    pub centre: DVec3,
    /// Normalised units per capture unit.
    pub scale: f64,
}

/// Where initial points come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointsOrigin {
    /// From the capture: on surfaces, as dense as the photographs' features.
    Capture,
    /// From depth maps of the capture: on surfaces, evenly over the photographs.
    DepthMaps,
    /// Matched between the photographs: as those of a capture.
    Matched,
    /// Drawn at random where the cameras look.
    Random,
}

/// A capture ready for training.
#[derive(Clone, Debug)]
pub struct Capture {
    /// Views to train on.
    pub train: Vec<View>,
    /// Views held out.
    pub test: Vec<View>,
    /// Points to start from, normalised frame.
    pub points: Vec<DVec3>,
    /// Their colours, RGB; empty where they have none.
    pub point_colours: Vec<[u8; 3]>,
    /// Where they come from.
    pub points_origin: PointsOrigin,
    /// Points that were made, to be kept for the next load.
    pub made_points: Option<PointsFile>,
    /// What the photographs show.
    pub scene: SceneKind,
    /// Takes capture coordinates to the normalised frame.
    pub normalisation: Normalisation,
    /// 1.1 × the largest distance of a training camera to their mean, normalised units: [`EXTENT`] by construction.
    pub extent: f64,
    /// What lies behind everything, linear copy of the 8-bit value / 255.
    pub background: [f32; 3],
    /// Mean share of a training photograph's pixels that are not wholly transparent; 1 without alpha channels.
    pub shown: f64,
}

/// The extent every capture is scaled to, because constants such as the near cull 0.2 assume extents of about 5.
pub const EXTENT: f64 = 5.0;

/// How fine a lattice has to be is told by points within so many times the distance of the nearest quarter: matched points reach as far
/// as the photographs show, and what is far away is coarse in all of them.
const NEAR: f64 = 2.5;

impl Capture {
    /// Views of the normalised frame, none of them held out: an object on black, with points that say nothing about it.
    pub fn of_views(train: Vec<View>, points: Vec<DVec3>) -> Self {
        Self {
            train,
            test: Vec::new(),
            points,
            point_colours: Vec::new(),
            points_origin: PointsOrigin::Random,
            made_points: None,
            scene: SceneKind::Object,
            normalisation: Normalisation { centre: DVec3::ZERO, scale: 1.0 },
            extent: EXTENT,
            background: [0.0; 3],
            shown: 1.0,
        }
    }

    /// Size of the training view of most pixels.
    pub fn largest_px(&self) -> [u32; 2] {
        let sizes = self.train.iter().map(|view| [view.camera.width_px, view.camera.height_px]);
        sizes.max_by_key(|[width, height]| u64::from(*width) * u64::from(*height)).unwrap_or_default()
    }

    /// The voxel size for anchors, normalised units: [`suggested_voxel_size`] of the capture's points. Where they are random
    /// their spacing says nothing about the scene: then [`PUBLISHED_VOXEL_SIZE`] for an object and [`ROOM_VOXEL_SIZE`] for a room.
    pub fn suggested_voxel_size(&self) -> f64 {
        match (self.points_origin, self.scene) {
            (PointsOrigin::Capture, _) => suggested_voxel_size(&self.points),
            (PointsOrigin::DepthMaps | PointsOrigin::Matched, _) => suggested_voxel_size(&self.near_points()),
            (PointsOrigin::Random, SceneKind::Object) => PUBLISHED_VOXEL_SIZE,
            (PointsOrigin::Random, SceneKind::Room) => ROOM_VOXEL_SIZE,
        }
    }
}

impl Capture {
    /// The points that are no farther from a camera than [`NEAR`] times the distance of the nearest quarter.
    fn near_points(&self) -> Vec<DVec3> {
        let centres: Vec<DVec3> = self.train.iter().map(|view| view.camera.centre_world()).collect();
        let distance =
            |point: &DVec3| centres.iter().map(|c| c.distance_squared(*point)).fold(f64::INFINITY, f64::min).sqrt();
        let distances: Vec<f64> = self.points.iter().map(distance).collect();
        let most = NEAR * apart::quantile(distances.iter().copied(), 0.25);
        self.points.iter().zip(&distances).filter(|(_, distance)| **distance <= most).map(|(point, _)| *point).collect()
    }
}

/// Loads the capture in the folder `path`.
///
/// The layout is told by the files present, see [`Layout`]. Images are decoded on all threads, composited on
/// [`LoadOptions::background`], undistorted, and only then reduced, so that at most one full-size image per thread is
/// held; the result does not depend on the number of threads. Photographs of more than [`LoadOptions::in_memory_bytes`]
/// do not stay in memory: they lie in [`LoadOptions::cache`], or are decoded again whenever they are asked for.
///
/// # Errors
/// [`DatasetError`] names the file, what was found, what is needed and what to do: a folder of unknown layout, a file of
/// poses that cannot be read, a camera model that cannot be undistorted, fewer than three usable training views,
/// training cameras all in one place, or a cache that another process holds or that the disk has no room for.
pub fn load(path: &Path, options: &LoadOptions) -> Result<(Capture, LoadReport), DatasetError> {
    assemble::assemble(list(path, options)?, options)
}

/// Lists the capture in the folder `path`, without decoding pixels.
fn list(path: &Path, options: &LoadOptions) -> Result<listing::Listing, DatasetError> {
    options.check()?;
    if !path.is_dir() {
        if let Some(found) = no_poses::file_instead(path).filter(|_| path.is_file()) {
            return Err(DatasetError::NoCapture { found });
        }
        let path = path.to_owned();
        return Err(match out_of_reach(&path) {
            Some(why) => DatasetError::OutOfReach { path, why },
            None => DatasetError::NotAFolder { path },
        });
    }
    let Some(reader) = detect::reader_of(path) else { return Err(detect::unknown_layout(path)) };
    let mut listing = (reader.list)(path, options)?;
    let has_images = !matches!(listing.layout, Layout::Blender | Layout::Polycam | Layout::Record3d | Layout::Nsvf);
    for (option, is_ignored) in [
        ("--images", options.images.is_some() && !has_images),
        ("--model", options.model.is_some() && listing.layout != Layout::Colmap),
    ] {
        if is_ignored {
            let text = format!("{option} has no effect on {} captures; leave it out", listing.layout);
            listing.notes.push(listing::Note::warning("ignored-option", text));
        }
    }
    let looking_away = axes::looking_away(&listing);
    listing.notes.extend(looking_away);
    let unread_masks = unread_masks::unread(path, &listing);
    listing.notes.extend(unread_masks);
    apart::set_aside(&mut listing);
    Ok(listing)
}
