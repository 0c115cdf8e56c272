//! What a run will take: minutes, memory and bytes, from a few steps and from how runs go on.

mod course;

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use anyhow::Result;
use pocketsplat_capture::dataset::{Capture, PointsOrigin};
use pocketsplat_kernels::step::SharedDevice;
use pocketsplat_trainer::effects::PILOTS_TIME_SHARE;
use pocketsplat_trainer::train::worth::probed;
use pocketsplat_trainer::train::{TrainConfig, Trainer};

use course::{BEFORE_PRUNING, Course, FROM_RANDOM, SHARES, between};

use super::process::{machine_memory_bytes, peak_memory_bytes};
use crate::config::Preset;
use crate::say::say;

/// A run's first steps draw every offset and take twice as long as those that follow, so that only the last of the trial are timed. It ends after so
/// many steps, or after so many seconds once it has had the fewest that say something of the loss; and before the first event of the run.
const TRIAL_STEPS: u32 = 64;
const FEWEST_STEPS: usize = 24;
const TRIAL_SECONDS: f64 = 4.0;
const BEFORE_EVENTS: f64 = 0.05;
const TIMED_STEPS: usize = 8;
/// Iterations after which the estimate of a run without a trial is first shown; then at these shares of the run. The last comes after the first
/// pruning, at 0.5: the pruning itself takes time, and the number of anchors drops with it.
const FIRST: u32 = 30;
const AGAIN_AT: [f64; 3] = [0.1, 0.25, 0.55];

/// Above this many minutes, and this share of the machine's memory, a run is warned of.
const MANY_MINUTES: f64 = 120.0;
const MUCH_MEMORY: f64 = 0.8;

/// What a longer run is advised to take instead.
const USUAL_ITERATIONS: u32 = Preset::Standard.iterations();

/// What pruning, coding and measuring take more than a step, against the peak so far.
const EVENTS_MEMORY: f64 = 1.15;

/// What a view that a pruning by rate and distortion probes takes of a step.
const PROBE_COST: f64 = 0.65;

/// Bytes of a bundle besides its anchors: heads, context, container.
const FIXED_BYTES: f64 = 40e3;

/// The loss after the trial where there was none.
const USUAL_LOSS: f64 = 0.1;
/// The mean of the last [`TIMED_STEPS`] values; 0 without any.
fn mean_of_last(values: &[f64]) -> f64 {
    let last = &values[values.len().saturating_sub(TIMED_STEPS)..];
    last.iter().sum::<f64>() / last.len().max(1) as f64
}

// An estimate in between would take the anchors after pruning for those before it.
const _: () = assert!(AGAIN_AT[AGAIN_AT.len() - 1] > SHARES[BEFORE_PRUNING]);

/// Time of a step on images of half the size, against one on whole ones: anchors take as long.
const HALF_SIZE_COST: f64 = 0.55;

/// Follows a run, and says now and then what it will take.
pub(super) struct Estimate {
    what: String,
    /// The longer side of the largest photograph.
    longest_px: u32,
    course: Course,
    /// Iterations on images of half the size.
    n_half_size: u32,
    iterations: u32,
    bytes_per_anchor: f64,
    /// Memory of an anchor while it is trained: its values, their moments and gradients, and what a step notes of it; measured.
    memory_per_anchor: f64,
    /// A limit of growth.
    most_anchors: f64,
    /// Prunings by rate and distortion: shares of the run, and how many steps each takes.
    prunings: Vec<f64>,
    probed_steps: f64,
    /// When this process began, and a step some time ago, to tell the rate by.
    started: Instant,
    earlier: (u32, Instant),
    next: Vec<u32>,
    machine_bytes: Option<u64>,
    before: Before,
}

/// What a trial showed.
#[derive(Clone, Copy, Debug)]
struct Trial {
    n_anchors: usize,
    loss: f64,
}

impl Trial {
    /// Where there was none.
    fn usual(capture: &Capture) -> Self {
        Self { n_anchors: capture.points.len(), loss: USUAL_LOSS }
    }
}

