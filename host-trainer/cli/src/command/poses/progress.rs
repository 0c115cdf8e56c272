//! What is said while a stage works: a bar on a terminal, a line now and then elsewhere, always on stderr.

use std::io::IsTerminal as _;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::super::estimate::duration;
use crate::say::say;

/// Lines that a stage says where there is no terminal, at most.
const LINES: usize = 10;
/// From one line to the next, at least: a stage of seconds says nothing.
const BETWEEN: Duration = Duration::from_secs(3);

/// Shows how far a stage is.
pub(super) struct Progress {
    bar: ProgressBar,
    on_terminal: bool,
    what: &'static str,
    n: usize,
    reached: usize,
    /// The part of which was said last, and when.
    said: (usize, Instant),
    /// When the first step was done, and which: what was done by an earlier process took no time.
    first: Option<(Instant, usize)>,
}

impl Progress {
    /// * `what`: the stage, as `features`. * `n`: how many steps it has.
    pub(super) fn new(what: &'static str, n: usize) -> Self {
        let on_terminal = std::io::stderr().is_terminal();
        let target = if on_terminal { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(n as u64), target);
        let style = ProgressStyle::with_template("{bar:12} {pos}/{len}  {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self { bar, on_terminal, what, n, reached: 0, said: (0, Instant::now()), first: None }
    }

    /// After so many steps; fewer than before are not shown.
    pub(super) fn reached(&mut self, i: usize) {
        if i <= self.reached || i > self.n {
            return;
        }
        self.reached = i;
        let left = match self.first {
            None => {
                self.first = Some((Instant::now(), i));
                None
            }
            Some((since, first)) => Some(minutes_left(since.elapsed().as_secs_f64(), i - first, self.n - i)),
        };
        let left = left.map_or(String::new(), |minutes| format!("  {} left", duration(minutes)));
        if self.on_terminal {
            self.bar.set_position(i as u64);
            self.bar.set_message(format!("{}{left}", self.what));
        } else if i < self.n && i * LINES / self.n > self.said.0 && self.said.1.elapsed() >= BETWEEN {
            self.said = (i * LINES / self.n, Instant::now());
            say!("{} {i}/{}{left}", self.what, self.n);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// What is left at the rate so far.
fn minutes_left(elapsed_s: f64, n_done: usize, n_left: usize) -> f64 {
    elapsed_s / n_done as f64 * n_left as f64 / 60.0
}

#[cfg(test)]
mod tests {
    #[test]
    fn what_is_left_takes_as_long_as_what_was_done() {
        assert!((super::minutes_left(30.0, 10, 20) - 1.0).abs() < 1e-12);
    }
}
