//! Rate–distortion optimised pruning: what is not worth its bits goes.

use serde::{Deserialize, Serialize};

use super::{AnchorChange, Module, RunView};
use crate::train::error::TrainError;
use crate::train::limits::{REWEIGHED_AT, fit, reweighed};
use crate::train::schedule::{ConfigError, within};
use crate::train::worth::Worth;
use pocketsplat_kernels::real::Real;
use pocketsplat_kernels::scene::ModelShape;
use pocketsplat_kernels::step::{DeviceTerms, StepInfo, Terms};

/// Offsets and anchors leave whose removal adds less squared error than their bits are worth, at a few events after which
/// the rest learns to do without them. It takes the place of learned masks.
///
/// An offset goes when D < strength·μ·R, D the error of [`Worth::of_offsets`], R its bits and μ the price of a bit at the
/// run's λ; an anchor likewise with the bits of all its values. So the scene keeps what lowers D + strength·μ·R, the
/// Lagrangian of coding theory (Sullivan and Wiegand 1998, "Rate-distortion optimization for video compression", eq. 3),
/// as far as removals do not interact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Rdo {
    /// Multiple of the price of a bit that follows from λ.
    pub strength: f64,
    /// Shares of the run after which the first and the last event come; the first needs a context model.
    pub from: f64,
    /// See `from`.
    pub until: f64,
    /// Number of events, evenly spaced; with one it comes at `from`.
    pub events: u32,
    /// Anchors that the last event leaves where there are more, whatever λ says: the strength is then the one that does it.
    /// Events before it take equal shares.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub anchors: Option<usize>,
}

impl Default for Rdo {
    fn default() -> Self {
        Self { strength: 1.0, from: 0.5, until: 0.7, events: 2, anchors: None }
    }
}

impl Rdo {
    /// Shares of the run after which events come.
    pub fn shares(&self) -> impl Iterator<Item = f64> {
        let spacing = (self.until - self.from) / f64::from(self.events.max(2) - 1);
        let Self { from, .. } = *self;
        (0..self.events).map(move |event| from + spacing * f64::from(event))
    }

    /// The strength that leaves so many of the anchors, or the nearest fewer; 0 where there are no more.
    ///
    /// Cost: 60 times [`worthless`](Self::worthless).
    fn strength_for(&self, worth: &Worth, n_left: usize) -> f64 {
        let k = worth.of_offsets.len() / worth.of_anchors.len().max(1);
        let leaves = |strength: f64| {
            let mut drawn: Vec<usize> = (0..worth.of_anchors.len())
                .map(|anchor| worth.bits.of_offsets[anchor * k..][..k].iter().filter(|bits| **bits > 0.0).count())
                .collect();
            self.worthless(worth, strength).into_iter().for_each(|offset| {
                drawn[offset / k] -= usize::from(worth.bits.of_offsets[offset] > 0.0);
            });
            drawn.iter().filter(|drawn| **drawn > 0).count()
        };
        if leaves(0.0) <= n_left {
            return 0.0;
        }
        // Powers of two: what an anchor is worth spans many orders.
        let (mut too_weak, mut enough) = (-40.0_f64, 40.0_f64);
        for _ in 0..60 {
            let middle = f64::midpoint(too_weak, enough);
            if leaves(middle.exp2()) > n_left {
                too_weak = middle;
            } else {
                enough = middle;
            }
        }
        enough.exp2()
    }

    /// The offsets to switch off, counted through all anchors'; never all of them.
    fn worthless(&self, worth: &Worth, strength: f64) -> Vec<usize> {
        let k = worth.of_offsets.len() / worth.of_anchors.len().max(1);
        let price = strength * worth.bit_price;
        let goes = |offset: usize| {
            let anchor = offset / k;
            worth.of_offsets[offset] < price * f64::from(worth.bits.of_offsets[offset])
                || worth.of_anchors[anchor] < price * worth.anchor_bits(anchor)
        };
        // A scene without anchors has nothing left to learn with.
        let best = (0..worth.of_offsets.len()).max_by(|a, b| worth.of_offsets[*a].total_cmp(&worth.of_offsets[*b]));
        (0..worth.of_offsets.len()).filter(|offset| Some(*offset) != best && goes(*offset)).collect()
    }
}

impl Module for Rdo {
    fn check(&self) -> Result<(), ConfigError> {
        within("train.modules.rdo.strength", self.strength, 0.0, 1e6)?;
        within("train.modules.rdo.from", self.from, 0.0, 1.0)?;
        within("train.modules.rdo.until", self.until, self.from, 1.0)?;
        within("train.modules.rdo.anchors", self.anchors.unwrap_or(1) as f64, 1.0, 1e9)?;
        within("train.modules.rdo.events", f64::from(self.events), 1.0, 100.0)
    }