/// What a run's estimate is told of the one before it: what a trial showed, and what was warned of, so that nothing is warned of twice.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Before {
    trial: Option<Trial>,
    warned_of_minutes: bool,
    warned_of_memory: bool,
}

/// What a run takes in all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Expected {
    /// Those of the pilots among them.
    pub(super) minutes: f64,
    /// What the pilots of its effects take, if they are still to come.
    pilot_minutes: f64,
    pub(super) memory_bytes: f64,
    bundle_bytes: f64,
}

impl Estimate {
    /// * `from`: iterations that are done.
    pub(super) fn new(capture: &Capture, config: &TrainConfig, from: u32, before: Before) -> Self {
        let [width, height] = capture.largest_px();
        let iterations = config.iterations;
        let said = AGAIN_AT.into_iter().map(|share| config.iteration_at(share));
        let values = config.shape.values_per_anchor() as f64;
        let n_pixels = f64::from(width) * f64::from(height);
        let Trial { n_anchors, loss } = before.trial.unwrap_or_else(|| Trial::usual(capture));
        let course = match capture.points_origin {
            PointsOrigin::Random => FROM_RANDOM,
            _ => Course::from_points(n_anchors as f64, loss, n_pixels, iterations),
        };
        let first = before.trial.is_none().then_some(from + FIRST);
        Self {
            what: format!("{width}×{height} px, {iterations} iterations"),
            longest_px: width.max(height),
            course: if config.modules.rdo.is_some() { course } else { course.unpruned() },
            n_half_size: config.iteration_at(config.resolved_for(capture).half_size.until),
            iterations,
            bytes_per_anchor: bytes_per_anchor(config),
            memory_per_anchor: 140.0 * values,
            prunings: config.modules.rdo.map_or_else(Vec::new, |rdo| rdo.shares().collect()),
            probed_steps: PROBE_COST * probed(0..capture.train.len()).count() as f64,
            most_anchors: config.densification.max_anchors.map_or(f64::INFINITY, |most| most as f64),
            started: Instant::now(),
            earlier: (from, Instant::now()),
            next: first.into_iter().chain(said).filter(|at| *at >= from + FIRST && *at < iterations).collect(),
            machine_bytes: machine_memory_bytes(),
            before,
        }
    }

    /// Tries a new run for some steps, which are not kept, and says what it will take; returns what the run's own estimate is told.
    ///
    /// * `with_pilots`: whether pilots will measure its effects first. * `stop`: looked at after every step; once it is set, nothing
    ///   is said.
    ///
    /// # Errors
    /// Those of the steps.
    pub(super) fn try_out(
        capture: &Capture,
        config: &TrainConfig,
        with_pilots: bool,
        device: Option<SharedDevice<f32>>,
        stop: &AtomicBool,
    ) -> Result<Before> {
        let (mut estimate, expected) = Self::measured(capture, config, device, stop)?;
        if !stop.load(Ordering::Relaxed) {
            let expected = if with_pilots { expected.with_pilots() } else { expected };
            say!("{}", estimate.said(&expected));
        }
        Ok(estimate.before)
    }

    /// What a new run will take, from some steps that are not kept.
    ///
    /// * `stop`: looked at after every step; once it is set, the figures mean nothing.
    ///
    /// # Errors
    /// Those of the steps.
    pub(super) fn measured(
        capture: &Capture,
        config: &TrainConfig,
        device: Option<SharedDevice<f32>>,
        stop: &AtomicBool,
    ) -> Result<(Self, Expected)> {
        let mut trainer = Trainer::new(capture, *config)?;
        trainer.set_device(device);
        let (started, mut steps, mut losses) = (Instant::now(), Vec::new(), Vec::new());
        for _ in 0..config.iteration_at(BEFORE_EVENTS).clamp(1, TRIAL_STEPS) {
            let is_enough = steps.len() >= FEWEST_STEPS && started.elapsed().as_secs_f64() > TRIAL_SECONDS;
            if is_enough || stop.load(Ordering::Relaxed) {
                break;
            }
            let began = Instant::now();
            let loss = f64::from(trainer.advance()?.report.loss);
            steps.push(began.elapsed().as_secs_f64());
            // One that was dropped may have none.
            losses.extend(Some(loss).filter(|loss| loss.is_finite()));
        }
        let n_anchors = trainer.scene().anchors.len();
        let loss = if losses.len() < FEWEST_STEPS { USUAL_LOSS } else { mean_of_last(&losses) };
        let trial = Trial { n_anchors, loss };
        let estimate = Self::new(capture, config, 0, Before { trial: Some(trial), ..Before::default() });
        let expected = estimate.expected(0, mean_of_last(&steps), 0.0, n_anchors);
        Ok((estimate, expected))
    }

