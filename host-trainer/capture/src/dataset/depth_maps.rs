//! Points from depth maps that a capture brings: of Polycam, PNG files of millimetres; of Record3D, LZFSE streams of metres.

use std::fs::{self, File};
use std::io::BufReader;
use std::path::{Path, PathBuf};

use image::ImageReader;
use rayon::prelude::*;

use super::listing::Shot;
use super::made_points::ColouredPoint;
use super::matching::{CELL_PX, merged};
use super::{LoadOptions, Normalisation, frusta};

/// About so many pixels of a depth map become points before points of several photographs are merged.
const PER_VIEW: f64 = 2500.0;
/// Metres in the millimetre of Polycam.
const MILLIMETRE: f64 = 1e-3;

/// The depth map of a photograph, and how sure its pixels are.
#[derive(Clone, Debug)]
pub(super) struct DepthMap {
    pub(super) path: PathBuf,
    /// Of the same size.
    pub(super) confidence: Option<PathBuf>,
}

/// Values of a map, row-major.
struct Map {
    width_px: usize,
    height_px: usize,
    values: Vec<f64>,
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
    fn read(&self, photograph_px: (u32, u32)) -> Option<Map> {
        let mut depths = Map::read(&self.path, photograph_px)?;
        if let Some(path) = &self.confidence {
            let sure = Map::read(path, photograph_px).filter(|sure| sure.values.len() == depths.values.len())?;
            // Of three steps the highest: 0, 1 and 2 with Record3D, up to 255 with Polycam.
            let most = sure.values.iter().copied().fold(0.0, f64::max);
            depths.values.iter_mut().zip(&sure.values).filter(|(_, sure)| **sure < most).for_each(|(d, _)| *d = 0.0);
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
            // Eight bits stay what they are: they are compared with each other alone.
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

/// The points that these depth maps show, normalised; a map that cannot be read gives none.
pub(super) fn unprojected(shots: &[Shot], normalisation: &Normalisation, options: &LoadOptions) -> Vec<ColouredPoint> {
    let of_shot = |shot: &Shot| -> Vec<(ColouredPoint, f64)> {
        let Some(map) = shot.depth.as_ref().and_then(|depth| depth.read(shot.header.size_px)) else {
            return Vec::new();
        };
        let Ok(photo) = shot.read(&LoadOptions { frame: None, ..options.clone() }) else { return Vec::new() };
        let image = &photo.photograph.image;
        let stride = ((map.values.len() as f64 / PER_VIEW).sqrt().round() as usize).max(1);
        let camera = normalisation.camera(&photo.camera).resized(map.width_px as u32, map.height_px as u32);
        let mut points = Vec::new();
        for y in (stride / 2..map.height_px).step_by(stride) {
            for x in (stride / 2..map.width_px).step_by(stride) {
                let depth = map.values[y * map.width_px + x] * normalisation.scale;
                let (column, row) =
                    (x * image.width_px as usize / map.width_px, y * image.height_px as usize / map.height_px);
                let i = row * image.width_px as usize + column;
                let counts = photo.photograph.mask.as_ref().is_none_or(|mask| mask.valid[i]);
                if counts && depth.is_finite() && depth > 0.0 {
                    let at = frusta::along_ray(&camera, [x as f64 + 0.5, y as f64 + 0.5], depth);
                    let rgb = [image.rgb[3 * i], image.rgb[3 * i + 1], image.rgb[3 * i + 2]];
                    // Cells as wide as pixels that are taken are apart.
                    points.push((ColouredPoint { at, rgb }, depth * stride as f64 / (CELL_PX * camera.focal_px[0])));
                }
            }
        }
        points
    };
    merged(&shots.par_iter().flat_map(of_shot).collect::<Vec<_>>())
}
