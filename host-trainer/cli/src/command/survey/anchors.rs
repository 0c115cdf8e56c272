//! The methods of anchors.

use std::path::Path;

use anyhow::Result;
use pocketsplat_codec::render::decoder::core_image;
use pocketsplat_metrics::Lpips;

use super::families::{ANCHORS, Anchors, SHARED};
use super::point::{Figures, Point, RunResult, keep_picture, path_of, with_ending};
use crate::command::bundle::BundleFile;
use crate::command::devices::DeviceChoice;
use crate::command::loaded::LoadedCapture;
use crate::command::plan_runs::args_of_train;
use crate::command::{point, stop};
use crate::config::{ExplicitRunConfig, RunConfig};
use crate::say::say;

/// How each is trained: as the explicit scene in length, seed and photographs.
pub(super) fn configured(of: &Anchors, folder: &Path, like: &ExplicitRunConfig) -> Result<(RunConfig, DeviceChoice)> {
    let of_survey = [
        "--preset=quick".to_owned(),
        format!("--iterations={}", like.gaussians.iterations),
        format!("--seed={}", like.gaussians.seed),
    ];
    let options = of_survey.into_iter().chain([&SHARED[..], of.options].concat().into_iter().map(str::to_owned));
    let output = with_ending(&path_of(folder, of.method, of.rate), ".psb");
    let args = args_of_train(options.collect(), &like.dataset, &output)?;
    let mut config = args.resolved()?;
    config.capture = like.capture.clone();
    config.check()?;
    Ok((config, args.trainer.trains_on))
}

/// Trains and measures what is not yet; false when it was stopped before the end.
///
/// * `done`: told of each point that is there.
pub(super) fn points(
    like: &ExplicitRunConfig,
    folder: &Path,
    lpips: Option<&Lpips>,
    mut done: impl FnMut(Point) -> Result<()>,
) -> Result<bool> {
    let (stop, mut loaded) = (stop::flag()?, LoadedCapture::for_training(folder.to_owned()));
    for of in &ANCHORS {
        say!("{}, {}", of.method, of.rate);
        let (mut config, device) = configured(of, folder, like)?;
        let capture = loaded.of(&mut config)?;
        if !point::trained(&config, capture, device, &stop)? {
            return Ok(false);
        }
        let evaluation = point::measured(&config, lpips)?;
        let file = BundleFile::read(&config.output)?;
        let bundle = file.parse()?;
        keep_picture(folder, of.method, || {
            Ok(core_image(&bundle, &file.camera(&bundle, capture, &capture.test[0]))?.image)
        })?;
        let RunResult { train_s, .. } = RunResult::of(&config.output)?;
        done(Point { method: of.method, rate: of.rate, figures: Figures { train_s, evaluation } })?;
    }
    Ok(true)
}
