//! Means over the views of what the heads make of each offset.

use glam::{DMat3, DQuat, DVec3};
use pocketsplat_gaussians::{Degree, Gaussians};
use rayon::prelude::*;

use super::least_squares::Equations;
use super::principal_axes::principal_axes;
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::ops::heads::neural_gaussians::Gaussian;
use pocketsplat_kernels::scene::Scene;
use pocketsplat_kernels::step::Workspace;

/// What a Gaussian that reaches the image behind others counts, as if it filled this part of a pixel: its colour is not seen, but a
/// view that does see it should not find it black.
const HIDDEN_WEIGHT: f32 = 1e-3;

/// Opacities are held this far from 0 and 1, where their logits end.
const OPACITY_MARGIN: f64 = 1e-4;

/// No deviation is below this, normalised units: ln has to be finite.
const LEAST_DEVIATION: f64 = 1e-7;

/// Explicit Gaussians, and what was left out.
pub struct Baked {
    /// In the scene's frame, in the order of anchors and offsets.
    pub gaussians: Gaussians,
    /// Offsets that may be drawn, but reach no training image.
    pub n_unseen: usize,
}

/// Sums over the views that one offset's Gaussian reaches.
#[derive(Clone)]
struct Seen {
    centre: [f32; 3],
    weight: f64,
    opacity: f64,
    covariance: DMat3,
    colour: Equations,
}

impl Default for Seen {
    fn default() -> Self {
        // A matrix is the identity by default.
        Self { centre: [0.0; 3], weight: 0.0, opacity: 0.0, covariance: DMat3::ZERO, colour: Equations::default() }
    }
}

impl Seen {
    fn add(&mut self, degree: Degree, eye: [f32; 3], gaussian: &Gaussian<f32>, weight: f32) {
        let direction =
            (DVec3::from(gaussian.centre.map(f64::from)) - DVec3::from(eye.map(f64::from))).normalize_or_zero();
        let [w, x, y, z] = gaussian.rotation.map(f64::from);
        let axes =
            DMat3::from_quat(DQuat::from_xyzw(x, y, z, w)) * DMat3::from_diagonal(gaussian.scale.map(f64::from).into());
        self.centre = gaussian.centre;
        self.weight += f64::from(weight);
        self.opacity += f64::from(weight * gaussian.opacity);
        self.covariance += f64::from(weight) * (axes * axes.transpose());
        self.colour.add(degree, direction.to_array().map(|part| part as f32), gaussian.colour, weight);
    }

    fn push(&self, degree: Degree, out: &mut Gaussians) {
        let (variances, rotation) = principal_axes(self.covariance * (1.0 / self.weight));
        let opacity = (self.opacity / self.weight).clamp(OPACITY_MARGIN, 1.0 - OPACITY_MARGIN);
        out.centres.push(self.centre);
        out.log_scales.push(variances.map(|variance| variance.sqrt().max(LEAST_DEVIATION).ln() as f32));
        out.rotations.push(rotation.map(|part| part as f32));
        out.opacity_logits.push((opacity / (1.0 - opacity)).ln() as f32);
        out.harmonics.extend(self.colour.solve(degree));
    }
}

/// The explicit Gaussians nearest to what `cameras` see of a scene.
///
/// A view counts for a Gaussian by the light that it gives the image there, Σ α·T over its pixels. Opacity and covariance are the means,
/// and the covariance's principal axes are scales and rotation; colours are harmonics by least squares. What no camera sees is left out.
///
/// Cost: each view drawn forwards and backwards once, and 1 kB of memory for each Gaussian.
///
/// * `scene`: values as the decoder has them. * `degree`: of the colours.
pub fn bake(scene: &Scene<f32>, cameras: &[Pinhole<f32>], degree: Degree) -> Baked {
    let n_offsets = scene.shape.n_offsets;
    let mut workspace = Workspace::new(&scene.shape);
    // Boxed, since most offsets are masked.
    let mut seen: Vec<Option<Box<Seen>>> = vec![None; scene.anchors.len() * n_offsets];
    for camera in cameras {
        let contributions = workspace.contributions(scene, camera);
        let drawn = workspace.blocks().iter().flat_map(|block| block.drawn.iter().map(move |i| (block, *i as usize)));
        for ((block, i), contribution) in drawn.zip(contributions) {
            let source = block.sources[i];
            let offset = block.anchors[source.row as usize] as usize * n_offsets + source.offset as usize;
            let weight = contribution.max(0.0) + HIDDEN_WEIGHT;
            seen[offset].get_or_insert_default().add(degree, camera.centre_world, &block.gaussians[i], weight);
        }
    }
    let n_drawn = (0..seen.len()).filter(|offset| scene.anchors.is_drawn(*offset)).count();
    let parts: Vec<Gaussians> = seen
        .par_chunks(4096)
        .map(|seen| {
            let mut part = Gaussians { degree, ..Gaussians::default() };
            seen.iter().flatten().for_each(|seen| seen.push(degree, &mut part));
            part
        })
        .collect();
    let mut gaussians = Gaussians { degree, ..Gaussians::default() };
    for part in parts {
        gaussians.centres.extend(part.centres);
        gaussians.log_scales.extend(part.log_scales);
        gaussians.rotations.extend(part.rotations);
        gaussians.opacity_logits.extend(part.opacity_logits);
        gaussians.harmonics.extend(part.harmonics);
    }
    Baked { n_unseen: n_drawn - gaussians.len(), gaussians }
}
