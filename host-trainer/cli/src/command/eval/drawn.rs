//! Views drawn and compared with their photographs.

use std::sync::Arc;
use std::time::Instant;

use anyhow::Result;
use pocketsplat_capture::dataset::{Image, Photograph, View};
use pocketsplat_metrics::{Lpips, colour_corrected, half_size_enlarged, psnr_db_masked, ssim_masked};
use rayon::prelude::*;

use super::ViewEvaluation;

/// One drawn view and how it compares.
#[derive(Clone)]
pub(super) struct DrawnView {
    /// To draw it; the first view alone is not drawn beside others.
    pub(super) seconds: f64,
    pub(super) scratch_bytes: usize,
    pub(super) psnr_db: f64,
    pub(super) cc_psnr_db: f64,
    pub(super) ssim: f64,
    pub(super) lpips: Option<f64>,
    pub(super) psnr_to_reference_db: f64,
    pub(super) half_size_copy_psnr_db: f64,
}

/// Draws every view and compares it: the first alone, so that its time says something, then the others side by side.
///
/// * `draw`: the picture of a view, and the bytes of scratch that it took. * `to_reference`: PSNR of a picture to another renderer's.
pub(super) fn drawn_views(
    views: &[View],
    draw: impl Fn(&View) -> Result<(Image, usize)> + Sync,
    to_reference: impl Fn(&Image, &View) -> f64 + Sync,
    lpips: Option<&Lpips>,
) -> Result<Vec<DrawnView>> {
    let drawn = |view: &View| -> Result<(DrawnView, Image, Arc<Photograph>)> {
        let started = Instant::now();
        let (image, scratch_bytes) = draw(view)?;
        let seconds = started.elapsed().as_secs_f64();
        let photograph = view.photograph()?;
        let (truth, mask) = (&photograph.image, photograph.mask.as_ref());
        let row = DrawnView {
            seconds,
            scratch_bytes,
            psnr_db: psnr_db_masked(&image, truth, mask),
            cc_psnr_db: psnr_db_masked(&colour_corrected(&image, truth, mask), truth, mask),
            ssim: ssim_masked(&image, truth, mask),
            lpips: None,
            psnr_to_reference_db: to_reference(&image, view),
            half_size_copy_psnr_db: psnr_db_masked(&half_size_enlarged(truth), truth, mask),
        };
        Ok((row, image, photograph))
    };
    let (first, others) = views.split_at(1.min(views.len()));
    let Some(lpips) = lpips else {
        let side_by_side = |views: &[View]| views.par_iter().map(|view| Ok(drawn(view)?.0)).collect::<Result<Vec<_>>>();
        return Ok([side_by_side(first)?, side_by_side(others)?].concat());
    };
    let mut rows = Vec::with_capacity(views.len());
    // A few pictures at a time: those of all views may be more than the memory holds.
    for views in std::iter::once(first).chain(others.chunks(rayon::current_num_threads())) {
        let drawn = views.par_iter().map(&drawn).collect::<Result<Vec<_>>>()?;
        // One view after another: the features of a view fill hundreds of bytes a pixel, and fill every thread by themselves.
        for (row, image, photograph) in drawn {
            let distance = lpips.distance(&image, &photograph.image, photograph.mask.as_ref())?;
            rows.push(DrawnView { lpips: Some(distance), ..row });
        }
    }
    Ok(rows)
}

pub(super) fn mean(rows: &[DrawnView], value: fn(&DrawnView) -> f64) -> f64 {
    rows.iter().map(value).sum::<f64>() / rows.len() as f64
}

/// Each view by itself, and the mean LPIPS where it is measured.
pub(super) fn view_evaluations(rows: &[DrawnView], views: &[View]) -> (Option<f64>, Vec<ViewEvaluation>) {
    let of_view = |(row, view): (&DrawnView, &View)| ViewEvaluation {
        name: view.name.clone(),
        psnr_db: row.psnr_db,
        cc_psnr_db: Some(row.cc_psnr_db),
        ssim: row.ssim,
        lpips: row.lpips,
    };
    let distances: Option<Vec<f64>> = rows.iter().map(|row| row.lpips).collect();
    let mean = distances.map(|values| values.iter().sum::<f64>() / values.len() as f64);
    (mean, rows.iter().zip(views).map(of_view).collect())
}
