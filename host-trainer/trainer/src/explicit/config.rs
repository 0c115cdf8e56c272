//! What a run is made of: numbers a user may set, with the method's defaults.

use serde::{Deserialize, Serialize};

use crate::train::schedule::{ConfigError, LearningRate, within};

/// A whole run on explicit Gaussians (Kerbl et al. 2023, sections 5 and 7.1).
///
/// Schedules count iterations, as published: a shorter run is the beginning of the published 30,000, a longer one goes on as these end.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CloudConfig {
    /// Optimiser steps: where the run stops, and nothing else.
    pub iterations: u32,
    /// Everything random follows from it.
    pub seed: u64,
    /// Share λ of 1 − SSIM in the loss; L1 has 1 − λ.
    pub dssim: f64,
    /// Iterations after which the degree of colours rises by one, up to 3.
    pub degree_every: u32,
    /// The iteration up to which learning rates change: their shares are of it, and their last values hold from there on.
    pub rates_until: u32,
    /// Learning rates.
    pub rates: CloudRates,
    /// Growth and pruning.
    pub density: DensityControl,
}

/// Learning rates of explicit Gaussians.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CloudRates {
    /// Centres; multiplied by the capture's extent.
    pub centre: LearningRate,
    /// Logarithms of the deviations.
    pub log_scale: LearningRate,
    /// Quaternions.
    pub rotation: LearningRate,
    /// Opacity logits.
    pub opacity: LearningRate,
    /// Coefficients of degree 0.
    pub colour: LearningRate,
    /// All other coefficients learn this many times slower.
    pub bands_divisor: f64,
}

/// When and how Gaussians come and go (Kerbl et al. 2023, section 5.2).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DensityControl {
    /// The iteration after which it happens.
    pub from: u32,
    /// The iteration at which it ends.
    pub until: u32,
    /// Iterations from one event to the next.
    pub interval: u32,
    /// Mean length of dL/d(mean), units of half the image, above which a Gaussian is cloned or split.
    pub gradient_threshold: f64,
    /// Gaussians of at most this share of the extent are cloned, larger ones are split.
    pub cloned_share: f64,
    /// What deviations are divided by in a split.
    pub split_divisor: f64,
    /// Gaussians less opaque are removed.
    pub min_opacity: f64,
    /// Iterations from one lowering of all opacities to the next.
    pub reset_every: u32,
    /// What opacities are lowered to; and twice the least that is kept.
    pub reset_opacity: f64,
    /// Deviations above this share of the extent are too large, once opacities were lowered.
    pub largest_share: f64,
}

impl Default for CloudConfig {
    fn default() -> Self {
        let constant = |rate| LearningRate { start: rate, end: rate, from: 0.0 };
        Self {
            iterations: 30_000,
            seed: 42,
            dssim: 0.2,
            degree_every: 1_000,
            rates_until: 30_000,
            rates: CloudRates {
                centre: LearningRate::falling(1.6e-4, 1.6e-6),
                log_scale: constant(5e-3),
                rotation: constant(1e-3),
                opacity: constant(0.05),
                colour: constant(2.5e-3),
                bands_divisor: 20.0,
            },
            density: DensityControl {
                from: 500,
                until: 15_000,
                interval: 100,
                gradient_threshold: 2e-4,
                cloned_share: 0.01,
                split_divisor: 1.6,
                min_opacity: 0.005,
                reset_every: 3_000,
                reset_opacity: 0.01,
                largest_share: 0.1,
            },
        }
    }
}