    fn is_due(&self, at: &StepInfo) -> bool {
        self.shares().chain(REWEIGHED_AT).any(|share| at.is_at(share))
    }

    fn event(&self, at: &StepInfo, run: &RunView<'_>) -> Result<Option<AnchorChange>, TrainError> {
        let shares: Vec<f64> = self.shares().collect();
        // Of events in one iteration the last takes the whole way.
        let Some(event) = shares.iter().rposition(|share| at.is_at(*share)) else {
            if !(run.limits_bytes() && REWEIGHED_AT.iter().any(|share| at.is_at(*share) && *share > self.until)) {
                return Ok(None);
            }
            let found = reweighed(run.scene().anchors.len(), run.lambda(), run.shares_without(&[])?);
            return Ok(Some(AnchorChange::Fit { masked: Vec::new(), found }));
        };
        let worth = run.worth()?;
        let n = worth.of_anchors.len();
        let part_of_the_way = |n_last: usize| {
            let n_left = n_last as f64 * (n as f64 / n_last as f64).powf(1.0 - 1.0 / (shares.len() - event) as f64);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of anchors")]
            self.strength_for(&worth, n_left.round() as usize)
        };
        if run.is_limited() {
            let left = |n_left: usize| self.worthless(&worth, self.strength_for(&worth, n_left));
            let strength_for = |n_left: usize| self.strength_for(&worth, n_left);
            let fits = fit(n, run.lambda(), event + 1 == shares.len(), strength_for, |n_left| {
                run.shares_without(&left(n_left))
            })?;
            let n_last = fits.n_anchors.min(self.anchors.unwrap_or(usize::MAX));
            // Where bytes are limited, what is not worth them at the new λ goes at once: the rest has longer to learn to do without it.
            let of_rate = if run.limits_bytes() { self.strength * fits.lambda / fits.former_lambda } else { 0.0 };
            let strength = part_of_the_way(n_last).max(of_rate.min(strength_for(fits.n_that_fill().max(n_last))));
            let masked = self.worthless(&worth, strength);
            return Ok(Some(AnchorChange::Fit { masked, found: fits }));
        }
        let strength = self.anchors.filter(|most| *most < n).map_or(self.strength, part_of_the_way);
        Ok(Some(AnchorChange::Mask(self.worthless(&worth, strength))))
    }

    fn weighs_bits_at(&self) -> Option<(&'static str, f64)> {
        Some(("train.modules.rdo.from", self.from))
    }

    fn learns_masks(&self) -> bool {
        false
    }
}

impl<R: Real> Terms<R> for Rdo {
    fn on_device(&self, _at: &StepInfo, _shape: &ModelShape, _terms: &mut DeviceTerms) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::modules::Modules;
    use crate::train::test_capture::{tiny_capture, tiny_hac_config};
    use crate::train::worth::bits::Bits;
    use crate::train::{TrainConfig, Trainer};

    #[test]
    fn what_is_not_worth_its_bits_goes() {
        // Two anchors of three offsets: the first offset of each pays for itself, the second anchor does not.
        let worth = Worth {
            of_offsets: vec![9.0, 0.1, 0.0, 5.0, 0.1, 0.0],
            of_anchors: vec![100.0, 5.2],
            bits: Bits {
                of_anchors: vec![[16.0, 2.0, 2.0], [16.0, 2.0, 2.0]],
                of_offsets: vec![1.0, 1.0, 0.0, 1.0, 1.0, 0.0],
            },
            bit_price: 0.2,
        };
        let gone = |strength: f64| Rdo::default().worthless(&worth, strength);
        assert_eq!(gone(0.0), [0; 0], "what costs nothing stays");
        assert_eq!(gone(0.6), [1, 4], "42 bits are worth 5.04");
        assert_eq!(gone(1.0), [1, 3, 4, 5], "they are worth 8.4");
        assert_eq!(gone(1e6), [1, 2, 3, 4, 5], "the best stays, so that there is a scene");
        let left = |n: usize| Rdo::default().strength_for(&worth, n);
        assert_eq!(left(2), 0.0, "there are no more");
        assert!((left(1) - 5.2 / 8.4).abs() < 1e-6, "the second anchor goes at {}", left(1));
    }

    #[test]
    fn events_are_spaced_evenly() {
        let shares = |events: u32| Rdo { events, ..Rdo::default() }.shares().collect::<Vec<_>>();
        assert_eq!(shares(1), [0.5]);
        assert_eq!(shares(2), [0.5, 0.7]);
        assert!(shares(3).into_iter().zip([0.5, 0.6, 0.7]).all(|(found, known)| (found - known).abs() < 1e-12));
    }

