//! COLMAP captures: a sparse model, `sparse/0/{cameras,images,points3D}.{bin,txt}`, beside folders of photographs and, where
//! there are any, their masks.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::{DMat3, DQuat, DVec3};
use pocketsplat_files::shown;
use rayon::prelude::*;

use super::folder_names::FolderNames;
use super::image::read_header;
use super::listing::{ListedView, Listing, Note, Shot, every_nth, unused_images};
use super::mask_file::MaskFile;
use super::named_path::NamedPath;
use super::quaternion::{long_quaternions, rotation_of};
use super::{DatasetError, Layout, LoadOptions, ViewFault, found_files, image_folder, missing_masks, text_file};

mod binary;
mod choose;
mod model;
mod text;

use choose::Chosen;
pub(super) use choose::has_model;
use model::{ModelCamera, ModelEncoding, ModelFault, ModelImage};

/// The folder of masks beside the folder of images.
const MASKS: &str = "masks";

/// Lists the COLMAP capture in `folder`, views sorted by name.
///
/// # Errors
/// As [`super::load`], as far as files but no pixels tell.
pub(super) fn list(folder: &Path, options: &LoadOptions) -> Result<Listing, DatasetError> {
    let mut notes = Vec::new();
    let Chosen { model, root, images: of_model } = choose::choose(folder, options.model, &mut notes)?;
    let (path, encoding) = (|stem: &str| model.path(stem), model.encoding);
    let cameras = read(&path("cameras"), encoding, binary::cameras, text::cameras)?;
    let mut images = read(&path("images"), encoding, binary::images, text::images)?;
    images.sort_by(|a, b| a.name.cmp(&b.name));
    for image in &images {
        if let Some(camera) = cameras.get(&image.camera_id)
            && camera.lens.is_none()
        {
            let (path, camera, model) = (path("cameras"), format!("camera {}", image.camera_id), camera.model.clone());
            return Err(DatasetError::CameraModel { path, camera, model });
        }
    }
    let points_path = path("points3D");
    let points = if points_path.is_file() {
        Some((points_path.clone(), read(&points_path, encoding, binary::points, text::points)?))
    } else {
        None
    };
    if points.as_ref().is_none_or(|(_, points)| points.is_empty()) {
        let why = if points.is_some() { "is empty" } else { "is missing" };
        notes.push(Note::no_points(&format!("`{}` {why}", shown(&points_path))));
    }
    let image_folder = match of_model.filter(|_| options.images.is_none()) {
        Some(name) => root.join(name),
        None => image_folder::needed(&root, options, &mut notes)?,
    };
    let masks = Some(root.join(MASKS)).filter(|masks| masks.is_dir());
    let names = FolderNames::default();
    let mut views: Vec<ListedView> = images
        .par_iter()
        .enumerate()
        .map(|(i, image)| ListedView {
            split: every_nth(options.test_every, i),
            written: image.name.clone(),
            name: image.name.clone(),
            shot: shot(&names, &image_folder, masks.as_deref(), image, &cameras),
        })
        .collect();
    let posed: Vec<PathBuf> =
        images.iter().filter_map(|image| NamedPath::new(&image.name).image(&names, &image_folder, None)).collect();
    let used_masks = views.iter().flat_map(|view| &view.shot).flat_map(|shot| &shot.masks).map(|mask| &mask.path);
    let unposed = unused_images(&image_folder, posed.iter().chain(used_masks).map(PathBuf::as_path));
    notes.extend(found_files::check(&mut views, &names));
    notes.extend(masks.as_deref().and_then(|masks| missing_masks::in_folder(masks, &views)));
    notes
        .extend(long_quaternions(&path("images"), images.iter().map(|image| (image.name.as_str(), quaternion(image)))));
    let mut listing = Listing { layout: Layout::Colmap, source: path("images"), views, points, unposed, notes };
    if !listing.has_test_views() {
        listing.notes.push(Note::no_test_views(&listing.views));
    }
    Ok(listing)
}

/// Reads one file of the model in either encoding.
fn read<T>(
    path: &Path,
    encoding: ModelEncoding,
    binary: fn(&[u8]) -> Result<T, ModelFault>,
    text: fn(&str) -> Result<T, ModelFault>,
) -> Result<T, DatasetError> {
    let parsed = match encoding {
        ModelEncoding::Binary => binary(&std::fs::read(path).map_err(|source| DatasetError::of_reading(path, source))?),
        ModelEncoding::Text => text(&text_file::read(path)?),
    };
    parsed.map_err(|fault| DatasetError::of_model(path, fault.place, fault.found))
}

/// The names of the images with a pose in the bytes of `images.bin`; `None` where these are damaged.
pub fn colmap_posed_names(images: &[u8]) -> Option<Vec<String>> {
    Some(binary::images(images).ok()?.into_iter().map(|image| image.name).collect())
}

/// The errors of reprojection, pixels, of the points in the bytes of `points3D.bin`; `None` where these are damaged.
pub fn colmap_reprojection_errors_px(points: &[u8]) -> Option<Vec<f64>> {
    Some(binary::points_with_errors(points).ok()?.into_iter().map(|(.., error_px)| error_px).collect())
}

/// `[fx, fy]`, pixels, of each camera in the bytes of `cameras.bin`; `None` where these are damaged or a camera's model is not read.
pub fn colmap_focal_lengths_px(cameras: &[u8]) -> Option<Vec<[f64; 2]>> {
    binary::cameras(cameras).ok()?.into_values().map(|camera| Some(camera.lens?.focal_px)).collect()
}

/// The mask of the image `name`: COLMAP appends `.png` to the image's name, others replace its extension.
fn mask_of(names: &FolderNames, masks: &Path, name: &str) -> Option<MaskFile> {
    let appended = NamedPath::new(&format!("{name}.png")).file(names, masks, None);
    appended.or_else(|| NamedPath::new(name).mask_in(names, masks)).map(MaskFile::new)
}

fn shot(
    names: &FolderNames,
    folder: &Path,
    masks: Option<&Path>,
    image: &ModelImage,
    cameras: &BTreeMap<u32, ModelCamera>,
) -> Result<Shot, ViewFault> {
    let (rotation, translation) = pose(image)?;
    let camera_id = image.camera_id;
    let camera = cameras.get(&camera_id).ok_or(ViewFault::NoCamera { camera_id })?;
    let path = NamedPath::new(&image.name)
        .image(names, folder, None)
        .ok_or_else(|| ViewFault::of_missing(folder.join(&image.name), "the model"))?;
    let header = read_header(&path).map_err(|message| ViewFault::of_header(&path, message))?;
    let Some(lens) = &camera.lens else {
        return Err(ViewFault::CameraModel { model: camera.model.clone() });
    };
    let lens = lens.clone().for_image(&path, header.size_px)?;
    let beside = masks.and_then(|masks| mask_of(names, masks, &image.name));
    let masks = beside.into_iter().chain(MaskFile::dynamic(names, &path)).collect();
    Ok(Shot { path, header, rotation, translation, lens, masks, depth: None })
}

/// The quaternion as it is written.
fn quaternion(image: &ModelImage) -> DQuat {
    let [w, x, y, z] = image.quaternion_wxyz;
    DQuat::from_xyzw(x, y, z, w)
}

/// World to camera in OpenCV axes, as COLMAP stores it.
fn pose(image: &ModelImage) -> Result<(DMat3, DVec3), ViewFault> {
    let rotation = rotation_of(quaternion(image))?;
    let translation = DVec3::from_array(image.translation);
    if !translation.is_finite() {
        return Err(ViewFault::Translation { found: image.translation });
    }
    Ok((rotation, translation))
}
