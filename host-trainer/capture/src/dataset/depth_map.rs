//! A depth map that a capture brings: of Polycam, a PNG file of millimetres; of Record3D, an LZFSE stream of metres.

use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Path, PathBuf};

use image::ImageReader;

/// Metres in the millimetre of Polycam.
const MILLIMETRE: f64 = 1e-3;

/// Record3D's steps of confidence are 0, 1 and 2: from the highest on a depth is believed.
const SURE_LZFSE: f64 = 2.0;
/// Polycam's highest step is white; the upper half of the 16 bits that every PNG is read as.
const SURE_PNG: f64 = 32_768.0;

/// The depth map of a photograph, and how sure its pixels are.
#[derive(Clone, Debug)]
pub(super) struct DepthMap {
    pub(super) path: PathBuf,
    /// Of the same size.
    pub(super) confidence: Option<PathBuf>,
}

/// Values of a map, row-major.
pub(super) struct Map {
    pub(super) width_px: usize,
    pub(super) height_px: usize,
    pub(super) values: Vec<f64>,
}

impl DepthMap {
    /// The file `depth` if it is there, with the file `confidence` if that is.
    pub(super) fn at(depth: PathBuf, confidence: PathBuf) -> Option<Self> {
        depth.is_file().then(|| Self { path: depth, confidence: Some(confidence).filter(|path| path.is_file()) })
    }

    pub(super) fn files(&self) -> impl Iterator<Item = &Path> {
        std::iter::once(self.path.as_path()).chain(self.confidence.as_deref())
    }

    /// Depths in metres, 0 where there is none or where the sensor is not sure.
    pub(super) fn read(&self, photograph_px: (u32, u32)) -> Option<Map> {
        let mut depths = Map::read(&self.path, photograph_px)?;
        if let Some(path) = &self.confidence {
            let sure = Map::read(path, photograph_px).filter(|sure| sure.values.len() == depths.values.len())?;
            let least = if is_png(path) { SURE_PNG } else { SURE_LZFSE };
            depths.values.iter_mut().zip(&sure.values).filter(|(_, sure)| **sure < least).for_each(|(d, _)| *d = 0.0);
        }
        let unit = if is_png(&self.path) { MILLIMETRE } else { 1.0 };
        depths.values.iter_mut().for_each(|depth| *depth *= unit);
        Some(depths)
    }
}

fn is_png(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "png")
}

impl Map {
    /// * `photograph_px`: its shape is that of a map whose file names no size.
    fn read(path: &Path, photograph_px: (u32, u32)) -> Option<Self> {
        if is_png(path) {
            let image =
                ImageReader::new(BufReader::new(File::open(path).ok()?)).with_guessed_format().ok()?.decode().ok()?;
            let (width_px, height_px) = (image.width() as usize, image.height() as usize);
            // Eight bits become the same part of sixteen.
            let values = image.into_luma16().into_raw().into_iter().map(f64::from).collect();
            return Some(Self { width_px, height_px, values });
        }
        let mut bytes = Vec::new();
        lzfse_rust::decode_bytes(&fs::read(path).ok()?, &mut bytes).ok()?;
        let values: Vec<f64> = if path.extension().is_some_and(|extension| extension == "conf") {
            bytes.iter().map(|byte| f64::from(*byte)).collect()
        } else {
            bytes.as_chunks().0.iter().map(|four| f64::from(f32::from_le_bytes(*four))).collect()
        };
        let (width, height) = (f64::from(photograph_px.0), f64::from(photograph_px.1));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the side of a map")]
        let width_px = (values.len() as f64 * width / height).sqrt().round() as usize;
        let height_px = values.len().checked_div(width_px)?;
        (width_px * height_px == values.len()).then_some(Self { width_px, height_px, values })
    }
}
