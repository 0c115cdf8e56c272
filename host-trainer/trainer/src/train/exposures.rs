//! How each training photograph was exposed, against the mean photograph that the scene shows.
//!
//! Nothing of it is written: a decoder draws the mean photograph.

use std::array::from_fn;

use pocketsplat_kernels::step::{Exposure, ExposureSums};
use serde::{Deserialize, Serialize};

use super::schedule::ExposureChoice;

/// Weight of the newest image of a view beside what those before it said.
const NEWEST: f64 = 0.3;
/// Share of the run from which exposures count where they are asked for; earlier the scene shows too little to tell by.
const FROM: f64 = 0.05;
/// Share of the run, and steps a view, after which it is decided whether they are called for.
const DECIDED_AT: f64 = 0.3;
const DECIDED_AFTER_VISITS: u32 = 8;
/// Share of the run after which a run that was too short for that does not begin any more.
const DECIDED_UNTIL: f64 = 0.5;
/// Root mean square from which they are called for, stops. Captures whose photographs look alike show up to 0.12 by then, those at ± 0.5
/// stops 0.34 (docs/experiments/2026-11-28-exposure.md).
const LEAST_STOPS: f64 = 0.2;
/// Stops a unit of a gain's logarithm: light is about the value to the power 2.4.
const STOPS: f64 = 2.4 / std::f64::consts::LN_2;

/// The exposures of a run's training views.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Exposures {
    /// Logarithms of the gains, as the views' images say; `None` before the first.
    log_gains: Vec<Option<[f64; 3]>>,
    /// Whether images are compared under them; `None` while that is open.
    in_force: Option<bool>,
}

/// A run, as far as exposures go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExposureRun {
    /// What it was asked for.
    pub choice: ExposureChoice,
    /// Its length.
    pub iterations: u32,
    /// Views that it trains on.
    pub n_trained: usize,
}

impl ExposureRun {
    fn iteration_at(&self, share: f64) -> u32 {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "shares are in 0..=1")]
        let at = (share * f64::from(self.iterations)).round() as u32;
        at
    }
}

/// What was decided about the photographs of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExposureDecision {
    /// Root mean square by which they differ, stops.
    pub stops: f64,
    /// Whether each has an exposure of its own from now on.
    pub in_force: bool,
}

impl Exposures {
    /// Of views that were not seen yet.
    pub fn of_views(n: usize) -> Self {
        Self { log_gains: vec![None; n], in_force: None }
    }

    /// Leaves the decision open again, and keeps what was found.
    pub fn reopen(&mut self) {
        self.in_force = None;
    }

    /// Views there are.
    pub fn len(&self) -> usize {
        self.log_gains.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.log_gains.is_empty()
    }

    /// Whether images are compared under them.
    fn are_in_force(&self) -> bool {
        self.in_force == Some(true)
    }

    /// What a step of view `place` compares under; the image as it is while it is only asked what its exposure would be, `None` where nobody
    /// asks.
    pub fn of_step(&self, place: usize, choice: ExposureChoice) -> Option<Exposure<f32>> {
        match self.in_force {
            Some(true) => Some(self.of(place)),
            Some(false) => None,
            None => (choice != ExposureChoice::Off).then_some(Exposure { gain: [1.0; 3] }),
        }
    }

    /// The exposure of view `place`, where they are in force.
    pub fn of_view(&self, place: usize) -> Option<Exposure<f32>> {
        self.are_in_force().then(|| self.of(place))
    }

    /// The exposures of all views, stops of red, green and blue; `None` where they are not in force.
    pub fn stops(&self) -> Option<Vec<[f64; 3]>> {
        let mean = self.mean();
        let stops =
            |gains: &Option<[f64; 3]>| gains.map_or([0.0; 3], |gains| from_fn(|c| STOPS * (gains[c] - mean[c])));
        self.are_in_force().then(|| self.log_gains.iter().map(stops).collect())
    }

