//! From a finished run to a bundle: coded, measured tier by tier, accounted for.

use anyhow::{Result, bail};
use pocketsplat_capture::dataset::{Capture, View};
use pocketsplat_core::{Budget, Bundle, DecodeError};
use pocketsplat_trainer::bundle::{self, BundleInfo, CodedScene, Coder, WriteError, WriteOptions};
use pocketsplat_trainer::device::{Fitted, Limits, NoFit, fitted};
use pocketsplat_trainer::manifest::{cameras_to_measure, measure};
use pocketsplat_trainer::metrics::psnr_db_masked;
use pocketsplat_trainer::render::decoder::core_image;
use pocketsplat_trainer::scene::QuantisationSteps;
use pocketsplat_trainer::train::finish::Finished;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// How a run's scene becomes a bundle; decides nothing of its training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Encoding {
    /// What gives the symbols their frequencies.
    pub(crate) coder: Coder,
    /// Pruning rates of the tiers, falling to 0.
    pub(crate) tiers: Vec<f32>,
    /// Steps of scenes without a context model.
    pub(crate) quantisation: QuantisationSteps,
    /// What the bundle has to fit into.
    #[serde(default, skip_serializing_if = "Limits::is_none")]
    pub(crate) limits: Limits,
}

/// Steps of tables, as shares of the context's mean steps, finest first.
const MEAN_STEP_SHARES: [f32; 4] = [0.5, 0.65, 0.8, 1.0];
/// What tables may cost against the context that a scene was trained with, where nobody needs them for their speed.
const LARGEST_LOSS_DB: f64 = 0.02;
/// Training views, evenly picked, that say what they cost.
const JUDGED_VIEWS: usize = 8;

impl Default for Encoding {
    fn default() -> Self {
        let WriteOptions { steps, coder, pruning_rates, .. } = WriteOptions::default();
        Self { quantisation: steps, coder, tiers: pruning_rates, limits: Limits::default() }
    }
}

impl Encoding {
    /// What can be refused before anything is trained.
    ///
    /// # Errors
    /// A step that is not positive; rates that do not fall to 0.
    pub(crate) fn validate(&self) -> Result<()> {
        let QuantisationSteps { feature, log_scale, offset } = self.quantisation;
        for (name, step) in [("feature", feature), ("log_scale", log_scale), ("offset", offset)] {
            if !(step.is_finite() && step > 0.0) {
                bail!("the quantisation step of `{name}` is {step}, needs a positive number");
            }
        }
        let falls = self.tiers.windows(2).all(|pair| pair[0] > pair[1]);
        let within = self.tiers.iter().all(|rate| (0.0..1.0).contains(rate));
        if !(falls && within && self.tiers.last() == Some(&0.0)) {
            bail!("the tiers' pruning rates are {:?}, need to fall from below 1 to 0, as 0.4,0.2,0", self.tiers);
        }
        Ok(())
    }

    /// Codes a finished scene in tiers, as much of it as fits, measures each over training views and an orbit, and writes that
    /// into the bundle.
    pub(crate) fn encode(&self, finished: Finished, capture: &Capture, held_out: &[View]) -> Result<Fitted> {
        // Photographs are not larger than frames may be: loading has seen to it.
        let [width_px, height_px] = largest_px(capture).map(|px| px as u16);
        let frame = Budget::for_frame(width_px, height_px);
        let write = |finished: &Finished| {
            let coded = self.coded(finished, capture)?;
            let cameras: Vec<_> = capture.train.iter().map(|view| view.camera.clone()).collect();
            let measures = measure(&coded.bundle()?, &cameras_to_measure(&cameras), held_out)?;
            Ok(coded.into_file(&measures)?)
        };
        Ok(fitted(finished, &self.limits, &frame, write)?)
    }

    /// Codes a scene: by its context, or by tables where they pay.
    ///
    /// A device that decodes in every frame pays six times as much for the context as for tables, and gets the finest that its flash
    /// has room for. Elsewhere tables have to be shorter and cost no more than [`LARGEST_LOSS_DB`]: their steps do not follow the
    /// place, and where a run's do, tables of the mean steps cost decibels.
    fn coded(&self, finished: &Finished, capture: &Capture) -> Result<CodedScene, NoFit> {
        let write = |coder, share| self.write(finished, coder, share, capture);
        if self.coder != Coder::Auto || finished.scene.context.is_none() {
            return Ok(write(self.coder, 1.0)?);
        }
        if self.limits.frame_instructions.is_some() {
            for share in MEAN_STEP_SHARES {
                let coded = write(Coder::Static, share)?;
                if self.limits.flash_bytes.is_none_or(|most| coded.file_len() as u64 <= most) {
                    return Ok(coded);
                }
            }
        }
        let context = write(Coder::Context, 1.0)?;
        let tables = MEAN_STEP_SHARES.into_iter().rev().map(|share| Ok(write(Coder::Static, share)?));
        let psnr_db = |coded: &CodedScene| Ok(judged_psnr_db(&coded.bundle()?, capture)?);
        shorter_and_as_good(context, tables, CodedScene::file_len, psnr_db)
    }

