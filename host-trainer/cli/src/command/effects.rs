//! `--effects auto`: pilots of a run, their table, and the effects that the run gets.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use pocketsplat_capture::dataset::Capture;
use pocketsplat_trainer::device::Processor;
use pocketsplat_trainer::effects::{Effect, PilotCapture, Pilots, measure};
use serde::Serialize;

use crate::config::RunConfig;

use super::output;

/// The table of pilots in a run's folder.
const TABLE: &str = "effects.csv";

/// One line of the table.
#[derive(Serialize)]
struct PilotLine {
    effects: String,
    #[serde(rename = "PSNR")]
    psnr_db: f64,
    gain_db: f64,
    price_db: f64,
    instructions: u64,
    bytes: usize,
    chance_db: f64,
    chosen: bool,
}

/// Measures the effects where the configuration leaves them open and gives the run those that pay; writes the table into `folder`.
///
/// A run too short or a capture too small to measure with keeps what it has.
pub(crate) fn resolve(config: &mut RunConfig, capture: &Capture, folder: &Path) -> Result<()> {
    if !std::mem::take(&mut config.effects.auto) {
        return Ok(());
    }
    let kept = Effect::names(&Effect::all_in(&config.train));
    let least = config.effects.least_iterations;
    if config.train.iterations < least {
        eprintln!("effects: {kept}; a run needs {least} iterations to measure which ones pay");
        return Ok(());
    }
    let Some(pilots) = PilotCapture::of(capture) else {
        eprintln!("effects: {kept}; the capture has too few training views to measure which ones pay");
        return Ok(());
    };
    let started = Instant::now();
    let target = config.effects.target.unwrap_or(Processor::CortexM4);
    let begins = |effects: &[Effect]| eprintln!("effects: pilot with {}", Effect::names(effects));
    let trials = measure(&pilots, &config.train, &config.effects.price, target, &config.encoding, begins)
        .context("measuring the effects; force them with --effects to do without")?;
    let chosen = trials.each.iter().find(|trial| trial.chosen).map_or(&[][..], |trial| &trial.effects);
    eprint!("{}", table(&trials, target));
    eprintln!("effects: {}, measured in {:.0} s", Effect::names(chosen), started.elapsed().as_secs_f64());
    output::write_whole(&folder.join(TABLE), &output::csv(lines(&trials))?)?;
    config.train = Effect::measured_only(chosen, &config.train);
    Ok(())
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

fn table(trials: &Pilots, target: Processor) -> String {
    let width = trials.each.iter().map(|trial| Effect::names(&trial.effects).len()).max().unwrap_or(0);
    let mut text = format!(
        "  {:width$}  PSNR, dB  gain, dB  price, dB  instructions, M    bytes  (of pilots, on a {target:?})\n",
        "effects"
    );
    for trial in &trials.each {
        text += &format!(
            "{} {:width$}  {:8.2}  {:+8.3}  {:+9.3}  {:15.2}  {:7}\n",
            if trial.chosen { '*' } else { ' ' },
            Effect::names(&trial.effects),
            trial.worth.psnr_db,
            trial.gain_db,
            trial.price_db,
            trial.worth.instructions / 1e6,
            trial.worth.bytes,
        );
    }
    text + &format!("  up to {:.3} dB may be chance\n", trials.chance_db)
}