    /// Takes in what the step of `iteration` found, and decides where it is time to.
    pub fn saw(
        &mut self,
        place: usize,
        found: &ExposureSums,
        iteration: u32,
        run: &ExposureRun,
    ) -> Option<ExposureDecision> {
        if let Some(found) = found.log_gains() {
            let kept = self.log_gains[place].unwrap_or(found);
            self.log_gains[place] = Some(from_fn(|c| kept[c] + NEWEST * (found[c] - kept[c])));
        }
        let at = match run.choice {
            _ if self.in_force.is_some() => return None,
            ExposureChoice::Off => return None,
            ExposureChoice::On => run.iteration_at(FROM),
            ExposureChoice::Auto => {
                let visits = DECIDED_AFTER_VISITS.saturating_mul(u32::try_from(run.n_trained).unwrap_or(u32::MAX));
                run.iteration_at(DECIDED_AT).max(visits)
            }
        };
        let stops = self.spread_stops();
        let is_time = iteration >= at;
        let is_too_late = iteration > run.iteration_at(DECIDED_UNTIL);
        let in_force = match run.choice {
            ExposureChoice::On if is_time => true,
            ExposureChoice::Auto if is_too_late => false,
            ExposureChoice::Auto if is_time => stops >= LEAST_STOPS,
            _ => return None,
        };
        self.in_force = Some(in_force);
        Some(ExposureDecision { stops, in_force })
    }

    fn of(&self, place: usize) -> Exposure<f32> {
        let mean = self.mean();
        let gain = |c: usize| self.log_gains[place].map_or(1.0, |gains| (gains[c] - mean[c]).exp() as f32);
        Exposure { gain: from_fn(gain) }
    }

    fn seen(&self) -> impl Iterator<Item = &[f64; 3]> {
        self.log_gains.iter().flatten()
    }

    /// Of the views that were seen: what the scene, which shows the mean photograph, has of all of them.
    fn mean(&self) -> [f64; 3] {
        let n = self.seen().count().max(1) as f64;
        from_fn(|c| self.seen().map(|gains| gains[c]).sum::<f64>() / n)
    }

