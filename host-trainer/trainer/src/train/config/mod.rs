//! What a run is made of: numbers a user may set, with the method's defaults.

use serde::{Deserialize, Serialize};

use super::modules::Modules;
pub use super::schedule::{Backbone, Densification, ExposureChoice, Hac, HalfSize, LearningRate, Rates};
use super::schedule::{ConfigError, within};
use pocketsplat_capture::dataset::{Capture, PointsOrigin};
use pocketsplat_kernels::scene::ModelShape;
use pocketsplat_kernels::scene::init::least_voxel_size;
use pocketsplat_kernels::step::{LossWeights, Phase};

/// A whole run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrainConfig {
    /// Kind of scene.
    pub backbone: Backbone,
    /// Widths and effects.
    pub shape: ModelShape,
    /// Optimiser steps; starting points and horizons scale with them.
    pub iterations: u32,
    /// Everything random follows from it.
    pub seed: u64,
    /// Edge ε of a lattice cell, normalised units; without it [`Capture::suggested_voxel_size`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub voxel_size: Option<f64>,
    /// Every so many training views one is held out, to measure with and never to train on; 0: none. A capture with fewer
    /// than [`MIN_VIEWS_TO_HOLD_OUT`] has none to spare.
    pub validation_every: u32,
    /// Learning rates.
    pub rates: Rates,
    /// Whether the colour behind the scene is trained with it; it begins as the capture's.
    #[serde(default)]
    pub learns_background: bool,
    /// Loss weights.
    pub loss: LossWeights,
    /// Smaller images first.
    #[serde(default)]
    pub half_size: HalfSize,
    /// Photographs that are exposed unlike each other.
    #[serde(default)]
    pub exposure: ExposureChoice,
    /// Whether the training cameras are moved to where their photographs fit the scene best.
    #[serde(default)]
    pub refine_poses: bool,
    /// Growth and pruning.
    pub densification: Densification,
    /// The rate, where the backbone has one.
    pub hac: Hac,
    /// What is plugged in.
    #[serde(default)]
    pub modules: Modules,
}

/// Training views without which none is held out.
pub const MIN_VIEWS_TO_HOLD_OUT: usize = 12;

impl Default for TrainConfig {
    fn default() -> Self {
        Self {
            backbone: Backbone::Scaffold,
            shape: ModelShape { view_colour: true, view_geometry: true, ..ModelShape::plain(32, 10) },
            iterations: 30_000,
            seed: 42,
            voxel_size: None,
            validation_every: 0,
            rates: Rates::default(),
            learns_background: false,
            loss: LossWeights::default(),
            half_size: HalfSize::default(),
            exposure: ExposureChoice::default(),
            refine_poses: false,
            densification: Densification::default(),
            hac: Hac::default(),
            modules: Modules::default(),
        }
    }
}

impl TrainConfig {
    /// Refuses what no run can use, before any work starts.
    ///
    /// # Errors
    /// [`ConfigError`] with the key of the setting, its value and what is accepted.
    pub fn validate(&self) -> Result<(), ConfigError> {
        self.modules.each().into_iter().try_for_each(|module| module.check())?;
        within("train.iterations", f64::from(self.iterations), 1.0, 10_000_000.0)?;
        for (key, at) in self.modules.each().into_iter().filter_map(|module| module.weighs_bits_at()) {
            if !self.backbone.is_coded() {
                return Err(ConfigError::NoRate { key });
            }
            // The context model begins with the iteration after its share.
            let least = self.hac.context_from + 1.0 / f64::from(self.iterations);
            if self.hac.context_from < at && at < least {
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of iterations")]
                let needed = (1.0 / (at - self.hac.context_from)).ceil() as u32;
                return Err(ConfigError::TooShort { found: self.iterations, needed, key });
            }
            within(key, at, least, 1.0)?;
            if self.hac.lambda == 0.0 {
                return Err(ConfigError::NoPrice { key });
            }
        }
        within("train.shape.feature_dim", self.shape.feature_dim as f64, 1.0, 256.0)?;
        within("train.shape.n_offsets", self.shape.n_offsets as f64, 1.0, 32.0)?;
        within("train.shape.colour_hidden", self.shape.colour_hidden as f64, 0.0, 256.0)?;
        // The module widens the shape when the run begins.
        let (found, needed) = (self.shape.detail_hidden, self.modules.detail.map_or(0, |detail| detail.hidden));
        if found > 0 && found != needed {
            return Err(ConfigError::DetailHidden { found, needed });
        }
        within("train.voxel_size", self.voxel_size.unwrap_or(1e-3), 1e-6, 1.0)?;
        within(
            "train.densification.coarsest_cells",
            f64::from(self.densification.coarsest_cells.unwrap_or(1)),
            1.0,
            1e6,
        )?;
        within("train.densification.kept_anchors", self.densification.kept_anchors.unwrap_or(1) as f64, 1.0, 1e9)?;
        // The largest integer of TOML, in which configurations are kept.
        within("train.seed", self.seed as f64, 0.0, i64::MAX as f64)?;
        if self.validation_every == 1 {
            return Err(ConfigError::NoViewLeft);
        }
        for (name, value, low, high) in self.hac.ranges() {
            within(name, value, low, high)?;
        }
        let Rates { offset, feature, log_scale, opacity_head, covariance_head, colour_head, .. } = self.rates;
        let Rates { mask, grid, context, background, .. } = self.rates;
        for (name, rate) in [
            ("offset", offset),
            ("feature", feature),
            ("log_scale", log_scale),
            ("opacity_head", opacity_head),
            ("covariance_head", covariance_head),
            ("colour_head", colour_head),
            ("mask", mask),
            ("grid", grid),
            ("context", context),
            ("background", background),
        ] {
            within(format!("train.rates.{name}.start"), rate.start, 0.0, 10.0)?;
            // A path to 0 has no logarithm; a rate that starts at 0 stays there.
            let least_end = if rate.start > 0.0 { f64::MIN_POSITIVE } else { 0.0 };
            within(format!("train.rates.{name}.end"), rate.end, least_end, 10.0)?;
            within(format!("train.rates.{name}.from"), rate.from, 0.0, 1.0 - 1e-6)?;
        }
        within("train.loss.dssim", self.loss.dssim, 0.0, 1.0)?;
        within("train.loss.volume", self.loss.volume, 0.0, 1e6)?;
        within("train.half_size.until", self.half_size.until, 0.0, 1.0)?;
        let Densification { statistics_from, from, until, interval, success, levels, .. } = self.densification;
        let Densification { gradient_threshold, min_opacity, .. } = self.densification;
        within("train.densification.success", success, 0.0, 1.0)?;
        within("train.densification.levels", f64::from(levels), 0.0, 10.0)?;
        within("train.densification.gradient_threshold", gradient_threshold, 0.0, 1e6)?;
        within("train.densification.min_opacity", min_opacity, 0.0, 1e6)?;
        within("train.densification.statistics_from", statistics_from, 0.0, 1.0)?;
        within("train.densification.from", from, 0.0, 1.0)?;
        within("train.densification.until", until, 0.0, 1.0)?;
        within("train.densification.interval", f64::from(interval), 1.0, 1e9)
    }

