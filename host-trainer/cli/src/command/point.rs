//! One run among several: trained where it is not yet, measured where it was not yet.

use std::sync::atomic::AtomicBool;

use anyhow::{Context, Result, bail};
use pocketsplat_capture::dataset::{Capture, Split};
use pocketsplat_files::Outputs;
use pocketsplat_format::bundle::crc32;
use pocketsplat_metrics::Lpips;
use pocketsplat_trainer::train::modules::pruning::Form;
use pocketsplat_trainer::train::run::RunFolder;

use super::bundle::BundleFile;
use super::capture::CaptureArgs;
use super::devices::DeviceChoice;
use super::estimate::Estimate;
use super::eval::{Evaluation, Measurements, Renderer, evaluate, lpips_of};
use super::output;
use super::outputs::{BUNDLE, keep};
use super::train::{self, Attempt, GoesOn, RunStatus, Start};
use crate::config::{Protocol, RunConfig};
use crate::say::say;

/// Brings a point to its end, from wherever it stands; false when it was interrupted before. A device is opened where something is left
/// to do.
pub(super) fn trained(config: &RunConfig, capture: &Capture, device: DeviceChoice, stop: &AtomicBool) -> Result<bool> {
    let (folder, start, device) = match RunStatus::of(&RunFolder::beside(&config.output), config)? {
        RunStatus::New(folder) => {
            let device = device.open()?;
            let before = Estimate::try_out(capture, &config.train, false, device.clone(), stop)?;
            (folder, Start::New(before), device)
        }
        RunStatus::Begun(folder) => (folder, Start::Resumed, device.open()?),
        RunStatus::Finished => {
            let folder = RunFolder::beside(&config.output);
            let file = BundleFile::of_run(&folder, config)?;
            if let Some(why) = file.protocol(&file.parse()?).and_then(|protocol| protocol.contradiction(capture)) {
                bail!(
                    "the run in {} is not the one that is asked for: {why}; choose another --output",
                    folder.display()
                );
            }
            say!("trained before");
            return Ok(true);
        }
    };
    // Another file than a bundle was refused before the first run began.
    let output = Outputs::new(true).reading_folder(&config.dataset).file(&config.output, BUNDLE)?;
    let attempt = Attempt { device, stop, goes_on: GoesOn::SameCommand };
    Ok(train::train_in(folder, config, capture, start, attempt, &output)?.is_some())
}

/// The figures of a point on the held-out views, kept beside its bundle so that they are taken once.
pub(super) fn measured(config: &RunConfig, lpips: Option<&Lpips>) -> Result<Evaluation> {
    let file = BundleFile::read(&config.output)?;
    let path = config.output.with_extension("json");
    let bundle_crc = Some(crc32(&file.bytes));
    let own = file.protocol(&file.parse()?);
    if path.is_file() {
        let kept = serde_json::from_slice::<Evaluation>(&std::fs::read(&path)?);
        let kept = kept.with_context(|| format!("{} has no figures of a bundle; move it away", path.display()))?;
        let is_own = |protocol: &Protocol| own.as_ref().is_none_or(|own| own.shares_capture_with(protocol));
        let as_loaded = |protocol: &Protocol| Protocol::said(&config.capture) == protocol.options && is_own(protocol);
        let is_alike = kept.split == Split::Test.to_string()
            && kept.renderer == Renderer::Core.name()
            && kept.protocol.as_ref().is_some_and(as_loaded);
        let has_all = lpips.is_none_or(|lpips| kept.lpips_of == Some(lpips_of(lpips)));
        if kept.bundle_crc == bundle_crc {
            if !is_alike {
                bail!(
                    "{} has figures of this bundle that were taken otherwise, or of another capture; move it away",
                    path.display()
                );
            }
            if has_all {
                return Ok(kept);
            }
        }
    }
    let capture = CaptureArgs { dataset: config.dataset.clone(), options: config.capture.clone() };
    let what = Measurements { per_tier: has_trained_tiers(config), lpips, ..Measurements::default() };
    let evaluation = evaluate(&file, &capture, Split::Test, Renderer::Core, &what)?;
    let is_own = own.zip(evaluation.protocol.as_ref()).is_none_or(|(own, of)| own.shares_capture_with(of));
    if is_own {
        keep(&path, output::json(&evaluation)?.as_bytes())?;
    }
    Ok(evaluation)
}

/// Whether tiers are worth measuring: those that nothing was trained for show only that.
pub(super) fn has_trained_tiers(config: &RunConfig) -> bool {
    config.train.modules.pruning.is_some_and(|pruning| pruning.form == Form::Tiered)
}