    fn spread_stops(&self) -> f64 {
        let (mean, n) = (self.mean(), 3.0 * self.seen().count().max(1) as f64);
        let squares = self.seen().flat_map(|gains| (0..3).map(move |c| (gains[c] - mean[c]).powi(2)));
        STOPS * (squares.sum::<f64>() / n).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::test_capture::{edit, many_views, tiny_config};
    use crate::train::{TrainConfig, Trainer};
    use pocketsplat_capture::dataset::Capture;

    /// What an image says whose photograph is `stops` brighter.
    fn sums(stops: f64) -> ExposureSums {
        ExposureSums { products: [(stops / STOPS).exp(); 3], squares: [1.0; 3] }
    }

    fn config(exposure: ExposureChoice, iterations: u32) -> TrainConfig {
        TrainConfig { exposure, ..tiny_config(iterations) }
    }

    /// Shows view after view, of which every second one is `stops` brighter; returns the iteration of the decision.
    fn decided(stops: f64, choice: ExposureChoice, iterations: u32) -> (Option<(u32, ExposureDecision)>, Exposures) {
        let n = 10;
        let run = ExposureRun { choice, iterations, n_trained: n };
        let mut exposures = Exposures::of_views(n);
        let decided = (1..=iterations).find_map(|iteration| {
            let place = iteration as usize % n;
            exposures.of_step(place, choice)?;
            let found = sums(if place % 2 == 1 { stops } else { 0.0 });
            Some((iteration, exposures.saw(place, &found, iteration, &run)?))
        });
        (decided, exposures)
    }

    #[test]
    fn photographs_that_differ_are_told_once_every_view_was_seen_several_times() {
        let auto = |stops, iterations| decided(stops, ExposureChoice::Auto, iterations);
        let (found, exposures) = auto(0.6, 1000);
        let (at, decision) = found.expect("decided");
        assert_eq!((at, decision.in_force), (300, true));
        assert!((decision.stops - 0.3).abs() < 1e-9, "half of the difference: {decision:?}");
        let stops = exposures.stops().expect("in force");
        assert!((stops[1][0] - 0.3).abs() < 1e-9 && (stops[2][2] + 0.3).abs() < 1e-9, "{stops:?}");
        let gain = exposures.of_view(1).expect("in force").gain[0];
        assert!((f64::from(gain).ln() * STOPS - 0.3).abs() < 1e-6);
        assert_eq!(auto(0.6, 180).0.map(|(at, decision)| (at, decision.in_force)), Some((80, true)), "eight times");
        // Between steps nothing asks any more.
        let (found, exposures) = auto(0.3, 1000);
        assert_eq!(found.map(|(at, decision)| (at, decision.in_force)), Some((300, false)));
        assert_eq!((exposures.stops(), exposures.of_view(1)), (None, None));
        assert_eq!(exposures.of_step(1, ExposureChoice::Auto), None);
        // Too short to tell.
        assert_eq!(auto(3.0, 100).0.map(|(at, decision)| (at, decision.in_force)), Some((51, false)));
    }

    #[test]
    fn what_is_asked_for_is_done() {
        let (on, _) = decided(0.0, ExposureChoice::On, 1000);
        assert_eq!(on.map(|(at, decision)| (at, decision.in_force)), Some((50, true)));
        let (off, exposures) = decided(3.0, ExposureChoice::Off, 1000);
        assert!(off.is_none() && exposures == Exposures::of_views(10));
    }

    /// Views of an even grey, with the gains of their photographs.
    fn grey(n: u32) -> (Capture, Vec<f64>) {
        let mut capture = many_views(n);
        let gains: Vec<f64> = (0..n).map(|i| [0.85, 1.0, 1.18][i as usize % 3]).collect();
        for (view, gain) in capture.train.iter_mut().zip(&gains) {
            edit(view, |photograph| {
                let value = 255.0 * (gain * (0.45 + 0.055) - 0.055);
                photograph.image.rgb.fill(value.round() as u8);
            });
        }
        (capture, gains)
    }

    #[test]
    fn a_run_finds_how_its_photographs_were_exposed_and_its_scene_is_their_mean() {
        let (capture, gains) = grey(6);
        let mut trainer = Trainer::new(&capture, config(ExposureChoice::On, 240)).unwrap();
        let mut n_decided = 0;
        while !trainer.is_done() {
            n_decided += usize::from(trainer.advance().unwrap().decided.is_some());
        }
        assert_eq!(n_decided, 1);
        let stops = trainer.exposure_stops().expect("in force");
        let mean = gains.iter().map(|gain| gain.ln()).sum::<f64>() / 6.0;
        for (stops, gain) in stops.iter().zip(&gains) {
            let expected = STOPS * (gain.ln() - mean);
            assert!((stops[1] - expected).abs() < 0.12, "{} found, {expected} made", stops[1]);
        }
        assert!(stops.iter().map(|stops| stops[0]).sum::<f64>().abs() < 1e-9, "the mean photograph");
        let steady = Trainer::new(&capture, config(ExposureChoice::Off, 3)).unwrap();
        assert_eq!(steady.exposure_stops(), None);
    }

    #[test]
    fn a_run_that_only_asks_is_the_run_that_does_not_ask() {
        let (capture, _) = grey(6);
        let after = |exposure| {
            let mut trainer = Trainer::new(&capture, config(exposure, 100)).unwrap();
            for _ in 0..30 {
                trainer.advance().unwrap();
            }
            trainer.scene().clone()
        };
        assert!(after(ExposureChoice::Auto) == after(ExposureChoice::Off), "to the bit");
    }
}
