//! What a run is made of: numbers a user may set, with the method's defaults.

mod hac;

use serde::{Deserialize, Serialize};

pub use hac::{Backbone, Hac};

use super::config_error::{ConfigError, within};
use super::module::Modules;
use pocketsplat_capture::dataset::{Capture, PointsOrigin};
use pocketsplat_kernels::scene::ModelShape;
use pocketsplat_kernels::scene::init::least_voxel_size;
use pocketsplat_kernels::step::{LossWeights, Phase};

/// A learning rate over the run: `start` until share `from` is done, then on a geometric path to `end`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LearningRate {
    /// At iteration 0.
    pub start: f64,
    /// At the last iteration.
    pub end: f64,
    /// Share of the run up to which it stays at `start`.
    #[serde(default)]
    pub from: f64,
}

impl LearningRate {
    /// A geometric path over the whole run.
    pub const fn falling(start: f64, end: f64) -> Self {
        Self { start, end, from: 0.0 }
    }

    /// lr(t) = start^(1 − u) · end^u with `progress` = t/T and u = max(0, (t/T − from)/(1 − from)).
    pub fn at(&self, progress: f64) -> f64 {
        if self.start <= 0.0 || progress <= self.from {
            return self.start.max(0.0);
        }
        let fallen = (progress - self.from) / (1.0 - self.from);
        (self.start.ln() * (1.0 - fallen) + self.end.ln() * fallen).exp()
    }

    /// The same path, `factor` times as high.
    pub fn times(&self, factor: f64) -> Self {
        Self { start: self.start * factor, end: self.end * factor, ..*self }
    }
}

/// Learning rates: they start as those of the published trainers of Scaffold-GS and HAC, and decay together.
///
/// The published rates of features, log-scales and the covariance head are constant: a value that still moves at the end flips
/// across the borders between symbols until the last step. Those of offsets, opacity, colour and the context model fall all the
/// way, to a hundredth and less: what rate–distortion pruning leaves, late in the run, hardly moves into the gaps. Here all of them stay
/// until 0.85 of the run and then fall to a tenth or a fifteenth. Masks fall all the way as published, and so does
/// a background that is learned.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rates {
    /// Offsets; multiplied by the capture's extent.
    pub offset: LearningRate,
    /// Anchor features.
    pub feature: LearningRate,
    /// Log-scales.
    pub log_scale: LearningRate,
    /// Opacity head.
    pub opacity_head: LearningRate,
    /// Covariance head.
    pub covariance_head: LearningRate,
    /// Colour head.
    pub colour_head: LearningRate,
    /// Mask logits; multiplied by the capture's extent. Where there is a rate, as those below.
    pub mask: LearningRate,
    /// Grid of the context model.
    pub grid: LearningRate,
    /// Network of the context model.
    pub context: LearningRate,
    /// Background, where it is learned.
    #[serde(default = "background_rate")]
    pub background: LearningRate,
}

/// The rate of the background.
const fn background_rate() -> LearningRate {
    LearningRate::falling(0.01, 1e-4)
}

/// Share of the run after which rates fall.
pub(super) const DECAY_FROM: f64 = 0.85;

impl Default for Rates {
    fn default() -> Self {
        let decaying = |start, end| LearningRate { start, end, from: DECAY_FROM };
        Self {
            offset: decaying(0.01, 1e-3),
            feature: decaying(0.0075, 5e-4),
            log_scale: decaying(0.007, 5e-4),
            opacity_head: decaying(0.002, 2e-4),
            covariance_head: decaying(0.004, 4e-4),
            colour_head: decaying(0.008, 8e-4),
            mask: LearningRate::falling(0.01, 1e-4),
            grid: decaying(0.005, 5e-4),
            context: decaying(0.005, 5e-4),
            background: background_rate(),
        }
    }
}

/// When and how anchors come and go (Lu et al. 2024, Scaffold-GS, section 3.3; constants of the published trainer).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Densification {
    /// Shares of the run at which statistics start, growth starts and both end; 500, 1,500 and 15,000 of 30,000.
    pub statistics_from: f64,
    /// See `statistics_from`.
    pub from: f64,
    /// See `statistics_from`.
    pub until: f64,
    /// Iterations between two events; not scaled with the run.
    pub interval: u32,
    /// Share of an interval an anchor must have been seen in to be judged.
    pub success: f64,
    /// Mean screen gradient, half-image units, above which an offset asks for a new anchor at the coarsest level.
    pub gradient_threshold: f64,
    /// Voxel edge of the coarsest level, lattice cells; levels follow at a quarter each while at least one cell.
    /// Without it what the method publishes: 4 where training starts from random points, 16 where it starts from a
    /// capture's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coarsest_cells: Option<u32>,
    /// Levels at most.
    pub levels: u32,
    /// Anchors whose mean opacity sum is below are pruned.
    pub min_opacity: f64,
    /// Growth stops here; of the candidates that still fit, those with the largest gradient sums are taken.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_anchors: Option<usize>,
    /// Of the anchors that there are when growth ends, those that contribute most to the training views are kept, so many.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kept_anchors: Option<usize>,
}

impl Default for Densification {
    fn default() -> Self {
        Self {
            statistics_from: 500.0 / 30_000.0,
            from: 1_500.0 / 30_000.0,
            until: 15_000.0 / 30_000.0,
            interval: 100,
            success: 0.8,
            gradient_threshold: 2e-4,
            coarsest_cells: None,
            levels: 3,
            min_opacity: 0.005,
            max_anchors: None,
            kept_anchors: None,
        }
    }
}

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
            densification: Densification::default(),
            hac: Hac::default(),
            modules: Modules::default(),
        }
    }
}

impl TrainConfig {
    /// The defaults of a backbone: anchors of HAC, HAC++ and ContextGS have 50 features.
    ///
    /// (Published HAC also shows the heads the distance of view. On lego that costs 0.3 dB in short runs, so it is an option
    /// here.)
    pub fn of(backbone: Backbone) -> Self {
        let scaffold = Self::default();
        match backbone {
            Backbone::Scaffold => scaffold,
            Backbone::Hac | Backbone::HacPlus | Backbone::ContextGs => {
                let shape = ModelShape { feature_dim: 50, ..scaffold.shape };
                Self { backbone, shape, ..scaffold }
            }
        }
    }

    /// The same with another backbone; what stands at the default of the former takes that of the latter.
    pub fn with_backbone(self, backbone: Backbone) -> Self {
        let (from, to) = (Self::of(self.backbone).shape, Self::of(backbone).shape);
        let mut shape = self.shape;
        if shape.feature_dim == from.feature_dim {
            shape.feature_dim = to.feature_dim;
        }
        Self { backbone, shape, ..self }
    }

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
        Self { voxel_size: Some(self.voxel_size_for(capture)), densification, shape, ..*self }
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
