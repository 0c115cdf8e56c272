//! Points matched between photographs whose poses are known, for captures that bring none.
//!
//! A place of one photograph lies on a line in another, so no structure from motion is needed: corners of each photograph are searched for
//! along their rays in its neighbours, coarse to fine, by normalised cross-correlation; what at least three photographs show and what leads
//! back is triangulated.

mod corners;
mod merge;
mod neighbours;
mod picture;
mod ray;
mod search;
#[cfg(test)]
mod tests;
mod triangulate;

use glam::DVec3;
use rayon::prelude::*;

use picture::{Level, Picture};

pub(super) use merge::{CELL_PX, merged};

use super::listing::Shot;
use super::points::ColouredPoint;
use super::{EXTENT, LoadOptions, Normalisation, Photograph, frusta};
use crate::camera::Camera;

/// The larger side of the photographs that are matched, pixels.
const LARGEST_PX: u32 = 640;
/// Of the corners, every so many-th tells how far away things are.
const SAMPLE: usize = 8;
/// So many points of a photograph tell how far away things are in it.
const TELLING: usize = 12;
/// Where three quarters of the points are within so many times the distance of the nearest quarter, neighbours for the median do for all.
const DEEP: f64 = 2.5;
/// The search for things at a distance begins at this part of it.
const NEAREST: f64 = 0.2;
/// Distances looked at first, of that of the focus.
const FIRST: [f64; 3] = [0.2, 1.0, 5.0];

/// Photographs, and how far away things are in each.
struct Scene {
    pictures: Vec<Picture>,
    /// Depths around which things are in each, normalised units.
    distances: Vec<Vec<f64>>,
}

/// Pixels of a photograph as it is matched, the mean of these; at least one.
pub(super) fn mean_pixels(shots: &[Shot]) -> f64 {
    let pixels = |shot: &Shot| {
        let (width, height) = shot.header.size_px;
        let scale = (f64::from(LARGEST_PX) / f64::from(width.max(height))).min(1.0);
        scale * scale * f64::from(width) * f64::from(height)
    };
    shots.iter().map(pixels).sum::<f64>() / shots.len() as f64
}

/// The points that at least three of these photographs show, normalised; the same for any number of threads.
///
/// * `shots`: those to train on.
///
/// Work: some 100 patches of 49 pixels for each of 1,500 corners a photograph and each of 6 neighbours. Memory: a byte and a third for
/// each of at most 640 × 640 pixels a photograph.
pub(super) fn matched(shots: &[Shot], normalisation: &Normalisation, options: &LoadOptions) -> Vec<ColouredPoint> {
    let at_size = LoadOptions { max_resolution: Some(LARGEST_PX), frame: None, ..options.clone() };
    let read = |shot: &Shot| {
        let photo = shot.read(&at_size).ok()?;
        let nothing = shot.header.has_alpha.then(|| options.background.rgb8());
        Some(seen(&photo.photograph, normalisation.camera(&photo.camera), nothing))
    };
    between(shots.par_iter().filter_map(read).unzip())
}

/// A place of a photograph and its colour.
#[derive(Clone, Copy)]
struct Corner {
    at: [f64; 2],
    rgb: [u8; 3],
}

/// What is matched of a photograph; `camera` and `nothing` as for [`Picture::new`].
fn seen(photograph: &Photograph, camera: Camera, nothing: Option<[u8; 3]>) -> (Picture, Vec<Corner>) {
    let image = &photograph.image;
    let picture = Picture::new(photograph, camera, nothing);
    let coloured = |at: [f64; 2]| {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a pixel of the image")]
        let i = 3 * (at[1] as usize * image.width_px as usize + at[0] as usize);
        Corner { at, rgb: [image.rgb[i], image.rgb[i + 1], image.rgb[i + 2]] }
    };
    let corners = corners::corners(&picture.levels[0]).into_iter().map(coloured).collect();
    (picture, corners)
}

/// The points that at least three pictures show, in the cameras' frame.
fn between((pictures, corners): (Vec<Picture>, Vec<Vec<Corner>>)) -> Vec<ColouredPoint> {
    let cameras: Vec<&Camera> = pictures.iter().map(|picture| &picture.camera).collect();
    let focus = frusta::distances(&cameras).unwrap_or_else(|| vec![EXTENT; pictures.len()]);
    let distances = focus.iter().map(|focus| FIRST.map(|share| share * focus).to_vec()).collect();
    let mut scene = Scene { pictures, distances };
    let sample = corners.iter().map(|of_view| of_view.iter().copied().step_by(SAMPLE).collect()).collect::<Vec<_>>();
    scene.learn_distances(&scene.found(&sample));
    let pixel_width = |view: usize, depth: f64| depth / scene.pictures[view].camera.focal_px[0];
    let found = scene.found(&corners).into_iter().enumerate();
    merged(
        &found
            .flat_map(|(view, of_view)| {
                of_view.into_iter().map(move |(point, depth)| (point, pixel_width(view, depth)))
            })
            .collect::<Vec<_>>(),
    )
}

/// A point and its depth in the photograph whose corner it is.
type Found = (ColouredPoint, f64);

impl Scene {
    /// The point of each corner of each photograph that has one.
    fn found(&self, corners: &[Vec<Corner>]) -> Vec<Vec<Found>> {
        let of_view = |(view, corners): (usize, &Vec<Corner>)| {
            let targets: Vec<(Vec<usize>, f64)> = self.distances[view]
                .iter()
                .map(|&distance| (neighbours::neighbours(self, view, distance), NEAREST * distance))
                .filter(|(others, _)| others.len() >= 2)
                .collect();
            let point = |&Corner { at, rgb }: &Corner| {
                let at_distance = |(others, nearest): &(Vec<usize>, f64)| {
                    triangulate::point(self, search::sightings(self, view, at, others, *nearest)?)
                };
                let point = targets.iter().find_map(at_distance)?;
                let camera = &self.pictures[view].camera;
                Some((ColouredPoint { at: point, rgb }, (camera.rotation * point + camera.translation).z))
            };
            corners.par_iter().filter_map(point).collect()
        };
        corners.par_iter().enumerate().map(of_view).collect()
    }

    /// Takes from points how far away things are in each photograph, where there are enough; else from all photographs.
    fn learn_distances(&mut self, found: &[Vec<Found>]) {
        let sorted = |mut depths: Vec<f64>| {
            depths.sort_by(f64::total_cmp);
            depths
        };
        let all = sorted(found.iter().flatten().map(|(_, depth)| *depth).collect());
        for (view, found) in found.iter().enumerate() {
            let own = sorted(found.iter().map(|(_, depth)| *depth).collect());
            let telling = if own.len() < TELLING { &all } else { &own };
            if telling.len() >= TELLING {
                let quantile = |quarters: usize| telling[quarters * telling.len() / 4];
                let is_deep = quantile(3) > DEEP * quantile(1);
                self.distances[view] = if is_deep { vec![quantile(1), quantile(3)] } else { vec![quantile(2)] };
            }
        }
    }

    fn level(&self, view: usize, level: usize) -> Option<&Level> {
        self.pictures[view].levels.get(level)
    }

    /// The point at an inverse depth on the ray of a place.
    fn point(&self, view: usize, at: [f64; 2], inverse_depth: f64) -> DVec3 {
        frusta::along_ray(&self.pictures[view].camera, at, 1.0 / inverse_depth)
    }
}
