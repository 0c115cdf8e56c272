//! The manifest: what each tier looks like and what drawing it takes, measured after the scene is coded.
//!
//! One pass over the views counts for all tiers, because tiers are nested: what an anchor adds to a frame is counted in
//! its tier, and tier t has the sum up to t.

mod frame;
mod orbit;

use pocketsplat_core::{Bundle, DecodeError, chunks_in_view};
use pocketsplat_format::bundle::TierMeasures;
use rayon::prelude::*;

use crate::bundle::decoded_scene;
use crate::render::decoder::core_image_of_tiers;
use frame::TierCounts;
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{PhotographError, View};
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::step::Workspace;
use pocketsplat_metrics::psnr_db_masked;

/// Most training cameras that are measured.
const MAX_TRAINING_CAMERAS: usize = 48;

/// Cameras worth measuring: at most 48 of those given, evenly picked, and 24 on an orbit around what they look at.
///
/// * `cameras`: in the normalised frame.
pub fn cameras_to_measure(cameras: &[Camera]) -> Vec<Camera> {
    let n = cameras.len().min(MAX_TRAINING_CAMERAS);
    let picked = (0..n).map(|i| cameras[i * cameras.len() / n].clone());
    picked.chain(orbit::around(cameras)).collect()
}

/// Why tiers cannot be measured.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// A damaged bundle or an unusable camera.
    #[error(transparent)]
    Decode(#[from] DecodeError),
    /// A photograph that does not lie in memory could not be read.
    #[error(transparent)]
    Photograph(#[from] PhotographError),
}

/// Measures every tier of a bundle: [`count`], then [`compare`].
///
/// * `cameras`: over which maxima are taken. * `held_out`: views whose photographs the tiers are compared with.
///
/// # Errors
/// [`MeasureError`].
pub fn measure(bundle: &Bundle<'_>, cameras: &[Camera], held_out: &[View]) -> Result<Vec<TierMeasures>, MeasureError> {
    let mut measures = count(bundle, cameras)?;
    compare(bundle, &mut measures, held_out)?;
    Ok(measures)
}

/// What drawing each tier of a bundle takes.
///
/// Counts are those of the trainer's renderer, whose arithmetic differs from the decoder's in the last bits. Those of
/// anchors are of the prefilter alone, pixel evaluations are those inside the splats' ellipses, as if no pixel ended
/// early: both are upper bounds of what a decoder does in
/// frames of the training size. Cost: the splats of a frame a camera, no pixel of it.
///
/// * `cameras`: over which maxima are taken.
///
/// # Errors
/// [`MeasureError`].
pub fn count(bundle: &Bundle<'_>, cameras: &[Camera]) -> Result<Vec<TierMeasures>, MeasureError> {
    let scene = decoded_scene(bundle)?;
    let ends: Vec<u32> =
        (0..bundle.n_tiers()).filter_map(|t| bundle.directory().tier(t)).map(|t| t.n_anchors).collect();
    let mut workspace = Workspace::new(&scene.shape);
    let mut maxima = vec![TierCounts::default(); ends.len()];
    for camera in cameras {
        workspace.project(&scene, &Pinhole::new(camera));
        let counts = frame::count(&scene.shape, workspace.blocks(), &ends, camera);
        for (most, counts) in maxima.iter_mut().zip(counts) {
            most.raise_to(&counts);
        }
        let core = pocketsplat_kernels::camera::core_camera(camera)?;
        for (tier, most) in maxima.iter_mut().enumerate() {
            let in_view = chunks_in_view(bundle, &core, tier as u8 + 1)?;
            most.decoded_anchors = most.decoded_anchors.max(in_view.map(|chunk| u64::from(chunk.n_anchors())).sum());
        }
    }
    Ok(maxima.iter().map(|counts| counts.measures(cameras.len())).collect())
}

/// Compares what each tier of a bundle shows with photographs, and notes it in its measures. Cost: one decoded frame a tier and view.
///
/// * `held_out`: views of these photographs.
///
/// # Errors
/// [`MeasureError`].
pub fn compare(bundle: &Bundle<'_>, measures: &mut [TierMeasures], held_out: &[View]) -> Result<(), MeasureError> {
    for (n_tiers, of_tier) in (1..).zip(measures) {
        of_tier.psnr_db = mean_psnr_db(bundle, n_tiers, held_out)?;
        of_tier.n_views = u16::try_from(held_out.len()).unwrap_or(u16::MAX);
    }
    Ok(())
}

/// Mean PSNR over views of 8-bit images, dB; `None` without views.
///
/// * `n_tiers`: of these tiers' scene.
///
/// # Errors
/// [`MeasureError`].
pub fn mean_psnr_db(bundle: &Bundle<'_>, n_tiers: u8, views: &[View]) -> Result<Option<f32>, MeasureError> {
    let psnr = views.par_iter().map(|view| {
        let frame = core_image_of_tiers(bundle, &view.camera, n_tiers)?;
        let photograph = view.photograph()?;
        Ok(psnr_db_masked(&frame.image, &photograph.image, photograph.mask.as_ref()))
    });
    let psnr = psnr.collect::<Result<Vec<f64>, MeasureError>>()?;
    Ok((!psnr.is_empty()).then(|| (psnr.iter().sum::<f64>() / psnr.len() as f64) as f32).filter(|x| x.is_finite()))
}
