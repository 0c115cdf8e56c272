//! Which of a capture's sparse models to read: COLMAP makes a new one wherever photographs do not join.

use std::path::{Path, PathBuf};

use super::model::ModelEncoding;
use super::{binary, text};
use crate::dataset::listing::Note;
use crate::dataset::{DatasetError, image_folder, text_file};

/// Where models are looked for, in this order: directly and in numbered folders.
const PLACES: [Place; 6] = [
    Place { root: "", models: "sparse", images: None },
    Place { root: "", models: "colmap/sparse", images: None },
    // Beside the images themselves.
    Place { root: "", models: "", images: None },
    // Of the photographs before they were undistorted, as the scripts of this field leave it.
    Place { root: "", models: "distorted/sparse", images: Some("input") },
    // What COLMAP's automatic reconstruction and `image_undistorter` leave: photographs of their own.
    Place { root: "dense/0", models: "sparse", images: None },
    Place { root: "dense", models: "sparse", images: None },
];

/// A place of models, below the capture's folder.
struct Place {
    /// Where the folders of images and of masks lie.
    root: &'static str,
    /// Below the root.
    models: &'static str,
    /// The folder of the images that the models are of, where it is another than usual.
    images: Option<&'static str>,
}

impl Place {
    /// The models there.
    fn models(&self, folder: &Path) -> Vec<ModelFiles> {
        let root = folder.join(self.root);
        // A folder of models is no capture.
        if self.models.is_empty() && !image_folder::is_there(&root) {
            return Vec::new();
        }
        models_in(&root.join(self.models))
    }
}

/// A model, the folder that its images lie in or below, and which of the folders there where it is another than usual.
pub(super) struct Chosen {
    pub(super) model: ModelFiles,
    pub(super) root: PathBuf,
    pub(super) images: Option<&'static str>,
}

/// A sparse model on disk.
pub(super) struct ModelFiles {
    folder: PathBuf,
    pub(super) encoding: ModelEncoding,
    /// As its folder is called; none for a model outside of numbered folders.
    number: Option<u32>,
}

impl ModelFiles {
    /// The model in a folder, told by its list of cameras or of images.
    fn new(folder: PathBuf, number: Option<u32>) -> Option<Self> {
        let is_there =
            |stem: &str, encoding: ModelEncoding| folder.join(stem).with_extension(encoding.extension()).is_file();
        let encodings = [ModelEncoding::Binary, ModelEncoding::Text];
        let encoding = encodings.into_iter().find(|&e| is_there("cameras", e) || is_there("images", e))?;
        Some(Self { folder, encoding, number })
    }

    /// The file of this name.
    pub(super) fn path(&self, stem: &str) -> PathBuf {
        self.folder.join(stem).with_extension(self.encoding.extension())
    }

    /// Number of images with a pose in the model; 0 where its list is unreadable.
    fn n_images(&self) -> usize {
        let path = self.path("images");
        match self.encoding {
            ModelEncoding::Binary => std::fs::read(path).ok().and_then(|bytes| binary::images(&bytes).ok()),
            ModelEncoding::Text => text_file::read(&path).ok().and_then(|lines| text::images(&lines).ok()),
        }
        .map_or(0, |images| images.len())
    }
}

/// The models in `folder/models`: those in folders with a number, by number, or the one that lies there itself.
fn models_in(models: &Path) -> Vec<ModelFiles> {
    let entries = std::fs::read_dir(models).into_iter().flatten().flatten();
    let numbered = entries.filter_map(|entry| {
        let number = entry.file_name().to_str()?.parse().ok()?;
        ModelFiles::new(entry.path(), Some(number))
    });
    let mut found: Vec<ModelFiles> = numbered.collect();
    found.sort_by_key(|model| model.number);
    if found.is_empty() { ModelFiles::new(models.to_owned(), None).into_iter().collect() } else { found }
}

/// Whether a model lies in `sparse`, or in any folder that is looked into.
pub(in crate::dataset) fn has_model(folder: &Path, only_in_sparse: bool) -> bool {
    let n = if only_in_sparse { 1 } else { PLACES.len() };
    PLACES[..n].iter().any(|place| !place.models(folder).is_empty())
}

/// The model with the number `wanted`, or the one that poses the most images, the first of equals; says what else there is.
///
/// # Errors
/// [`DatasetError::ModelNumber`] where that number is not there, [`DatasetError::NoModel`] where no model is.
pub(super) fn choose(folder: &Path, wanted: Option<u32>, notes: &mut Vec<Note>) -> Result<Chosen, DatasetError> {
    let mut places = PLACES.iter().map(|place| (place, place.models(folder)));
    let Some((place, models)) = places.find(|(_, models)| !models.is_empty()) else {
        return Err(DatasetError::NoModel { path: folder.to_owned() });
    };
    let root = if place.root.is_empty() { folder.to_owned() } else { folder.join(place.root) };
    let images = place.images.filter(|images| root.join(images).is_dir());
    let model = if let Some(wanted) = wanted {
        let present: Vec<u32> = models.iter().filter_map(|model| model.number).collect();
        let found = models.into_iter().find(|model| model.number == Some(wanted));
        found.ok_or_else(|| DatasetError::ModelNumber { path: folder.to_owned(), wanted, present })?
    } else {
        largest(models, notes)
    };
    Ok(Chosen { model, root, images })
}

/// The model that poses the most images, of at least one; says what else there is.
fn largest(mut models: Vec<ModelFiles>, notes: &mut Vec<Note>) -> ModelFiles {
    if models.len() < 2 {
        return models.swap_remove(0);
    }
    let counts: Vec<usize> = models.iter().map(ModelFiles::n_images).collect();
    let most = counts.iter().copied().max().unwrap_or(0);
    let largest = counts.iter().position(|&count| count == most).unwrap_or(0);
    let number = |model: &ModelFiles| model.number.unwrap_or(0);
    let list: Vec<String> =
        models.iter().zip(&counts).map(|(model, count)| format!("{} poses {count} images", number(model))).collect();
    let text = format!(
        "the capture has {} models, which share no frame: {}; the largest, {}, is read: choose another with `--model N`, or \
         merge them (colmap model_merger) if images of the others are needed",
        models.len(),
        list.join(", "),
        number(&models[largest])
    );
    notes.push(Note::new("several-models", text));
    models.swap_remove(largest)
}
