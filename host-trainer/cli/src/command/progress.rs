//! What a run says while it works: a bar on a terminal, a line now and then elsewhere, always on stderr.

use std::fmt::Write;
use std::io::IsTerminal;
use std::time::Instant;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use pocketsplat_kernels::scene::Scene;
use pocketsplat_kernels::step::StepReport;
use pocketsplat_trainer::explicit::train::CloudOutcome;
use pocketsplat_trainer::train::exposures::ExposureDecision;
use pocketsplat_trainer::train::limits::{Fit, LimitShares};
use pocketsplat_trainer::train::{DroppedStep, Observer};

use super::estimate::Estimate;
use crate::say::say;

/// Weight of the newest step in the running means.
const NEWEST: f64 = 0.02;
/// Lines a run prints where there is no terminal.
const LINES: u32 = 20;
/// Dropped steps that are reported one by one.
const DROPPED_SPELT_OUT: u32 = 10;

/// Shows a training run.
pub(crate) struct Progress {
    bar: ProgressBar,
    on_terminal: bool,
    /// Iterations done before, and in all.
    from: u32,
    iterations: u32,
    started: Instant,
    loss: f64,
    psnr_db: f64,
    n_dropped: u32,
    n_unwritten: u32,
    estimate: Option<Estimate>,
}

impl Progress {
    /// * `from`: iterations that an earlier process did.
    pub(crate) fn new(from: u32, iterations: u32) -> Self {
        let (bar, on_terminal) = (bar_of(from, iterations), std::io::stderr().is_terminal());
        Self {
            bar,
            on_terminal,
            from,
            iterations,
            started: Instant::now(),
            loss: 0.0,
            psnr_db: 0.0,
            n_dropped: 0,
            n_unwritten: 0,
            estimate: None,
        }
    }

    /// The same, which also says now and then what the run will take.
    pub(crate) fn estimating(self, estimate: Estimate) -> Self {
        Self { estimate: Some(estimate), ..self }
    }

    /// A line that the bar does not overwrite.
    fn say(&self, line: &str) {
        self.bar.suspend(|| say!("{line}"));
    }
}

/// A rate to two digits at least.
pub(super) fn two_digits(per_second: f64) -> String {
    format!("{per_second:.*}", if per_second < 10.0 { 2 } else { 1 })
}

/// A bar on a terminal, nothing elsewhere.
///
/// * `from`: steps that an earlier process did.
pub(super) fn bar_of(from: u32, steps: u32) -> ProgressBar {
    let on_terminal = std::io::stderr().is_terminal();
    let target = if on_terminal { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    let bar = ProgressBar::with_draw_target(Some(u64::from(steps)), target);
    // What matters first: a narrow terminal cuts the end.
    let style = "{bar:12} {pos}/{len}  {eta} left  {rate} it/s  {wide_msg}";
    let style = ProgressStyle::with_template(style).unwrap_or_else(|_| ProgressStyle::default_bar());
    // A failure to format is one to draw the bar, which is no reason to end a run.
    let rate = |state: &ProgressState, out: &mut dyn Write| _ = write!(out, "{}", two_digits(state.per_sec()));
    bar.set_style(style.with_key("rate", rate));
    bar.set_position(u64::from(from));
    bar.reset_eta();
    bar
}

impl Progress {
    /// After an iteration on explicit Gaussians.
    pub(crate) fn explicit_step(&mut self, iteration: u32, outcome: &CloudOutcome, n_gaussians: usize) {
        if let Some(dropped) = &outcome.dropped {
            self.dropped(dropped);
        }
        self.show(iteration, outcome.loss, outcome.squared_error, &format!("{n_gaussians} Gaussians"));
    }

    /// * `size`: how much there is of the scene, in words.
    fn show(&mut self, iteration: u32, loss: f64, squared_error: f64, size: &str) {
        let psnr_db = -10.0 * squared_error.log10();
        let newest = NEWEST.max(1.0 / f64::from(iteration - self.from));
        // A step that was dropped may have no number to show.
        if loss.is_finite() && psnr_db.is_finite() {
            self.loss += newest * (loss - self.loss);
            self.psnr_db += newest * (psnr_db - self.psnr_db);
        }
        let state = format!("training PSNR {:.2} dB  {size}  loss {:.4}", self.psnr_db, self.loss);
        if self.on_terminal {
            self.bar.set_position(u64::from(iteration));
            self.bar.set_message(state);
            if iteration == self.iterations {
                self.bar.finish();
            }
        } else if iteration.is_multiple_of((self.iterations / LINES).max(1))
            || [self.from + 1, self.iterations].contains(&iteration)
        {
            let per_second = f64::from(iteration - self.from) / self.started.elapsed().as_secs_f64();
            let left = f64::from(self.iterations - iteration) / per_second;
            let rate = two_digits(per_second);
            say!("{iteration}/{}  {left:.0} s left  {rate} it/s  {state}", self.iterations);
        }
    }
}

impl Observer for Progress {
    fn step(&mut self, iteration: u32, report: &StepReport<f32>, scene: &Scene<f32>) {
        if let Some(mut estimate) = self.estimate.take() {
            estimate.step(iteration, scene.anchors.len(), |line| self.say(line));
            self.estimate = Some(estimate);
        }
        let bits = report.rate.map(|rate| format!("  {:.0} bits each", rate.bits.iter().sum::<f64>()));
        let size = format!("{} anchors{}", scene.anchors.len(), bits.unwrap_or_default());
        self.show(iteration, f64::from(report.loss), report.squared_error, &size);
    }

    fn fitted(&mut self, fit: &Fit) {
        let LimitShares { ram, instructions, bytes } = fit.shares;
        let shares = [("RAM", ram), ("instructions", instructions), ("bytes", bytes)];
        let shares = shares.iter().filter(|(_, share)| *share > 0.0);
        let shares: Vec<_> = shares.map(|(of, share)| format!("{:.0} % of the {of}", 100.0 * share)).collect();
        let lambda = if fit.lambda == fit.former_lambda {
            String::new()
        } else {
            format!(", before lambda goes from {:.2e} to {:.2e}", fit.former_lambda, fit.lambda)
        };
        self.say(&format!("to fit: {} anchors, which take {}{lambda}", fit.n_anchors, shares.join(", ")));
    }

    fn exposed(&mut self, decided: &ExposureDecision) {
        if decided.in_force {
            self.say(&format!(
                "exposure: the photographs differ by {:.2} stops (root mean square); the scene shows their mean from here on",
                decided.stops
            ));
        }
    }

    fn unwritten(&mut self, why: &dyn std::error::Error) {
        self.n_unwritten += 1;
        if self.n_unwritten == 1 {
            let cause = why.source().map_or_else(String::new, |cause| format!(": {cause}"));
            self.say(&format!("warning: the run goes on without its previews: {why}{cause}"));
        }
    }

    fn dropped(&mut self, step: &DroppedStep) {
        self.n_dropped += 1;
        if self.n_dropped <= DROPPED_SPELT_OUT {
            self.say(&format!("warning: {step}"));
        }
        if self.n_dropped == DROPPED_SPELT_OUT {
            self.say("warning: further dropped steps are only counted, see the result and progress.csv");
        }
    }
}