    /// Hears of an iteration that is done, and says what the run will take when it is time to.
    pub(super) fn step(&mut self, iteration: u32, n_anchors: usize, say: impl FnOnce(&str)) {
        let is_due = self.next.first().is_some_and(|next| iteration >= *next);
        if !is_due {
            // The rate of the last hundred steps or so: growth changes it, and so does the size of images.
            if iteration.is_multiple_of(100) || iteration == self.n_half_size {
                self.earlier = (iteration, Instant::now());
            }
            return;
        }
        self.next.retain(|next| *next > iteration);
        let step_s = self.earlier.1.elapsed().as_secs_f64() / f64::from(iteration - self.earlier.0);
        let expected = self.expected(iteration, step_s, self.started.elapsed().as_secs_f64(), n_anchors);
        say(&self.said(&expected));
    }

    /// Time of a step at this share of the run, against the last of the trial, were it on whole images.
    fn cost_at(&self, share: f64) -> f64 {
        let is_half = share * f64::from(self.iterations) < f64::from(self.n_half_size);
        let size = if is_half { HALF_SIZE_COST } else { 1.0 };
        size * between(&self.course.cost, share)
    }

    fn expected(&self, iteration: u32, step_s: f64, spent_s: f64, n_anchors: usize) -> Expected {
        let done = f64::from(iteration) / f64::from(self.iterations);
        let parts = 100;
        let mean_cost = (0..parts)
            .map(|i| self.cost_at(done + (1.0 - done) * (f64::from(i) + 0.5) / f64::from(parts)))
            .sum::<f64>()
            / f64::from(parts);
        let steps_left = f64::from(self.iterations - iteration);
        let prunings = self.prunings.iter().filter(|share| **share > done);
        // They come with the anchors of before and on whole images.
        let pruning = prunings.map(|share| self.probed_steps * between(&self.course.cost, share - 1e-3)).sum::<f64>();
        let left_s = (steps_left * mean_cost + pruning) * step_s / self.cost_at(done);
        let against_now = n_anchors as f64 / between(&self.course.anchors, done);
        let later = |share: &f64| *share >= done;
        let most =
            SHARES.iter().zip(self.course.anchors).filter(|(share, _)| later(share)).map(|(_, n)| n * against_now);
        let most = most.fold(n_anchors as f64, f64::max).min(self.most_anchors.max(n_anchors as f64));
        let end = (self.course.anchors[SHARES.len() - 1] * against_now).min(self.most_anchors);
        Expected {
            minutes: (spent_s + left_s) / 60.0,
            pilot_minutes: 0.0,
            memory_bytes: peak_memory_bytes().unwrap_or(0) as f64 * EVENTS_MEMORY
                + (most - n_anchors as f64) * self.memory_per_anchor,
            bundle_bytes: FIXED_BYTES + end * self.bytes_per_anchor,
        }
    }

