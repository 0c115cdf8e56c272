//! What codes the symbols of a scene: static tables, and of which steps, or the context model.

use pocketsplat_capture::dataset::{Capture, View};
use pocketsplat_format::Bundle;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{EncodeError, Encoding};
use crate::train::limits::Finished;
use pocketsplat_codec::bundle::{BundleInfo, ChannelCoding, CodedScene, WriteError, WriteOptions, code, mean_steps};
use pocketsplat_codec::render::decoder::core_image;
use pocketsplat_metrics::psnr_db_masked;

/// Steps of tables as shares of the context's mean steps, finest first.
const MEAN_STEP_SHARES: [f32; 4] = [0.5, 0.65, 0.8, 1.0];
/// Mean steps cost up to 0.8 dB, which the bytes that they save are worth below about this share of the context's: bundles of up to 25 or
/// 40 kB (`docs/experiments/2026-11-23-scenes-that-fill-a-budget.md`).
const TABLES_SHARE: f64 = 0.8;
/// What tables may lose against the context that a scene was trained with, where nobody needs them for their speed, dB.
const LARGEST_LOSS_DB: f64 = 0.02;
/// Training views, evenly picked, over which that is measured.
const JUDGED_VIEWS: usize = 8;

/// What a configuration says about the coder of a scene that has a context model; any other scene has tables.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CoderChoice {
    /// For a device that decodes in every frame, the tables of the finest steps that fit its flash: the context takes six times
    /// their instructions. Within a number of bytes, what draws training views better once the scene is cut to them. Otherwise the
    /// context, unless tables make a smaller file and lose no more than 0.02 dB over training views.
    #[default]
    Auto,
    /// Tables, cheap to decode: of the context's mean steps, or of the finest that fit where bytes are limited.
    Static,
    /// The context model.
    Context,
}

/// The candidates for the bundle of a scene.
struct Candidates<'a> {
    finished: &'a Finished,
    info: BundleInfo,
    tiers: &'a [f32],
}

impl Candidates<'_> {
    fn coded(&self, channels: ChannelCoding) -> Result<CodedScene, WriteError> {
        let default = WriteOptions::default();
        let options = WriteOptions {
            channels,
            importance: Some(self.finished.importance.clone()),
            pruning_rates: self.tiers.to_vec(),
            head_fraction_bits: self.finished.head_fraction_bits.map(|bits| [bits; 2]).or(default.head_fraction_bits),
            ..default
        };
        code(&self.finished.scene, &self.info, &options)
    }
}

impl Encoding {
    /// Whether a number of bytes is all that decides between tables and context.
    pub(super) fn chooses_within_bytes(&self) -> bool {
        self.coder == CoderChoice::Auto && self.limits.processor.is_none() && self.limits.flash_bytes.is_some()
    }

    /// Codes a scene that is still trained as its bundle will most likely be, as far as lengths tell.
    pub(super) fn expected(&self, finished: &Finished, capture: &Capture) -> Result<CodedScene, EncodeError> {
        let candidates = self.candidates(finished, capture);
        if finished.scene.context.is_none() {
            return Ok(candidates.coded(ChannelCoding::Tables(self.quantisation))?);
        }
        let context = || candidates.coded(ChannelCoding::Context);
        let tables = || candidates.coded(ChannelCoding::Tables(mean_steps(&finished.scene)?));
        Ok(match self.coder {
            CoderChoice::Context => context()?,
            CoderChoice::Static => tables()?,
            CoderChoice::Auto if self.limits.processor.is_some() => tables()?,
            CoderChoice::Auto => {
                let (context, tables) = (context()?, tables()?);
                let share = tables.file_len() as f64 / context.file_len() as f64;
                if share < TABLES_SHARE { tables } else { context }
            }
        })
    }

    fn candidates<'a>(&'a self, finished: &'a Finished, capture: &Capture) -> Candidates<'a> {
        let info = BundleInfo {
            normalisation: capture.normalisation,
            background: finished.background,
            training_px: capture.largest_px(),
            // Any training view will do for a device that has no camera of its own.
            preview: capture.train[0].camera.clone(),
            protocol: finished.protocol.clone(),
        };
        Candidates { finished, info, tiers: &self.tiers }
    }

