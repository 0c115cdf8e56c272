//! What an effect costs, in dB, and whether it is worth that.

use serde::{Deserialize, Serialize};

use crate::device::Limits;

/// What the scene of a pilot is worth and takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PilotFigures {
    /// PSNR over views that were not trained on, dB.
    pub psnr_db: f64,
    /// Instructions of a frame on the target, predicted, mean over those views.
    pub instructions: f64,
    /// Bytes of the bundle.
    pub bytes: usize,
}

impl PilotFigures {
    pub(super) fn mean_with(&self, other: &Self) -> Self {
        Self {
            psnr_db: self.psnr_db.midpoint(other.psnr_db),
            instructions: self.instructions.midpoint(other.instructions),
            bytes: self.bytes.midpoint(other.bytes),
        }
    }
}

/// What effects have to gain.
///
/// 0.05 dB is what a reader of a table takes for a difference; on the curves that λ moves runs along, 0.1 dB is worth about 4 % of
/// the bytes (`docs/experiments/2026-11-21-training-for-few-bits.md`), so a tenth of them for 0.05 dB is a low price.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Price {
    /// For each effect, dB; all of them together at least what chance gains.
    pub effect_db: f64,
    /// For each 10 % more instructions of a frame, dB.
    pub instructions_db: f64,
    /// For each 10 % more bytes, dB.
    pub bytes_db: f64,
}

impl Default for Price {
    fn default() -> Self {
        Self::for_pc()
    }
}

impl Price {
    /// Where nobody counts instructions or bytes: what gains is kept.
    pub const fn for_pc() -> Self {
        Self { effect_db: 0.05, instructions_db: 0.0, bytes_db: 0.0 }
    }

    /// For a device.
    pub const fn for_device() -> Self {
        Self { effect_db: 0.05, instructions_db: 0.05, bytes_db: 0.05 }
    }

    /// Within limits: as for a device, but that instructions count for nothing where bytes alone are limited, as those of a download are.
    pub fn within(limits: &Limits) -> Self {
        let is_size_alone = Limits { flash_bytes: None, ..*limits }.is_none();
        let device = Self::for_device();
        if is_size_alone { Self { instructions_db: 0.0, ..device } } else { device }
    }

    /// What `with`, a scene with `n_effects`, has to gain over `without`, a scene without any, dB:
    /// `max(effect_db · n, chance_db) + instructions_db · 10·(I/I₀ − 1) + bytes_db · 10·(B/B₀ − 1)`.
    ///
    /// Less than nothing where it saves more than its effects cost. * `chance_db`: what scenes gain that differ in nothing but their
    /// seeds.
    pub fn of(&self, n_effects: usize, with: &PilotFigures, without: &PilotFigures, chance_db: f64) -> f64 {
        let tenths_more = |with: f64, without: f64| 10.0 * (with / without - 1.0);
        (self.effect_db * n_effects as f64).max(chance_db)
            + self.instructions_db * tenths_more(with.instructions, without.instructions)
            + self.bytes_db * tenths_more(with.bytes as f64, without.bytes as f64)
    }
}