    /// The line, and a warning for each limit that the estimate passes and none before it did.
    fn said(&mut self, expected: &Expected) -> String {
        let mut said = format!("{}: {expected}", self.what);
        if expected.minutes > MANY_MINUTES && !std::mem::replace(&mut self.before.warned_of_minutes, true) {
            let fewer = if self.iterations > USUAL_ITERATIONS {
                format!(" or --iterations {USUAL_ITERATIONS}")
            } else {
                String::new()
            };
            said += &format!("\nwarning: that is long; {}{fewer} makes it shorter", self.half_the_size());
        }
        if let Some(machine) = self.machine_bytes
            && expected.memory_bytes > MUCH_MEMORY * machine as f64
            && !std::mem::replace(&mut self.before.warned_of_memory, true)
        {
            said += &format!(
                "\nwarning: the machine has {:.1} GB of memory; {} or --max-anchors N takes less",
                machine as f64 / 1e9,
                self.half_the_size()
            );
        }
        said
    }

    fn half_the_size(&self) -> String {
        format!("--max-resolution {}", self.longest_px.div_ceil(2))
    }
}

impl Expected {
    /// The same with pilots before the run.
    fn with_pilots(self) -> Self {
        let pilot_minutes = PILOTS_TIME_SHARE * self.minutes;
        Self { minutes: self.minutes + pilot_minutes, pilot_minutes, ..self }
    }
}

/// As people say it.
pub(super) fn duration(minutes: f64) -> String {
    match minutes {
        ..1.0 => format!("{:.0} seconds", 60.0 * minutes),
        1.0..10.0 => format!("{minutes:.1} minutes"),
        10.0..180.0 => format!("{minutes:.0} minutes"),
        _ => format!("{:.0} hours", minutes / 60.0),
    }
}

impl fmt::Display for Expected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { minutes, pilot_minutes, memory_bytes, bundle_bytes } = *self;
        write!(f, "about {}", duration(minutes))?;
        if pilot_minutes > 0.0 {
            write!(f, " ({} of them to measure effects)", duration(pilot_minutes))?;
        }
        write!(f, ", {:.1} GB of memory, a bundle of about {:.2} MB", memory_bytes / 1e9, bundle_bytes / 1e6)
    }
}

/// Bytes of a bundle of so many anchors.
///
/// * `bits`: of an anchor's values, where the run has a rate.
pub(super) fn bundle_bytes(config: &TrainConfig, n_anchors: u64, bits: Option<f64>) -> f64 {
    FIXED_BYTES + n_anchors as f64 * bits.map_or_else(|| bytes_per_anchor(config), |bits| bits / 8.0)
}

