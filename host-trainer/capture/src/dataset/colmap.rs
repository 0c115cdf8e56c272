//! COLMAP captures: a sparse model, `sparse/0/{cameras,images,points3D}.{bin,txt}`, beside folders of photographs.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::{DMat3, DQuat, DVec3};
use rayon::prelude::*;

use super::image::read_header;
use super::listing::{ListedView, Listing, Note, Shot, every_nth, unused_images};
use super::named_path::NamedPath;
use super::{DatasetError, Layout, LoadOptions, ViewFault, image_folder, text_file};

mod binary;
mod model;
mod text;

use model::{ModelCamera, ModelFault, ModelImage};

/// Where a model is looked for, in this order.
const MODEL_FOLDERS: [&str; 2] = ["sparse/0", "sparse"];

/// Largest deviation of a quaternion's length from 1; text files carry at least three decimals.
const MAX_QUATERNION_DEVIATION: f64 = 1e-2;

/// How a model's files are written.
#[derive(Clone, Copy)]
enum ModelEncoding {
    Binary,
    Text,
}

impl ModelEncoding {
    fn extension(self) -> &'static str {
        match self {
            Self::Binary => "bin",
            Self::Text => "txt",
        }
    }
}

/// The folder of the model and how it is written, told by its list of cameras or of images.
fn model_of(folder: &Path) -> Option<(PathBuf, ModelEncoding)> {
    let folders = MODEL_FOLDERS.iter().map(|name| folder.join(name));
    folders.into_iter().find_map(|model| {
        let encodings = [ModelEncoding::Binary, ModelEncoding::Text];
        let is_there =
            |stem: &str, encoding: ModelEncoding| model.join(stem).with_extension(encoding.extension()).is_file();
        let found = encodings.into_iter().find(|&e| is_there("cameras", e) || is_there("images", e))?;
        Some((model, found))
    })
}

/// Whether the folder is of this layout.
pub(super) fn is_layout_of(folder: &Path) -> bool {
    model_of(folder).is_some()
}

/// Lists the COLMAP capture in `folder`, views sorted by name.
///
/// # Errors
/// As [`super::load`], as far as files but no pixels tell.
pub(super) fn list(folder: &Path, options: &LoadOptions) -> Result<Listing, DatasetError> {
    let Some((model, encoding)) = model_of(folder) else {
        let looked_for = Layout::LOOKED_FOR.to_vec();
        return Err(DatasetError::UnknownLayout { path: folder.to_owned(), looked_for, inside: None });
    };
    let path = |stem: &str| model.join(stem).with_extension(encoding.extension());
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
    let mut notes = Vec::new();
    let points_path = path("points3D");
    let points = if points_path.is_file() {
        Some((points_path.clone(), read(&points_path, encoding, binary::points, text::points)?))
    } else {
        None
    };
    if points.as_ref().is_none_or(|(_, points)| points.is_empty()) {
        let why = if points.is_some() { "is empty" } else { "is missing" };
        let text = format!(
            "`{}` {why}, so training starts from random points where the cameras look; triangulate points for a better \
             start",
            points_path.display()
        );
        notes.push(Note::new("no-points", text));
    }
    if model.ends_with("0") && folder.join("sparse/1").is_dir() {
        let text = "the capture has several models, of which only `sparse/0` is read; merge them if images of the others are needed";
        notes.push(Note::new("several-models", text));
    }
    let image_folder = image_folder::choose(folder, options, &mut notes)?;
    let Some(image_folder) = image_folder.map(|name| folder.join(name)) else {
        return Err(DatasetError::ImageFolder { path: folder.to_owned(), wanted: None, present: Vec::new() });
    };
    let views: Vec<ListedView> = images
        .par_iter()
        .enumerate()
        .map(|(i, image)| ListedView {
            split: every_nth(options.test_every, i),
            name: image.name.clone(),
            shot: shot(&image_folder, image, &cameras),
        })
        .collect();
    let posed: Vec<PathBuf> =
        images.iter().filter_map(|image| NamedPath::new(&image.name).image(&image_folder, None)).collect();
    let unposed = unused_images(&image_folder, posed.iter().map(PathBuf::as_path));
    let mut listing = Listing { layout: Layout::Colmap, source: path("images"), views, points, unposed, notes };
    if !listing.has_test_views() {
        listing.notes.push(Note::no_test_views());
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
    let cannot_read = |source| DatasetError::Read { path: path.to_owned(), source };
    let parsed = match encoding {
        ModelEncoding::Binary => binary(&std::fs::read(path).map_err(cannot_read)?),
        ModelEncoding::Text => text(&text_file::read(path).map_err(cannot_read)?),
    };
    parsed.map_err(|fault| DatasetError::Model { path: path.to_owned(), place: fault.place, found: fault.found })
}

fn shot(folder: &Path, image: &ModelImage, cameras: &BTreeMap<u32, ModelCamera>) -> Result<Shot, ViewFault> {
    let (rotation, translation) = pose(image)?;
    let camera_id = image.camera_id;
    let camera = cameras.get(&camera_id).ok_or(ViewFault::NoCamera { camera_id })?;
    let path = NamedPath::new(&image.name)
        .image(folder, None)
        .ok_or_else(|| ViewFault::Missing { path: folder.join(&image.name), listed_in: "the model" })?;
    let header = match read_header(&path) {
        Ok(header) => header,
        Err(message) => return Err(ViewFault::Unreadable { path, message }),
    };
    let Some(lens) = &camera.lens else {
        return Err(ViewFault::CameraModel { model: camera.model.clone() });
    };
    let lens = lens.clone().for_image(&path, header.size_px)?;
    Ok(Shot { path, header, rotation, translation, lens, mask: None })
}

/// World to camera in OpenCV axes, as COLMAP stores it.
fn pose(image: &ModelImage) -> Result<(DMat3, DVec3), ViewFault> {
    let [w, x, y, z] = image.quaternion_wxyz;
    let quaternion = DQuat::from_xyzw(x, y, z, w);
    let length = quaternion.length();
    if length.is_nan() || (length - 1.0).abs() > MAX_QUATERNION_DEVIATION {
        return Err(ViewFault::Quaternion { length });
    }
    let translation = DVec3::from_array(image.translation);
    if !translation.is_finite() {
        return Err(ViewFault::Translation { found: image.translation });
    }
    Ok((DMat3::from_quat(quaternion.normalize()), translation))
}
