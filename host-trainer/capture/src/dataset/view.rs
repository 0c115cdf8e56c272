//! A photograph's place in the scene, and how to come by its pixels.

use std::path::PathBuf;
use std::sync::Arc;

use pocketsplat_files::shown;

use super::cache::{CacheFile, FileFault};
use super::listing::Shot;
use super::{LoadOptions, Photograph, ViewFault};
use crate::camera::Camera;

/// One photograph and the camera that took it, in the normalised frame.
///
/// A clone shares the photograph.
#[derive(Clone, Debug)]
pub struct View {
    /// Name as the capture gives it, for messages and file names.
    pub name: String,
    /// Camera in the normalised frame, for the photograph's size.
    pub camera: Camera,
    pixels: Pixels,
}

/// Where the pixels are.
#[derive(Clone, Debug)]
enum Pixels {
    InMemory(Arc<Photograph>),
    /// Decoded, in a file.
    InCache(Arc<CacheFile>),
    /// In the capture, to be decoded.
    InCapture(Arc<SourceFile>),
    /// Another view's, reduced to this one's size.
    Reduced(Arc<View>),
}

/// A photograph of the capture, and what it was when it was loaded.
#[derive(Debug)]
pub(super) struct SourceFile {
    pub(super) shot: Shot,
    pub(super) options: LoadOptions,
    pub(super) crc32: u32,
    pub(super) has_mask: bool,
}

/// Why a photograph that was there when the capture was loaded is not to be read any more.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "each message names its fields")]
pub enum PhotographError {
    /// A file of the cache is gone or damaged.
    #[error(
        "view {view}: its decoded photograph `{}` {fault}; go on with `train --resume`, which decodes it again",
        shown(path)
    )]
    Cache { view: String, path: PathBuf, fault: FileFault },
    /// A photograph of the capture can no longer be decoded.
    #[error("view {view}: it was sound when the capture was loaded, and now its {fault}")]
    Capture { view: String, fault: ViewFault },
    /// A photograph of the capture is another one than before.
    #[error("view {view}: `{}` has changed since the capture was loaded; start again", shown(path))]
    Changed { view: String, path: PathBuf },
}

impl View {
    /// A view whose photograph lies in memory.
    ///
    /// * `camera`: for the photograph's size.
    pub fn new(name: String, camera: Camera, photograph: Photograph) -> Self {
        Self { name, camera, pixels: Pixels::InMemory(Arc::new(photograph)) }
    }

    pub(super) fn in_cache(name: String, camera: Camera, file: CacheFile) -> Self {
        Self { name, camera, pixels: Pixels::InCache(Arc::new(file)) }
    }

    pub(super) fn in_capture(name: String, camera: Camera, file: SourceFile) -> Self {
        Self { name, camera, pixels: Pixels::InCapture(Arc::new(file)) }
    }

    /// The photograph; free where it lies in memory, else it is read, or decoded again.
    ///
    /// # Errors
    /// [`PhotographError`] where it does not lie in memory and its file is gone, damaged or another one.
    pub fn photograph(&self) -> Result<Arc<Photograph>, PhotographError> {
        match &self.pixels {
            Pixels::InMemory(photograph) => Ok(photograph.clone()),
            Pixels::InCache(file) => match file.read() {
                Ok(photograph) => Ok(Arc::new(photograph)),
                Err(fault) => {
                    Err(PhotographError::Cache { view: self.name.clone(), path: file.path().to_owned(), fault })
                }
            },
            Pixels::InCapture(file) => {
                let photo = file.shot.read(&file.options);
                let photo = photo.map_err(|fault| PhotographError::Capture { view: self.name.clone(), fault })?;
                if photo.photograph.crc32() != file.crc32 {
                    let path = file.shot.path.clone();
                    return Err(PhotographError::Changed { view: self.name.clone(), path });
                }
                Ok(Arc::new(photo.photograph))
            }
            Pixels::Reduced(view) => {
                let Camera { width_px, height_px, .. } = self.camera;
                Ok(Arc::new(view.photograph()?.area_resized(width_px, height_px)))
            }
        }
    }

    /// Whether [`Self::photograph`] costs nothing.
    pub fn is_in_memory(&self) -> bool {
        matches!(self.pixels, Pixels::InMemory(_))
    }

    /// Puts another photograph of the same size in the place of this one, in memory.
    pub fn set_photograph(&mut self, photograph: Photograph) {
        self.pixels = Pixels::InMemory(Arc::new(photograph));
    }

    /// Whether some pixels may not count.
    pub fn has_mask(&self) -> bool {
        match &self.pixels {
            Pixels::InMemory(photograph) => photograph.mask.is_some(),
            Pixels::InCache(file) => file.has_mask(),
            Pixels::InCapture(file) => file.has_mask,
            Pixels::Reduced(view) => view.has_mask(),
        }
    }

    /// Bytes of the photograph, decoded.
    pub fn decoded_bytes(&self) -> usize {
        self.camera.width_px as usize * self.camera.height_px as usize * if self.has_mask() { 4 } else { 3 }
    }

    /// [`Photograph::crc32`], without reading the photograph where it does not lie in memory.
    ///
    /// Of a [halved](Self::halved) photograph that is not in memory, a checksum of the whole one and of the size.
    pub fn crc32(&self) -> u32 {
        match &self.pixels {
            Pixels::InMemory(photograph) => photograph.crc32(),
            Pixels::InCache(file) => file.crc32(),
            Pixels::InCapture(file) => file.crc32,
            Pixels::Reduced(view) => {
                let numbers = [view.crc32(), self.camera.width_px, self.camera.height_px];
                crc32fast::hash(numbers.map(u32::to_le_bytes).as_flattened())
            }
        }
    }

    /// The view with each side half as long, averaged by area: now where the photograph lies in memory, else whenever it is
    /// asked for.
    pub fn halved(&self) -> Self {
        let [width_px, height_px] = [self.camera.width_px, self.camera.height_px].map(|px| (px / 2).max(1));
        let pixels = match &self.pixels {
            Pixels::InMemory(photograph) => Pixels::InMemory(Arc::new(photograph.area_resized(width_px, height_px))),
            _ => Pixels::Reduced(Arc::new(self.clone())),
        };
        Self { name: self.name.clone(), camera: self.camera.resized(width_px, height_px), pixels }
    }
}
