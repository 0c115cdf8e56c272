//! Loads the capture of a run, and fills in the settings that depend on it.

use pocketsplat_core::Budget;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Result, bail};
use pocketsplat_capture::dataset::{Capture, View, remove_cache};
use pocketsplat_instructions::level::{Bound, Level};
use pocketsplat_trainer::device::Limits;
use pocketsplat_trainer::train::run::{photographs_in, points_in};

use crate::command::capture::CaptureArgs;
use crate::config::RunConfig;
use crate::say::say;

/// Where the photographs of a run come from.
pub(super) fn source_of(config: &RunConfig) -> CaptureArgs {
    CaptureArgs { dataset: config.dataset.clone(), options: config.capture.clone() }
}

/// Loads the capture that a run is configured for, and decides what the configuration left to it.
///
/// * `run`: its folder; without one photographs that are too many for the memory are decoded again for every step.
/// * `earlier`: another run's folder, which may hold points that were made of the same photographs.
pub(crate) fn load(config: &mut RunConfig, run: Option<&Path>, earlier: Option<&Path>) -> Result<Capture> {
    let source = source_of(config);
    // At once: large captures take their time.
    say!("reading {}", config.dataset.display());
    let capture = source.load_to_train(config.train.seed, run, &run.into_iter().chain(earlier).collect::<Vec<_>>())?;
    decide(config, &capture)?;
    Ok(capture)
}

/// Keeps points that were made in the folder of a run; without them the next load makes them again, so it may fail.
pub(crate) fn keep_points(capture: &Capture, run: &Path) {
    if let Some(Err(error)) = capture.made_points.as_ref().map(|points| points.write(&points_in(run))) {
        say!("warning: the points are not kept in {} and will be made again: {error}", points_in(run).display());
    }
}

/// Decides what the configuration of a run left to its capture.
pub(crate) fn decide(config: &mut RunConfig, capture: &Capture) -> Result<()> {
    check_size(capture, &config.encoding.limits)?;
    config.train = config.train.resolved_for(capture);
    if std::mem::take(&mut config.scales_lambda) && config.train.backbone.is_coded() && capture.shown < 1.0 {
        config.train.hac.lambda *= capture.shown;
        say!(
            "lambda {:.5}, since {:.0} % of the pixels show the scene",
            config.train.hac.lambda,
            100.0 * capture.shown
        );
    }
    say!("voxel size {:.5}, normalised units", config.train.voxel_size_for(capture));
    Ok(())
}

/// Returns an error if the photographs are larger than the frames that the decoder, or the level, supports.
pub(super) fn check_size(capture: &Capture, limits: &Limits) -> Result<()> {
    let [width, height] = capture.largest_px();
    if let Some(level) = limits.level.and_then(Level::numbered)
        && u64::from(width) * u64::from(height) > level.most(Bound::Frame)
    {
        let ([most_width, most_height], number) = (level.frame_px, level.number);
        bail!(
            "the photographs are {width}x{height} px, and level {number} allows frames of {most_width}x{most_height}; use \
             --resolution {most_width}x{most_height}, or a smaller --max-resolution"
        );
    }
    // Test views are drawn too.
    let size_px = |view: &View| [view.camera.width_px, view.camera.height_px];
    let most = u32::from(Budget::MAX_FRAME_PX);
    if let Some(view) = capture.train.iter().chain(&capture.test).find(|view| size_px(view).iter().any(|px| *px > most))
    {
        let ([width, height], name) = (size_px(view), &view.name);
        bail!("{name} is {width}x{height} px, and the decoder draws {most} at most; use --max-resolution {most}");
    }
    Ok(())
}

/// Removes the decoded photographs of a run that is finished; one that was interrupted needs them again.
pub(crate) fn clear_photographs(run: &Path, code: ExitCode) {
    if code == ExitCode::SUCCESS
        && let Err(error) = remove_cache(&photographs_in(run))
    {
        say!("warning: the decoded photographs of the run are still in {}: {error}", photographs_in(run).display());
    }
}