    #[test]
    fn a_run_prunes_at_its_events_alone_and_the_more_the_stronger() {
        let capture = tiny_capture();
        let mut left = Vec::new();
        for strength in [0.0, 0.001, 0.1] {
            let modules = Modules { rdo: Some(Rdo { strength, ..Rdo::default() }), ..Modules::default() };
            let mut config = TrainConfig { modules, ..tiny_hac_config(100) };
            config.densification.until = 0.4;
            let mut trainer = Trainer::new(&capture, config).unwrap();
            let drawn = |trainer: &Trainer<'_>| {
                let anchors = &trainer.state.learned.scene.anchors;
                (0..anchors.mask_logits.len()).filter(|offset| anchors.is_drawn(*offset)).count()
            };
            for _ in 0..100 {
                let before = drawn(&trainer);
                trainer.advance().unwrap();
                if trainer.state.iteration > 40 && ![50, 70].contains(&trainer.state.iteration) {
                    assert_eq!(
                        drawn(&trainer),
                        before,
                        "after iteration {}: masks are not learned",
                        trainer.state.iteration
                    );
                }
            }
            assert!(
                (0..trainer.state.learned.scene.anchors.len()).all(|anchor| trainer
                    .state
                    .learned
                    .scene
                    .anchors
                    .has_drawn(anchor))
            );
            left.push(drawn(&trainer));
        }
        assert!(left[0] > left[1] && left[1] > left[2] && left[2] > 0, "{left:?}");
    }

    #[test]
    fn of_events_in_one_iteration_the_last_counts() {
        let capture = tiny_capture();
        let rdo = Rdo { until: 0.5, anchors: Some(5), ..Rdo::default() };
        let config = TrainConfig { modules: Modules { rdo: Some(rdo), ..Modules::default() }, ..tiny_hac_config(60) };
        let mut trainer = Trainer::new(&capture, config).unwrap();
        while trainer.state.iteration < 30 {
            trainer.advance().unwrap();
        }
        assert!(trainer.state.learned.scene.anchors.len() <= 5, "{}", trainer.state.learned.scene.anchors.len());
    }

    #[test]
    fn an_event_comes_though_its_step_is_dropped() {
        let capture = tiny_capture();
        let modules = Modules { rdo: Some(Rdo { anchors: Some(5), ..Rdo::default() }), ..Modules::default() };
        let mut trainer = Trainer::new(&capture, TrainConfig { modules, ..tiny_hac_config(60) }).unwrap();
        while trainer.state.iteration < 41 {
            trainer.advance().unwrap();
        }
        assert!(trainer.state.learned.scene.anchors.len() > 5);
        trainer.setup.config.loss.volume = f64::NAN;
        assert!(trainer.advance().unwrap().dropped.is_some());
        assert!(trainer.state.learned.scene.anchors.len() <= 5, "{}", trainer.state.learned.scene.anchors.len());
    }

    #[test]
    fn a_run_without_a_rate_is_refused() {
        let modules = Modules { rdo: Some(Rdo::default()), ..Modules::default() };
        let refused = TrainConfig { modules, ..TrainConfig::default() }.validate();
        assert_eq!(refused, Err(ConfigError::NoRate { key: "train.modules.rdo.from" }));
        let mut free = TrainConfig { modules, ..tiny_hac_config(100) };
        free.hac.lambda = 0.0;
        assert_eq!(free.validate(), Err(ConfigError::NoPrice { key: "train.modules.rdo.from" }));
        let early = Modules { rdo: Some(Rdo { from: 0.2, ..Rdo::default() }), ..Modules::default() };
        let refused = TrainConfig { modules: early, ..tiny_hac_config(100) }.validate().unwrap_err().to_string();
        assert!(refused.contains("train.modules.rdo.from is 0.2"), "{refused}");
        let rdo = |iterations| TrainConfig { modules, ..tiny_hac_config(iterations) }.validate();
        let short = ConfigError::TooShort { found: 5, needed: 6, key: "train.modules.rdo.from" };
        assert_eq!((rdo(5), rdo(6)), (Err(short), Ok(())));
    }

    #[test]
    fn a_limit_that_is_not_reached_changes_nothing() {
        let capture = tiny_capture();
        let scenes = [None, Some(1_000_000)].map(|anchors| {
            let rdo = Rdo { strength: 0.01, anchors, ..Rdo::default() };
            let config =
                TrainConfig { modules: Modules { rdo: Some(rdo), ..Modules::default() }, ..tiny_hac_config(60) };
            let mut trainer = Trainer::new(&capture, config).unwrap();
            while trainer.state.iteration < 50 {
                trainer.advance().unwrap();
            }
            trainer.state.learned.scene.anchors
        });
        assert!(scenes[0] == scenes[1]);
    }
}
