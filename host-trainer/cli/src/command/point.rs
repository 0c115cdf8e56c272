//! One run among several: trained where it is not yet, measured where it was not yet.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use anyhow::{Result, bail};
use pocketsplat_capture::dataset::{Capture, Split};
use pocketsplat_core::bundle::crc32;
use pocketsplat_trainer::metrics::Lpips;
use pocketsplat_trainer::train::module::pruning::Form;
use pocketsplat_trainer::train::run::{RunError, RunFolder};
use serde::{Deserialize, Serialize};

use super::bundle::BundleFile;
use super::capture::CaptureArgs;
use super::estimate::Estimate;
use super::eval::{Evaluation, Measurements, Renderer, evaluate};
use super::{output, train};
use crate::config::RunConfig;

/// The configuration in a run folder.
const CONFIG: &str = "config.toml";

/// Figures of a bundle, and which bundle that was.
#[derive(Serialize, Deserialize)]
struct Kept {
    bundle_crc: u32,
    evaluation: Evaluation,
}

/// Brings a point to its end, from wherever it stands; false when it was interrupted before.
pub(super) fn trained(config: &RunConfig, capture: &Capture, stop: &AtomicBool) -> Result<bool> {
    let path = config.output.with_extension("run");
    let (folder, resumes) = match RunFolder::reopen(&path) {
        Ok(folder) => {
            refuse_other(&RunConfig::read(&path.join(CONFIG))?, config, &path)?;
            (folder, true)
        }
        Err(RunError::Finished { .. }) if config.output.is_file() => {
            refuse_other(&RunConfig::read(&path.join(CONFIG))?, config, &path)?;
            eprintln!("trained before");
            return Ok(true);
        }
        // Finished without its bundle: somebody removed it.
        Err(RunError::NoRun { .. } | RunError::Finished { .. }) => {
            (RunFolder::start(&path, &config.to_toml()?, false)?, false)
        }
        Err(error) => return Err(error.into()),
    };
    let start = if resumes {
        train::Start::Resumed
    } else {
        train::Start::New(Estimate::try_out(capture, &config.train, false, stop)?)
    };
    Ok(train::train_in(folder, config, capture, start, None, stop)?.is_some())
}

/// Stops where the run in a point's folder is not the one that is asked for, in its bundle's bytes or its capture.
fn refuse_other(begun: &RunConfig, config: &RunConfig, folder: &Path) -> Result<()> {
    let difference = match begun.difference(config, train::IN_RUN_AND_ON_COMMAND_LINE)? {
        Some(difference) => difference,
        None if begun.encoding != config.encoding => "its bundle is coded in another way".to_owned(),
        None if begun.dataset != config.dataset => {
            format!("its capture is {}, not {}", begun.dataset.display(), config.dataset.display())
        }
        None => return Ok(()),
    };
    bail!("the run in {} is not the one that is asked for: {difference}; choose another --output", folder.display())
}

/// The figures of a point on the held-out views, kept beside its bundle so that they are taken once.
pub(super) fn measured(config: &RunConfig, lpips: Option<&Lpips>) -> Result<Evaluation> {
    let file = BundleFile::read(&config.output)?;
    let path = config.output.with_extension("json");
    let bundle_crc = crc32(&file.bytes);
    let kept = std::fs::read(&path).ok().and_then(|bytes| serde_json::from_slice::<Kept>(&bytes).ok());
    if let Some(kept) = kept.filter(|kept| kept.bundle_crc == bundle_crc)
        && (lpips.is_none() || kept.evaluation.lpips.is_some())
    {
        return Ok(kept.evaluation);
    }
    let capture = CaptureArgs { dataset: config.dataset.clone(), options: config.capture.clone() };
    // Tiers that nothing was trained for show only that.
    let per_tier = config.train.modules.pruning.is_some_and(|pruning| pruning.form == Form::Tiered);
    let what = Measurements { per_tier, lpips, ..Measurements::default() };
    let evaluation = evaluate(&file, &capture, Split::Test, Renderer::Core, &what)?;
    let kept = Kept { bundle_crc, evaluation };
    output::write_whole(&path, serde_json::to_string_pretty(&kept)?.as_bytes())?;
    Ok(kept.evaluation)
}