impl CloudConfig {
    /// Refuses what no run can use, before any work starts.
    ///
    /// # Errors
    /// [`ConfigError`] with the key of the setting, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let iterations = |key: &str, n: u32, least: f64| within(format!("gaussians.{key}"), f64::from(n), least, 1e7);
        iterations("iterations", self.iterations, 1.0)?;
        // The largest integer of TOML, in which configurations are kept.
        within("gaussians.seed", self.seed as f64, 0.0, i64::MAX as f64)?;
        within("gaussians.dssim", self.dssim, 0.0, 1.0)?;
        iterations("degree_every", self.degree_every, 1.0)?;
        let CloudRates { centre, log_scale, rotation, opacity, colour, bands_divisor } = self.rates;
        iterations("rates_until", self.rates_until, 1.0)?;
        for (name, rate) in [
            ("centre", centre),
            ("log_scale", log_scale),
            ("rotation", rotation),
            ("opacity", opacity),
            ("colour", colour),
        ] {
            within(format!("gaussians.rates.{name}.start"), rate.start, f64::MIN_POSITIVE, 10.0)?;
            within(format!("gaussians.rates.{name}.end"), rate.end, f64::MIN_POSITIVE, 10.0)?;
            within(format!("gaussians.rates.{name}.from"), rate.from, 0.0, 1.0 - 1e-6)?;
        }
        within("gaussians.rates.bands_divisor", bands_divisor, 1.0, 1e6)?;
        let DensityControl { from, until, interval, gradient_threshold, cloned_share, .. } = self.density;
        let DensityControl { split_divisor, min_opacity, reset_every, reset_opacity, .. } = self.density;
        iterations("density.from", from, 0.0)?;
        iterations("density.until", until, 0.0)?;
        iterations("density.interval", interval, 1.0)?;
        within("gaussians.density.gradient_threshold", gradient_threshold, 0.0, 1e6)?;
        within("gaussians.density.cloned_share", cloned_share, 0.0, 1e6)?;
        within("gaussians.density.split_divisor", split_divisor, 1.0, 100.0)?;
        within("gaussians.density.min_opacity", min_opacity, 0.0, 0.5)?;
        iterations("density.reset_every", reset_every, 1.0)?;
        within("gaussians.density.reset_opacity", reset_opacity, min_opacity, 1.0 - 1e-6)?;
        within("gaussians.density.largest_share", self.density.largest_share, 0.0, 1e6)
    }

    /// Share of the learning rates' path that is behind at an iteration.
    pub fn progress_at(&self, iteration: u32) -> f64 {
        f64::from(iteration.min(self.rates_until)) / f64::from(self.rates_until)
    }

    /// The default, all of whose schedules run through within `iterations`, as those of anchors do.
    pub fn hurried(iterations: u32) -> Self {
        let mut config = Self { iterations, ..Self::default() };
        let hurry = |counted: &mut u32| *counted = (u64::from(*counted) * u64::from(iterations) / 30_000).max(1) as u32;
        let DensityControl { from, until, reset_every, .. } = &mut config.density;
        [&mut config.degree_every, &mut config.rates_until, from, until, reset_every].into_iter().for_each(hurry);
        config
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_run_can_use_is_refused_by_its_key() {
        let sound = CloudConfig::default();
        assert_eq!(sound.validate(), Ok(()));
        let mut faulty = [sound; 4];
        faulty[0].iterations = 0;
        faulty[1].dssim = f64::NAN;
        faulty[2].rates.opacity.end = 0.0;
        faulty[3].density.interval = 0;
        let keys = ["iterations", "dssim", "rates.opacity.end", "density.interval"];
        for (config, key) in faulty.iter().zip(keys) {
            let said = config.validate().unwrap_err().to_string();
            assert!(said.starts_with(&format!("gaussians.{key} is ")), "{said}");
        }
    }

    #[test]
    fn a_rate_falls_to_its_end_and_stays_there() {
        for iterations in [7_000, 50_000] {
            let config = CloudConfig { iterations, ..CloudConfig::default() };
            for (iteration, rate) in [(0, 1.6e-4), (15_000, 1.6e-5), (30_000, 1.6e-6), (50_000, 1.6e-6)] {
                let found = config.rates.centre.at(config.progress_at(iteration));
                assert!((found / rate - 1.0).abs() < 1e-9, "{found} at {iteration}");
            }
        }
    }
}
