//! `--effects auto`: pilots of a run, their table, and the effects that the run gets.

mod pilots;

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use pocketsplat_capture::dataset::Capture;
use pocketsplat_instructions::Processor;
use pocketsplat_trainer::effects::{Effect, PilotCapture, PilotError, PilotTraining, Pilots, measure};
use pocketsplat_trainer::train::run::RunFolder;
use serde::{Deserialize, Serialize};

use crate::config::RunConfig;
use crate::say::say;

use super::output;
use super::outputs::keep;
use super::train::Attempt;
use pilots::PilotsFile;

/// The table of pilots in a run's folder.
const TABLE: &str = "effects.csv";

/// One line of the table.
#[derive(Serialize, Deserialize)]
pub(super) struct PilotLine {
    pub(super) effects: String,
    #[serde(rename = "PSNR")]
    pub(super) psnr_db: f64,
    pub(super) gain_db: f64,
    pub(super) price_db: f64,
    pub(super) instructions: u64,
    pub(super) bytes: usize,
    chance_db: f64,
    pub(super) chosen: bool,
}

impl PilotLine {
    /// The table of a run; none where its effects were not measured.
    pub(super) fn of_run(folder: &Path) -> Result<Option<Vec<Self>>> {
        let path = folder.join(TABLE);
        if !path.exists() {
            return Ok(None);
        }
        let read = || csv::Reader::from_path(&path)?.deserialize().collect();
        let lines: csv::Result<Vec<Self>> = read();
        Ok(Some(lines.with_context(|| format!("{} is no table of effects", path.display()))?))
    }
}

/// Whether a run can begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Resolved {
    /// Its effects are known.
    Ready,
    /// `stop` was set before they were; the pilots that are done are kept.
    Interrupted,
}

/// Whether [`resolve`] will train pilots.
pub(crate) fn are_measured(config: &RunConfig, capture: &Capture) -> bool {
    let is_long = config.train.iterations >= config.effects.least_iterations;
    config.effects.auto && is_long && PilotCapture::can_be_of(capture)
}

/// Measures the effects where the configuration leaves them open and gives the run those that pay; writes the table into `folder`.
///
/// A run too short or a capture too small to measure with keeps what it has.
pub(crate) fn resolve(
    config: &mut RunConfig,
    capture: &Capture,
    folder: &RunFolder,
    attempt: &Attempt<'_>,
) -> Result<Resolved> {
    if !std::mem::take(&mut config.effects.auto) {
        return Ok(Resolved::Ready);
    }
    let kept = Effect::names(&Effect::all_in(&config.train));
    let least = config.effects.least_iterations;
    if config.train.iterations < least {
        say!("effects: {kept}; a run needs {least} iterations to measure which ones pay");
        return Ok(Resolved::Ready);
    }
    let Some(views) = PilotCapture::of(capture) else {
        say!("effects: {kept}; the capture has too few training views to measure which ones pay");
        return Ok(Resolved::Ready);
    };
    let started = Instant::now();
    let (price, target) = (config.effects.price, config.effects.target.unwrap_or(Processor::CortexM4));
    let mut log = PilotsFile::open(folder.pilots())?;
    let Attempt { device, stop, goes_on } = attempt;
    let training = PilotTraining { capture: &views, config: &config.train, device: device.clone(), stop };
    let measured = measure(&training, &price, target, &config.encoding, &mut log);
    log.end();
    let trials = match measured {
        Err(PilotError::Interrupted) => {
            say!(
                "interrupted while effects were measured, {} pilots are kept; {}",
                log.n_done(),
                goes_on.said(folder.path())
            );
            return Ok(Resolved::Interrupted);
        }
        other => other.context("measuring the effects; force them with --effects to do without")?,
    };
    let chosen = trials.each.iter().find(|trial| trial.chosen).map_or(&[][..], |trial| &trial.effects);
    let for_device = (price.instructions_db > 0.0).then_some(target);
    crate::say::text(&table(&trials, for_device));
    say!("effects: {}, measured in {:.0} s", Effect::names(chosen), started.elapsed().as_secs_f64());
    keep(&folder.path().join(TABLE), &output::csv(lines(&trials))?)?;
    config.train = Effect::measured_only(chosen, &config.train);
    Ok(Resolved::Ready)
}

fn lines(trials: &Pilots) -> impl Iterator<Item = PilotLine> {
    trials.each.iter().map(|trial| PilotLine {
        effects: Effect::names(&trial.effects),
        psnr_db: trial.worth.psnr_db,
        gain_db: trial.gain_db,
        price_db: trial.price_db,
        instructions: trial.worth.instructions.round() as u64,
        bytes: trial.worth.bytes,
        chance_db: trials.chance_db,
        chosen: trial.chosen,
    })
}

/// * `device`: whose instructions count, if any do.
fn table(trials: &Pilots, device: Option<Processor>) -> String {
    let width = trials.each.iter().map(|trial| Effect::names(&trial.effects).len()).max().unwrap_or(0);
    let counted = |text: String| if device.is_some() { text } else { String::new() };
    let mut text = format!(
        "  {:width$}  PSNR, dB  gain, dB  price, dB{}    bytes  (of pilots{})\n",
        "effects",
        counted("  instructions, M".to_owned()),
        device.map_or_else(String::new, |target| format!(", on a {target:?}")),
    );
    for trial in &trials.each {
        text += &format!(
            "{} {:width$}  {:8.2}  {:+8.3}  {:+9.3}{}  {:7}\n",
            if trial.chosen { '*' } else { ' ' },
            Effect::names(&trial.effects),
            trial.worth.psnr_db,
            trial.gain_db,
            trial.price_db,
            counted(format!("  {:15.2}", trial.worth.instructions / 1e6)),
            trial.worth.bytes,
        );
    }
    text + &format!("  up to {:.3} dB may be chance\n", trials.chance_db)
}
