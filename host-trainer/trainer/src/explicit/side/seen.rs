//! What a camera sees of each Gaussian, beside what it would see if nothing stood before it.

use std::f64::consts::TAU;

use pocketsplat_capture::camera::Camera;
use pocketsplat_gaussians::{Degree, Gaussians};

use crate::explicit::Cloud;
use crate::explicit::step::draw;
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::ops::simd::Level;

/// A Gaussian is seen where this share of its light comes through: the rest is its neighbours', which overlap on any surface.
const ENOUGH: f64 = 0.2;

/// Draws small pictures of a scene to find what is seen in them.
pub(super) struct Looker {
    level: Level,
    /// In black: on white it shows what is let through.
    cloud: Cloud<f32>,
    weights: Vec<f64>,
    total: f64,
}

/// What one camera sees: Gaussians in the picture, and how far each is seen, from 0 to 1.
pub(super) struct Sight(Vec<(u32, f64)>);

impl Looker {
    /// * `gaussians`: in the normalised frame. * `chosen`: those that are looked at. * `weights`: what each of these counts.
    pub(super) fn new(gaussians: &Gaussians, compensation: bool, chosen: &[usize], weights: Vec<f64>) -> Self {
        let all = Cloud::from(gaussians);
        let mut cloud = Cloud { compensation, ..Cloud::empty(Degree::Zero) };
        for index in chosen {
            cloud.push(&all.stored(*index), &[[-10.0; 3]]);
        }
        let total = weights.iter().sum();
        Self { level: Level::detect(), cloud, weights, total }
    }

    /// The light of a Gaussian is Σ α·T over the pixels; what nothing hides has 2π·o/√|Σ'⁻¹|.
    pub(super) fn look(&self, camera: &Camera) -> Sight {
        let pinhole = Pinhole::new(camera);
        let [width, height] = pinhole.size_px;
        let drawing = draw(self.level, &self.cloud, &pinhole, [0.0; 3]);
        let lights = drawing.light(self.level, pinhole.size_px);
        let mut shares = Vec::new();
        for ((index, splat), light) in drawing.drawn.iter().zip(&drawing.splats).zip(lights) {
            let [x, y] = splat.mean_px;
            if x >= 0.0 && y >= 0.0 && x < width as f32 && y < height as f32 {
                let whole =
                    TAU * f64::from(splat.opacity) / f64::from(splat.row_precision * splat.column_precision).sqrt();
                shares.push((*index, (f64::from(light) / whole / ENOUGH).clamp(0.0, 1.0)));
            }
        }
        Sight(shares)
    }

    /// Share of the scene that a camera sees.
    pub(super) fn share(&self, sight: &Sight) -> f64 {
        sight.0.iter().map(|(i, share)| self.weights[*i as usize] * share).sum::<f64>() / self.total
    }

    /// How far the best of some cameras sees each Gaussian.
    pub(super) fn best(&self, sights: &[Sight]) -> Vec<f64> {
        let mut best = vec![0.0f64; self.weights.len()];
        for (i, share) in sights.iter().flat_map(|sight| &sight.0) {
            let best = &mut best[*i as usize];
            *best = best.max(*share);
        }
        best
    }

    /// Share of the scene that is seen so far.
    pub(super) fn weighted(&self, seen: impl Iterator<Item = f64>) -> f64 {
        seen.zip(&self.weights).map(|(seen, weight)| seen * weight).sum::<f64>() / self.total
    }

    /// Share of the pictures' light that something blocks.
    pub(super) fn blocked(&self, cameras: &[Camera]) -> f64 {
        let through = |camera: &Camera| {
            let pinhole = Pinhole::new(camera);
            let planes = draw(self.level, &self.cloud, &pinhole, [1.0; 3]).image.to_planes(pinhole.size_px);
            planes.iter().map(|value| f64::from(*value)).sum::<f64>() / planes.len() as f64
        };
        1.0 - cameras.iter().map(through).sum::<f64>() / cameras.len() as f64
    }
}
