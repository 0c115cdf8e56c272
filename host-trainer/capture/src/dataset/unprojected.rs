//! Points of the depth maps that a capture brings.

use rayon::prelude::*;

use super::listing::Shot;
use super::matching::{CELL_PX, merged};
use super::points::ColouredPoint;
use super::{LoadOptions, Normalisation, frusta};

/// About so many pixels of a depth map become points before points of several photographs are merged.
const PER_VIEW: f64 = 2500.0;

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