/// The index of the trial whose gain is furthest above its price; 0, the one without effects, where none gains more than its price.
///
/// * `trials`: number of effects and worth of each; the first is without. * `chance_db`: as in [`Price::of`].
pub fn choose(price: &Price, trials: &[(usize, PilotFigures)], chance_db: f64) -> usize {
    let Some((_, without)) = trials.first() else { return 0 };
    let left = |(n, with): &(usize, PilotFigures)| {
        let gain_db = with.psnr_db - without.psnr_db;
        if gain_db > 0.0 { gain_db - price.of(*n, with, without, chance_db) } else { f64::NEG_INFINITY }
    };
    let best = trials.iter().enumerate().skip(1).fold((0, 0.0), |(best, most), (i, trial)| {
        let left = left(trial);
        if left > most { (i, left) } else { (best, most) }
    });
    best.0
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: (usize, PilotFigures) = (0, PilotFigures { psnr_db: 30.0, instructions: 50e6, bytes: 100_000 });

    fn trial(n: usize, gain_db: f64, instructions: f64, bytes: usize) -> (usize, PilotFigures) {
        (n, PilotFigures { psnr_db: 30.0 + gain_db, instructions, bytes })
    }

    #[test]
    fn a_price_is_what_effects_instructions_and_bytes_cost_together() {
        let price = Price { effect_db: 0.05, instructions_db: 0.04, bytes_db: 0.03 };
        let (n, with) = trial(2, 0.0, 60e6, 110_000);
        assert!((price.of(n, &with, &NONE.1, 0.0) - (0.10 + 0.08 + 0.03)).abs() < 1e-12);
        assert!((price.of(n, &with, &NONE.1, 0.3) - (0.30 + 0.08 + 0.03)).abs() < 1e-12, "chance");
    }

    #[test]
    fn bytes_alone_are_no_device() {
        let bytes = Limits { flash_bytes: Some(300_000), ..Limits::default() };
        assert_eq!(Price::within(&bytes), Price { instructions_db: 0.0, ..Price::for_device() });
        for limits in [Limits { ram_bytes: Some(1 << 18), ..bytes }, Limits { level: Some(5), ..Limits::default() }] {
            assert_eq!(Price::within(&limits), Price::for_device());
        }
    }

    #[test]
    fn what_gains_no_more_than_its_price_is_left_out() {
        let choose = |trials: &[(usize, PilotFigures)], chance_db| choose(&Price::for_device(), trials, chance_db);
        assert_eq!(choose(&[NONE], 0.0), 0);
        assert_eq!(choose(&[NONE, trial(1, 0.049, 50e6, 100_000)], 0.0), 0, "the effect itself");
        assert_eq!(choose(&[NONE, trial(1, 0.051, 50e6, 100_000)], 0.0), 1);
        assert_eq!(choose(&[NONE, trial(1, 0.051, 50e6, 100_000)], 0.1), 0, "no more than chance");
        assert_eq!(choose(&[NONE, trial(1, 0.29, 100e6, 100_000)], 0.0), 0, "twice the instructions");
        assert_eq!(choose(&[NONE, trial(1, 0.09, 50e6, 110_000)], 0.0), 0, "a tenth more bytes");
        assert_eq!(choose(&[NONE, trial(1, -0.1, 10e6, 10_000)], 0.0), 0, "a worse picture never pays");
    }

    #[test]
    fn on_a_pc_what_gains_is_kept_whatever_it_takes() {
        let choose = |trials: &[(usize, PilotFigures)], chance_db| choose(&Price::for_pc(), trials, chance_db);
        assert_eq!(choose(&[NONE, trial(1, 0.051, 500e6, 900_000)], 0.0), 1);
        assert_eq!(choose(&[NONE, trial(1, 0.051, 500e6, 900_000)], 0.1), 0, "no more than chance");
        assert_eq!(choose(&[NONE, trial(1, 0.4, 55e6, 90_000), trial(3, 0.6, 90e6, 90_000)], 0.0), 2);
    }

    #[test]
    fn of_those_that_pay_the_one_that_leaves_most_is_kept() {
        let choose = |trials: &[(usize, PilotFigures)]| choose(&Price::for_device(), trials, 0.0);
        let alone = [trial(1, 0.2, 55e6, 100_000), trial(1, 0.4, 55e6, 100_000)];
        assert_eq!(choose(&[NONE, alone[0], alone[1], trial(2, 0.44, 56e6, 100_000)]), 2);
        assert_eq!(choose(&[NONE, alone[0], alone[1], trial(2, 0.6, 56e6, 100_000)]), 3);
        assert_eq!(choose(&[NONE, alone[1], alone[1]]), 1, "of equal ones the first");
    }
}