    fn write(
        &self,
        finished: &Finished,
        coder: Coder,
        mean_step_share: f32,
        capture: &Capture,
    ) -> Result<CodedScene, WriteError> {
        let info = BundleInfo {
            normalisation: capture.normalisation,
            background: finished.background,
            training_px: largest_px(capture),
            // Any training view will do for a device that has no camera of its own; the first is as good as another.
            preview: capture.train[0].camera.clone(),
        };
        let options = WriteOptions {
            steps: self.quantisation,
            coder,
            mean_step_share,
            importance: Some(finished.importance.clone()),
            pruning_rates: self.tiers.clone(),
            ..WriteOptions::default()
        };
        bundle::code(&finished.scene, &info, &options)
    }
}

/// The first of `others` that is shorter than `one` and loses no more than [`LARGEST_LOSS_DB`]; `one` where there is none before the
/// first that is not shorter.
fn shorter_and_as_good<T, E>(
    one: T,
    others: impl Iterator<Item = Result<T, E>>,
    len: impl Fn(&T) -> usize,
    psnr_db: impl Fn(&T) -> Result<f64, E>,
) -> Result<T, E> {
    let least_psnr_db = psnr_db(&one)? - LARGEST_LOSS_DB;
    for other in others {
        let other = other?;
        if len(&other) >= len(&one) {
            break;
        }
        if psnr_db(&other)? >= least_psnr_db {
            return Ok(other);
        }
    }
    Ok(one)
}

/// PSNR of a bundle's frames, mean over [`JUDGED_VIEWS`] training views, dB.
fn judged_psnr_db(bundle: &Bundle<'_>, capture: &Capture) -> Result<f64, DecodeError> {
    let n = JUDGED_VIEWS.min(capture.train.len());
    let psnr_db = (0..n).into_par_iter().map(|i| {
        let view = &capture.train[i * capture.train.len() / n];
        let frame = core_image(bundle, &view.camera)?;
        Ok(psnr_db_masked(&frame.image, &view.image, view.mask.as_ref()) / n as f64)
    });
    // One after the other, so that the sum does not depend on the number of threads.
    Ok(psnr_db.collect::<Result<Vec<_>, DecodeError>>()?.iter().sum())
}

/// Size of the training view with the longest side: what `eval` reduces photographs to unless told otherwise.
pub(crate) fn largest_px(capture: &Capture) -> [u32; 2] {
    let sizes = capture.train.iter().map(|view| [view.camera.width_px, view.camera.height_px]);
    sizes.max_by_key(|size| size[0].max(size[1])).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::shorter_and_as_good;

    /// Bytes and PSNR of what is taken.
    fn taken(context: (usize, f64), tables: &[(usize, f64)]) -> (usize, f64) {
        let tables = tables.iter().map(|written| Ok::<_, ()>(*written));
        shorter_and_as_good(context, tables, |written| written.0, |written| Ok(written.1)).expect("no error")
    }

    #[test]
    fn tables_are_taken_where_they_are_shorter_and_cost_nothing() {
        assert_eq!(taken((1000, 30.0), &[(900, 30.1)]), (900, 30.1));
        assert_eq!(taken((1000, 30.0), &[(900, 29.99)]), (900, 29.99), "nothing to speak of");
        assert_eq!(taken((1000, 30.0), &[(990, 27.3)]), (1000, 30.0), "decibels for a hundredth of the bytes");
        assert_eq!(taken((1000, 30.0), &[(900, 29.0), (950, 30.0)]), (950, 30.0), "finer steps, still shorter");
        assert_eq!(taken((1000, 30.0), &[(1000, 31.0), (900, 31.0)]), (1000, 30.0), "no longer looked for");
        assert_eq!(taken((1000, 30.0), &[]), (1000, 30.0));
    }
}
