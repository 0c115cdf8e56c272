//! What a run is made of: numbers a user may set, with the method's defaults.

use serde::{Deserialize, Serialize};

use crate::train::schedule::{ConfigError, LearningRate, within};

/// A whole run on explicit Gaussians (Kerbl et al. 2023, sections 5 and 7.1).
///
/// Everything that the paper counts in iterations of its 30,000 is a share here, so that schedules scale with the run's length.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CloudConfig {
    /// Optimiser steps.
    pub iterations: u32,
    /// Everything random follows from it.
    pub seed: u64,
    /// Share λ of 1 − SSIM in the loss; L1 has 1 − λ.
    pub dssim: f64,
    /// The degree of colours rises by one after each such share of the run, to 3.
    pub degree_every: f64,
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
    /// Share of the run from which on it happens.
    pub from: f64,
    /// Share of the run at which it ends.
    pub until: f64,
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
    /// Share of the run from one lowering of all opacities to the next.
    pub reset_every: f64,
    /// What opacities are lowered to; and twice the least that is kept.
    pub reset_opacity: f64,
    /// Deviations above this share of the extent are too large, once opacities were lowered.
    pub largest_share: f64,
    /// Three deviations above this are too large on the image, px, once opacities were lowered.
    pub largest_px: f64,
}

/// Length of the published runs, iterations.
const PUBLISHED_ITERATIONS: f64 = 30_000.0;

impl Default for CloudConfig {
    fn default() -> Self {
        let constant = |rate| LearningRate { start: rate, end: rate, from: 0.0 };
        Self {
            iterations: 30_000,
            seed: 42,
            dssim: 0.2,
            degree_every: 1_000.0 / PUBLISHED_ITERATIONS,
            rates: CloudRates {
                centre: LearningRate::falling(1.6e-4, 1.6e-6),
                log_scale: constant(5e-3),
                rotation: constant(1e-3),
                opacity: constant(0.05),
                colour: constant(2.5e-3),
                bands_divisor: 20.0,
            },
            density: DensityControl {
                from: 500.0 / PUBLISHED_ITERATIONS,
                until: 15_000.0 / PUBLISHED_ITERATIONS,
                interval: 100,
                gradient_threshold: 2e-4,
                cloned_share: 0.01,
                split_divisor: 1.6,
                min_opacity: 0.005,
                reset_every: 3_000.0 / PUBLISHED_ITERATIONS,
                reset_opacity: 0.01,
                largest_share: 0.1,
                largest_px: 20.0,
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
        within("gaussians.iterations", f64::from(self.iterations), 1.0, 10_000_000.0)?;
        // The largest integer of TOML, in which configurations are kept.
        within("gaussians.seed", self.seed as f64, 0.0, i64::MAX as f64)?;
        within("gaussians.dssim", self.dssim, 0.0, 1.0)?;
        within("gaussians.degree_every", self.degree_every, 0.0, 1.0)?;
        let CloudRates { centre, log_scale, rotation, opacity, colour, bands_divisor } = self.rates;
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
        let DensityControl { largest_share, largest_px, .. } = self.density;
        within("gaussians.density.from", from, 0.0, 1.0)?;
        within("gaussians.density.until", until, 0.0, 1.0)?;
        within("gaussians.density.interval", f64::from(interval), 1.0, 1e9)?;
        within("gaussians.density.gradient_threshold", gradient_threshold, 0.0, 1e6)?;
        within("gaussians.density.cloned_share", cloned_share, 0.0, 1e6)?;
        within("gaussians.density.split_divisor", split_divisor, 1.0, 100.0)?;
        within("gaussians.density.min_opacity", min_opacity, 0.0, 0.5)?;
        within("gaussians.density.reset_every", reset_every, 1e-6, 1.0)?;
        within("gaussians.density.reset_opacity", reset_opacity, min_opacity, 1.0 - 1e-6)?;
        within("gaussians.density.largest_share", largest_share, 0.0, 1e6)?;
        within("gaussians.density.largest_px", largest_px, 0.0, 1e6)
    }

    /// The iteration at share `share` of the run.
    pub fn iteration_at(&self, share: f64) -> u32 {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "shares are in 0..=1")]
        let at = (share * f64::from(self.iterations)).round() as u32;
        at
    }
}

#[cfg(test)]
mod tests {
    use super::CloudConfig;

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
}
