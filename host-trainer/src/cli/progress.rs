//! What a run says while it works: a bar on a terminal, a line now and then elsewhere, always on stderr.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use pocketsplat::scene::Scene;
use pocketsplat::train::Observer;
use pocketsplat::train::step::StepReport;

/// Weight of the newest step in the running means.
const NEWEST: f64 = 0.02;
/// Lines a run prints where there is no terminal.
const LINES: u32 = 20;

/// Shows a training run.
pub(crate) struct Progress {
    bar: ProgressBar,
    on_terminal: bool,
    iterations: u32,
    started: Instant,
    loss: f64,
    psnr_db: f64,
}

impl Progress {
    pub(crate) fn new(iterations: u32) -> Self {
        let on_terminal = std::io::stderr().is_terminal();
        let target = if on_terminal { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(u64::from(iterations)), target);
        let style = "{bar:30} {pos}/{len}  {msg}  {per_sec:>10}  {eta} left";
        bar.set_style(ProgressStyle::with_template(style).unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self { bar, on_terminal, iterations, started: Instant::now(), loss: 0.0, psnr_db: 0.0 }
    }

    /// Time since the run began.
    pub(crate) fn elapsed(&self) -> Duration {
        self.started.elapsed()
    }
}

impl Observer for Progress {
    fn step(&mut self, iteration: u32, report: &StepReport<f32>, scene: &Scene<f32>) {
        let (loss, psnr_db) = (f64::from(report.loss), -10.0 * report.squared_error.log10());
        let newest = NEWEST.max(1.0 / f64::from(iteration));
        self.loss += newest * (loss - self.loss);
        self.psnr_db += newest * (psnr_db - self.psnr_db);
        let state = format!("loss {:.4}  PSNR {:.2} dB  {} anchors", self.loss, self.psnr_db, scene.anchors.len());
        if self.on_terminal {
            self.bar.set_position(u64::from(iteration));
            self.bar.set_message(state);
            if iteration == self.iterations {
                self.bar.finish();
            }
        } else if iteration.is_multiple_of((self.iterations / LINES).max(1)) || iteration == self.iterations {
            let per_second = f64::from(iteration) / self.elapsed().as_secs_f64();
            let left = f64::from(self.iterations - iteration) / per_second;
            eprintln!("{iteration}/{}  {state}  {per_second:.1} it/s  {left:.0} s left", self.iterations);
        }
    }
}
