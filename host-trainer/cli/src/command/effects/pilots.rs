//! The pilots of a run that are done, in a file of its folder, and what is said while others are trained.

use std::io::{self, ErrorKind, IsTerminal};
use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result};
use indicatif::ProgressBar;
use pocketsplat_trainer::effects::{Effect, PilotFigures, PilotLog};
use serde::{Deserialize, Serialize};

use super::super::output;
use super::super::outputs::keep;
use super::super::progress::bar_of;
use crate::say::say;

/// Pilots that there are in any case: two without effects, one with each.
const LEAST_PILOTS: usize = 2 + Effect::MEASURED.len();

/// A pilot that is done. Numbers are written so that they are read back to the last bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Done {
    effects: String,
    seed: u64,
    psnr_db: f64,
    instructions: f64,
    bytes: usize,
}

/// The file, and a bar over the iterations of all pilots.
pub(super) struct PilotsFile {
    path: PathBuf,
    done: Vec<Done>,
    bar: ProgressBar,
    iterations: u32,
    /// When the first pilot of this process began, and how many were done before.
    begun: Option<(Instant, usize)>,
}

impl PilotsFile {
    /// * `path`: need not be there yet.
    pub(super) fn open(path: PathBuf) -> Result<Self> {
        let done = match csv::Reader::from_path(&path) {
            Ok(mut reader) => reader.deserialize().collect::<Result<Vec<Done>, _>>(),
            Err(error) if matches!(error.kind(), csv::ErrorKind::Io(error) if error.kind() == ErrorKind::NotFound) => {
                Ok(Vec::new())
            }
            Err(error) => Err(error),
        };
        let done = done.with_context(|| {
            format!("{} is not a list of pilots; remove it, and they are measured again", path.display())
        })?;
        Ok(Self { path, done, bar: ProgressBar::hidden(), iterations: 0, begun: None })
    }

    /// How many pilots are done.
    pub(super) fn n_done(&self) -> usize {
        self.done.len()
    }

    /// Takes the bar away.
    pub(super) fn end(&self) {
        self.bar.finish_and_clear();
    }

    /// How many there will be, as far as is known.
    fn n_pilots(&self) -> usize {
        LEAST_PILOTS.max(self.done.len() + 1)
    }
}

impl PilotLog for PilotsFile {
    fn known(&self, effects: &[Effect], seed: u64) -> Option<PilotFigures> {
        let names = Effect::names(effects);
        let found = self.done.iter().find(|done| done.effects == names && done.seed == seed)?;
        Some(PilotFigures { psnr_db: found.psnr_db, instructions: found.instructions, bytes: found.bytes })
    }

    fn begins(&mut self, effects: &[Effect], iterations: u32) {
        let (n_done, n_pilots) = (self.done.len(), self.n_pilots());
        let before = u32::try_from(n_done).unwrap_or(u32::MAX).saturating_mul(iterations);
        if self.begun.is_none() {
            self.begun = Some((Instant::now(), n_done));
            self.iterations = iterations;
            self.bar = bar_of(before, before);
        }
        self.bar.set_length(n_pilots as u64 * u64::from(iterations));
        let names = Effect::names(effects);
        self.bar.set_message(format!("pilot {} of {n_pilots} or a few more: {names}", n_done + 1));
        if !io::stderr().is_terminal() {
            let left = self.begun.filter(|(_, first)| *first < n_done).map(|(started, first)| {
                let each_s = started.elapsed().as_secs_f64() / (n_done - first) as f64;
                format!(", {:.0} s left", each_s * (n_pilots - n_done) as f64)
            });
            say!("effects: pilot {} with {names}{}", n_done + 1, left.unwrap_or_default());
        }
    }

    fn step(&mut self, iteration: u32) {
        self.bar.set_position(self.done.len() as u64 * u64::from(self.iterations) + u64::from(iteration));
    }

    fn done(&mut self, effects: &[Effect], seed: u64, worth: &PilotFigures) -> io::Result<()> {
        let PilotFigures { psnr_db, instructions, bytes } = *worth;
        self.done.push(Done { effects: Effect::names(effects), seed, psnr_db, instructions, bytes });
        let table = output::csv(self.done.iter().cloned()).map_err(io::Error::other)?;
        keep(&self.path, &table).map_err(io::Error::other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_done_is_known_to_the_next_process_to_the_last_bit() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("pilots.csv");
        let worth = PilotFigures { psnr_db: 30.0 + 1.0 / 3.0, instructions: 1e8 / 7.0, bytes: 12_345 };
        let effects = [Effect::ViewColour, Effect::Anisotropy];
        let mut file = PilotsFile::open(path.clone()).expect("none yet");
        file.begins(&effects, 100);
        file.done(&effects, 0, &worth).expect("written");
        let again = PilotsFile::open(path.clone()).expect("a list");
        assert_eq!((again.known(&effects, 0), again.n_done()), (Some(worth), 1));
        assert_eq!((again.known(&effects, 1), again.known(&effects[..1], 0)), (None, None));
        std::fs::write(&path, "effects,seed\nnone,x\n").expect("written");
        let error = PilotsFile::open(path).err().expect("damaged").to_string();
        assert!(error.contains("pilots.csv is not a list of pilots; remove it"), "{error}");
    }
}