    /// Codes a finished scene as [`CoderChoice`] says.
    ///
    /// Cost: up to five codings; with [`CoderChoice::Auto`] and no device, up to 40 decoded frames.
    pub(super) fn coded(&self, finished: &Finished, capture: &Capture) -> Result<CodedScene, EncodeError> {
        let candidates = self.candidates(finished, capture);
        if self.coder == CoderChoice::Context {
            return Ok(candidates.coded(ChannelCoding::Context)?);
        }
        if finished.scene.context.is_none() {
            return Ok(candidates.coded(ChannelCoding::Tables(self.quantisation))?);
        }
        let mean = mean_steps(&finished.scene)?;
        let tables = |share| candidates.coded(ChannelCoding::Tables(mean.scaled(share)));
        let fits = |coded: &CodedScene| self.limits.flash_bytes.is_none_or(|most| coded.file_len() as u64 <= most);
        let as_fine_as_fit = match self.coder {
            CoderChoice::Static => self.limits.flash_bytes.is_some(),
            _ => self.limits.processor.is_some(),
        };
        if as_fine_as_fit {
            for share in MEAN_STEP_SHARES {
                let coded = tables(share)?;
                if fits(&coded) {
                    return Ok(coded);
                }
            }
        }
        if self.coder == CoderChoice::Static {
            return Ok(tables(1.0)?);
        }
        let context = candidates.coded(ChannelCoding::Context)?;
        if !fits(&context) {
            // Tables that fit, before anchors are left out.
            let tables = tables(1.0)?;
            return Ok(if tables.file_len() < context.file_len() { tables } else { context });
        }
        let tables = MEAN_STEP_SHARES.into_iter().rev().map(|share| Ok(tables(share)?));
        smaller_and_as_good(context, tables, CodedScene::file_len, |coded| {
            judged_psnr_db(&coded.bundle().map_err(WriteError::ReadBack)?, &capture.train)
        })
    }
}

/// The first of `others` that is smaller than `one` and loses no more than [`LARGEST_LOSS_DB`]; `one` where there is none before the
/// first that is not smaller.
fn smaller_and_as_good<T, E>(
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

/// PSNR of a bundle's frames, mean over [`JUDGED_VIEWS`] of `views`, dB.
pub(super) fn judged_psnr_db(bundle: &Bundle<'_>, views: &[View]) -> Result<f64, EncodeError> {
    let n = JUDGED_VIEWS.min(views.len());
    let psnr_db = (0..n).into_par_iter().map(|i| {
        let view = &views[i * views.len() / n];
        let frame = core_image(bundle, &view.camera);
        let frame = frame.map_err(|source| EncodeError::Draw { view: view.name.clone(), source })?;
        let photograph = view.photograph()?;
        Ok(psnr_db_masked(&frame.image, &photograph.image, photograph.mask.as_ref()) / n as f64)
    });
    // One after the other, so that the sum does not depend on the number of threads.
    Ok(psnr_db.collect::<Result<Vec<_>, EncodeError>>()?.iter().sum())
}

#[cfg(test)]
mod tests {
    use super::smaller_and_as_good;

    /// Bytes and PSNR of what is taken.
    fn taken(context: (usize, f64), tables: &[(usize, f64)]) -> (usize, f64) {
        let tables = tables.iter().map(|coded| Ok::<_, ()>(*coded));
        smaller_and_as_good(context, tables, |coded| coded.0, |coded| Ok(coded.1)).expect("no error")
    }

    #[test]
    fn tables_are_taken_where_they_are_smaller_and_lose_nothing() {
        assert_eq!(taken((1000, 30.0), &[(900, 30.1)]), (900, 30.1));
        assert_eq!(taken((1000, 30.0), &[(900, 29.99)]), (900, 29.99), "less than anybody sees");
        assert_eq!(taken((1000, 30.0), &[(990, 27.3)]), (1000, 30.0), "decibels for a hundredth of the bytes");
        assert_eq!(taken((1000, 30.0), &[(900, 29.0), (950, 30.0)]), (950, 30.0), "finer steps, still smaller");
        assert_eq!(
            taken((1000, 30.0), &[(1000, 31.0), (900, 31.0)]),
            (1000, 30.0),
            "the search ends at the first that is not"
        );
        assert_eq!(taken((1000, 30.0), &[]), (1000, 30.0));
    }
}