/// Bytes of an anchor in a bundle: of context-coded scenes a power of λ, fitted; of scaffold scenes with static tables.
fn bytes_per_anchor(config: &TrainConfig) -> f64 {
    if config.backbone.is_coded() { 24.0 * (config.hac.lambda.max(1e-5) / 0.002).powf(-0.35) } else { 40.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps cost four times as much from the middle on, and there are three times as many anchors.
    const GROWING: Course =
        Course { cost: [1.0, 1.0, 1.0, 1.0, 4.0, 4.0, 4.0, 4.0], anchors: [1.0, 1.0, 2.0, 3.0, 3.0, 2.0, 2.0, 2.0] };

    fn estimate(most_anchors: f64) -> Estimate {
        Estimate {
            what: "8×8 px, 1000 iterations".to_owned(),
            longest_px: 8,
            course: GROWING,
            n_half_size: 0,
            iterations: 1000,
            bytes_per_anchor: 20.0,
            // So much that what the test's process holds meanwhile is nothing beside.
            memory_per_anchor: 1e7,
            most_anchors,
            prunings: Vec::new(),
            probed_steps: 100.0,
            started: Instant::now(),
            earlier: (0, Instant::now()),
            next: vec![30, 100],
            machine_bytes: Some(1_000_000_000_000),
            before: Before::default(),
        }
    }

    #[test]
    fn what_is_left_costs_what_the_course_says() {
        let close = |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 0.01, "{found}, {expected}");
        let all = estimate(f64::INFINITY);
        let start = all.expected(0, 0.06, 0.0, 5000);
        // 0.35 at 1, a line to 4 over 0.15, and 0.5 at 4.
        close(start.minutes, 1.0 * (0.35 + 0.15 * 2.5 + 0.5 * 4.0));
        // The same where steps on smaller images, which take less, come first.
        let smaller = Estimate { n_half_size: 200, ..estimate(f64::INFINITY) };
        let start_of_smaller = smaller.expected(0, HALF_SIZE_COST * 0.06, 0.0, 5000);
        close(start_of_smaller.minutes, HALF_SIZE_COST * 0.2 + 0.15 + 0.15 * 2.5 + 0.5 * 4.0);
        close(smaller.expected(500, 0.24, 600.0, 15_000).minutes, 10.0 + 2.0);
        let middle = all.expected(500, 0.24, 600.0, 15_000);
        close(middle.minutes, 10.0 + 2.0);
        close(middle.bundle_bytes, FIXED_BYTES + 10_000.0 * 20.0);
        // Memory still to come is that of 10,000 anchors, at the end none.
        let to_come = |expected: &Expected| expected.memory_bytes - all.expected(1000, 0.1, 0.0, 100).memory_bytes;
        close(to_come(&start), 1e11);
        // Two prunings that take 100 steps each, one of them still to come: a tenth of 1,000 steps at 4.
        let pruned = Estimate { prunings: vec![0.5, 0.7], ..estimate(f64::INFINITY) };
        close(pruned.expected(500, 0.24, 600.0, 15_000).minutes, 10.0 + 2.0 + 0.4);
        close(estimate(6000.0).expected(0, 0.06, 0.0, 5000).bundle_bytes, FIXED_BYTES + 6000.0 * 20.0);
    }

    #[test]
    fn it_speaks_when_it_has_learnt_something() {
        let (mut estimate, mut said) = (estimate(f64::INFINITY), Vec::new());
        for iteration in 1..=1000 {
            estimate.step(iteration, 5000, |line| said.push((iteration, line.to_owned())));
        }
        assert_eq!(said.iter().map(|(at, _)| *at).collect::<Vec<_>>(), [30, 100]);
        assert!(said[0].1.starts_with("8×8 px, 1000 iterations: about 0 seconds, "), "{}", said[0].1);
    }

    #[test]
    fn each_limit_is_warned_of_once_whenever_an_estimate_first_passes_it() {
        let mut estimate = estimate(f64::INFINITY);
        let small = Expected { minutes: 119.0, pilot_minutes: 0.0, memory_bytes: 0.7e12, bundle_bytes: 1e6 };
        let said = estimate.said(&small);
        assert!(said.contains("about 119 minutes, 700.0 GB of memory") && !said.contains("warning"), "{said}");
        let long = Expected { minutes: 121.0, ..small };
        let said = estimate.said(&long);
        assert!(said.ends_with("\nwarning: that is long; --max-resolution 4 makes it shorter"), "{said}");
        assert!(!said.contains("the machine has"), "{said}");
        let large = Expected { memory_bytes: 0.9e12, ..long };
        let said = estimate.said(&large);
        assert!(!said.contains("that is long") && said.contains("\nwarning: the machine has 1000.0 GB"), "{said}");
        assert!(!estimate.said(&large).contains("warning"));
    }

    #[test]
    fn fewer_iterations_are_advised_only_where_there_are_more() {
        let mut estimate = Estimate { iterations: 30_000, ..estimate(f64::INFINITY) };
        let long = Expected { minutes: 121.0, pilot_minutes: 0.0, memory_bytes: 1e9, bundle_bytes: 1e6 };
        let said = estimate.said(&long);
        assert!(said.ends_with("--max-resolution 4 or --iterations 7000 makes it shorter"), "{said}");
    }

    #[test]
    fn pilots_count_and_are_named() {
        let run = Expected { minutes: 100.0, pilot_minutes: 0.0, memory_bytes: 1e9, bundle_bytes: 1e6 };
        let said = estimate(f64::INFINITY).said(&run.with_pilots());
        assert!(said.contains("about 125 minutes (25 minutes of them to measure effects), 1.0 GB"), "{said}");
        assert!(said.contains("warning: that is long"), "the limit holds for both together: {said}");
    }
}