    /// The voxel size for a capture.
    pub fn voxel_size_for(&self, capture: &Capture) -> f64 {
        let suggested = || capture.suggested_voxel_size().max(least_voxel_size(&capture.points));
        self.voxel_size.unwrap_or_else(suggested)
    }

    /// Refuses a voxel size with which a scene of this capture would fit no bundle.
    ///
    /// # Errors
    /// [`ConfigError::VoxelTooSmall`].
    pub fn check_voxel_size(&self, capture: &Capture) -> Result<(), ConfigError> {
        let (found, needed) = (self.voxel_size_for(capture), least_voxel_size(&capture.points));
        if found < needed { Err(ConfigError::VoxelTooSmall { found, needed }) } else { Ok(()) }
    }

    /// The coarsest voxel edge of growth for a capture, lattice cells.
    pub fn coarsest_cells_for(&self, capture: &Capture) -> u32 {
        self.densification.coarsest_cells.unwrap_or(match capture.points_origin {
            PointsOrigin::Random => 4,
            _ => 16,
        })
    }

    /// The same with nothing left to the capture: what a run keeps, so that it does not change with the capture's points.
    pub fn resolved_for(&self, capture: &Capture) -> Self {
        let coarsest_cells = Some(self.coarsest_cells_for(capture));
        let densification = Densification { coarsest_cells, ..self.densification };
        let shape = self.modules.shape(self.shape);
        let HalfSize { until, least_px } = self.half_size;
        let is_large = capture.largest_px().into_iter().max().is_some_and(|px| px / 2 >= least_px);
        let until = if is_large { until.min(densification.until) } else { 0.0 };
        let half_size = HalfSize { until, least_px };
        Self { voxel_size: Some(self.voxel_size_for(capture)), densification, shape, half_size, ..*self }
    }

    /// Whether iteration `iteration`, from 1, sees images of half the size; resolved for the capture.
    pub fn is_half_size(&self, iteration: u32) -> bool {
        iteration <= self.iteration_at(self.half_size.until)
    }

    /// What iteration `iteration`, from 1, does to the values of anchors.
    pub fn phase(&self, iteration: u32) -> Phase {
        let after = |share: f64| iteration > self.iteration_at(share);
        match self.hac {
            _ if !self.backbone.is_coded() => Phase::Raw,
            Hac { exact_from, .. } if after(exact_from) => Phase::IntegerModel,
            Hac { context_from, .. } if after(context_from) => Phase::Context,
            Hac { noise_from, .. } if after(noise_from) => Phase::Noise,
            _ => Phase::Raw,
        }
    }

    /// Whether growth and pruning pause at `iteration`, so that the heads get used to the noise first.
    pub fn pauses_at(&self, iteration: u32) -> bool {
        let pause = self.iteration_at(self.hac.noise_from)..self.iteration_at(self.hac.pause_until);
        self.backbone.is_coded() && pause.contains(&iteration)
    }

    /// Whether training view `index` of `n_views` is held out.
    pub fn holds_out(&self, index: usize, n_views: usize) -> bool {
        let every = self.validation_every as usize;
        every > 0 && n_views >= MIN_VIEWS_TO_HOLD_OUT && index % every == (MIN_VIEWS_TO_HOLD_OUT.min(every) - 1)
    }

    /// The iteration at share `share` of the run.
    pub fn iteration_at(&self, share: f64) -> u32 {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "shares are in 0..=1")]
        let at = (share * f64::from(self.iterations)).round() as u32;
        at
    }
}

#[cfg(test)]
mod tests;
