//! A trainer to a checkpoint and back.

use std::io::{self, Write};

use pocketsplat_format::context::N_LEVELS;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::envelope::{self, Progress, RandomState, content, needs, part};
use super::{CaptureDifference, CaptureSignature, CheckpointFault, Kernels, MAGIC};
use crate::train::config::Backbone;
use crate::train::optimiser::Optimiser;
use crate::train::statistics::Statistics;
use crate::train::{TrainConfig, TrainError, Trainer};
use pocketsplat_capture::dataset::Capture;
use pocketsplat_kernels::scene::{Anchors, ContextModel, Heads, ModelShape, QuantisationSteps, Scene};

/// Why a run cannot go on from a checkpoint.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RestoreError {
    /// The bytes are not sound.
    #[error(transparent)]
    Fault(#[from] CheckpointFault),
    /// The capture is another one.
    #[error("this is not the capture that the run began with: {0}")]
    Capture(CaptureDifference),
    /// A fork asks for another scene than the checkpoint holds.
    #[error(
        "a fork keeps `train.{key}` of its run, which is {kept}, but {asked} was asked for; leave out what sets it"
    )]
    Fork {
        /// The key of the setting that differs.
        key: &'static str,
        /// Its value in the run.
        kept: String,
        /// The value asked for.
        asked: String,
    },
    /// No trainer can be made of capture and configuration.
    #[error(transparent)]
    Train(#[from] TrainError),
}

/// A run ready to go on.
#[derive(Debug)]
pub struct Restored<'a> {
    /// As it was.
    pub trainer: Trainer<'a>,
    /// What wrote the checkpoint; where it differs from [`Trainer::kernels`], the run will not end in the same bits.
    pub written_by: Kernels,
}

/// Whether the capture at hand is the one that a run began with.
type Comparison = fn(&CaptureSignature, &CaptureSignature) -> Result<(), CaptureDifference>;

/// The scene and what belongs to it, the background's colour, the weight of the bits.
type Learned = (Anchors<f32>, Heads<f32>, Option<ContextModel<f32>>, Optimiser<f32>, Statistics, [f32; 3], f64);

impl<'a> Trainer<'a> {
    /// Writes everything that the next iteration depends on; see [`crate::train::checkpoint`] for the format.
    ///
    /// # Errors
    /// What `out` reports, and that something newer is on a device: [`Self::fetch`] comes first.
    pub fn save(&self, out: impl Write) -> io::Result<()> {
        if !self.is_here() {
            return Err(io::Error::other("the scene's parameters are on the device, and were not fetched"));
        }
        let config = toml::to_string(&self.config).map_err(io::Error::other)?;
        let progress = (self.iteration, self.watchdog, [self.seconds, self.processor_seconds], &self.queue);
        let random = (self.rng.get_seed(), self.rng.get_stream(), self.rng.get_word_pos());
        let Scene { anchors, heads, context, .. } = &self.scene;
        let learned = (anchors, heads, context, &self.optimiser, &self.statistics, self.background, self.lambda);
        envelope::write(out, MAGIC, &(config, self.kernels(), &self.signature, progress, random, learned))
    }

    /// Reads what [`Self::save`] wrote.
    ///
    /// # Errors
    /// [`RestoreError`] when the bytes are damaged or `capture` is not the one that the run began with.
    pub fn restore(capture: &'a Capture, bytes: &[u8]) -> Result<Restored<'a>, RestoreError> {
        Self::read(capture, bytes, CaptureSignature::matches)
    }

    fn read(capture: &'a Capture, bytes: &[u8], compare: Comparison) -> Result<Restored<'a>, RestoreError> {
        let (config, rest): (String, _) = part(content(bytes, MAGIC)?)?;
        let config: TrainConfig = toml::from_str(&config)
            .map_err(|e| CheckpointFault::Form { what: "configuration", why: e.message().to_owned() })?;
        let ((written_by, begun_with), rest): ((Kernels, CaptureSignature), _) = part(rest)?;
        let mut trainer = Self::without_scene(capture, config)?;
        compare(&trainer.signature, &begun_with).map_err(RestoreError::Capture)?;
        let ((progress, (seed, stream, position), learned), rest): ((Progress, RandomState, Learned), _) = part(rest)?;
        needs("bytes after the state", rest.len(), 0)?;
        (trainer.iteration, trainer.watchdog, [trainer.seconds, trainer.processor_seconds], trainer.queue) = progress;
        trainer.rng = ChaCha8Rng::from_seed(seed);
        trainer.rng.set_stream(stream);
        trainer.rng.set_word_pos(position);
        let scene = &mut trainer.scene;
        (scene.anchors, scene.heads, scene.context, trainer.optimiser, trainer.statistics, ..) = learned;
        (.., trainer.background, trainer.lambda) = learned;
        trainer.check()?;
        Ok(Restored { trainer, written_by })
    }

    /// As [`Self::restore`], and goes on as `config` says: the scene, the moments and the random numbers are the checkpoint's. The
    /// photographs may have another size.
    ///
    /// # Errors
    /// As [`Self::restore`]; [`RestoreError::Fork`] when `config` asks for another model, lattice or split of the views, or, once
    /// there is a context model, for another one.
    pub fn fork(capture: &'a Capture, bytes: &[u8], config: TrainConfig) -> Result<Restored<'a>, RestoreError> {
        let mut restored = Self::read(capture, bytes, CaptureSignature::matches_at_any_size)?;
        config.validate().map_err(TrainError::from)?;
        let (begun, config) = (restored.trainer.config, config.resolved_for(capture));
        let has_context = restored.trainer.scene.context.is_some();
        let [kept, asked] = [&begun, &config].map(|config| {
            let of_context = has_context.then(|| kept_with_the_context(config));
            kept_by_a_fork(config).into_iter().chain(of_context.into_iter().flatten())
        });
        for ((key, kept), (_, asked)) in kept.zip(asked) {
            if kept != asked {
                return Err(RestoreError::Fork { key, kept, asked });
            }
        }
        if config.hac.lambda != begun.hac.lambda {
            restored.trainer.lambda = config.hac.lambda;
        }
        restored.trainer.config = config;
        restored.trainer.check()?;
        Ok(restored)
    }

    /// That counters and lengths agree with configuration and capture.
    fn check(&self) -> Result<(), CheckpointFault> {
        let (shape, scene) = (self.config.shape, &self.scene);
        if self.iteration > self.config.iterations {
            needs("iterations done", self.iteration as usize, self.config.iterations as usize)?;
        }
        let n_views = self.signature.n_views();
        if let Some(view) = self.queue.iter().find(|view| **view as usize >= n_views) {
            needs("view in the queue", *view as usize, n_views - 1)?;
        }
        let Anchors { features, log_scales, offsets, mask_logits, prune_rank, rarity, .. } = &scene.anchors;
        let n = scene.anchors.len();
        for (what, of_anchors) in [("number of prune ranks", prune_rank), ("number of rarities", rarity)] {
            if !of_anchors.is_empty() {
                needs(what, of_anchors.len(), n)?;
            }
        }
        let Optimiser { features: f, log_scales: s, offsets: o, mask_logits: m, background, .. } = &self.optimiser;
        for (what, values, moments, width) in [
            ("features", features, f, shape.feature_dim),
            ("log-scales", log_scales, s, shape.n_log_scales()),
            ("offsets", offsets, o, 3 * shape.n_offsets),
            ("mask logits", mask_logits, m, shape.n_offsets),
        ] {
            for values in [values, &moments.first, &moments.second] {
                needs(what, values.len(), n * width)?;
            }
        }
        needs("background", background.first.len(), 3)?;
        let lens =
            |heads: &Heads<f32>| heads.each().flat_map(|head| head.groups().map(<[f32]>::len)).collect::<Vec<_>>();
        let needed = lens(&Heads::filled(&shape, 0.0));
        for heads in [&scene.heads, &self.optimiser.heads[0], &self.optimiser.heads[1]] {
            for (found, needed) in
                lens(heads).into_iter().chain([usize::MAX]).zip(needed.iter().copied().chain([usize::MAX]))
            {
                needs("heads", found, needed)?;
            }
        }
        if let (Some(model), moments) = (&scene.context, &self.optimiser.context) {
            let moments = moments.as_ref().map_or(0, |moments| moments.rows.first.len());
            needs("moments of the grid", moments, model.rows.len())?;
            let (n_taps, n_networks) =
                (model.networks.first().map_or(0, |network| network.n_taps), model.networks.len());
            needs("taps of the context model", n_taps, self.config.backbone.n_taps(shape.feature_dim))?;
            let n_levels = if self.config.backbone == Backbone::ContextGs { N_LEVELS } else { 1 };
            needs("networks of the context model", n_networks, n_levels)?;
        }
        let Statistics { opacity_sum, n_views, gradient_sum, n_drawn } = &self.statistics;
        needs("opacity sums", opacity_sum.len(), n)?;
        needs("view counts", n_views.len(), n)?;
        needs("gradient sums", gradient_sum.len(), n * shape.n_offsets)?;
        needs("drawn counts", n_drawn.len(), n * shape.n_offsets)
    }
}

/// What a fork must keep of its run: keys within `train`, each with its value. Both runs are resolved, so ε is known.
fn kept_by_a_fork(config: &TrainConfig) -> [(&'static str, String); 11] {
    let ModelShape {
        feature_dim,
        n_offsets,
        view_colour,
        view_geometry,
        view_distance,
        dilation_compensation,
        anisotropic,
        colour_hidden,
        detail_hidden,
    } = config.shape;
    [
        ("shape.feature_dim", feature_dim.to_string()),
        ("shape.n_offsets", n_offsets.to_string()),
        ("shape.view_colour", view_colour.to_string()),
        ("shape.view_geometry", view_geometry.to_string()),
        ("shape.view_distance", view_distance.to_string()),
        ("shape.dilation_compensation", dilation_compensation.to_string()),
        ("shape.anisotropic", anisotropic.to_string()),
        ("shape.colour_hidden", colour_hidden.to_string()),
        ("shape.detail_hidden", detail_hidden.to_string()),
        ("voxel_size", config.voxel_size.map(|edge| edge.to_string()).unwrap_or_default()),
        ("validation_every", config.validation_every.to_string()),
    ]
}

/// What it must keep besides where its run has a context model.
fn kept_with_the_context(config: &TrainConfig) -> [(&'static str, String); 4] {
    let QuantisationSteps { feature, log_scale, offset } = config.hac.base_steps;
    [
        ("backbone", toml::Value::try_from(config.backbone).map(|name| name.to_string()).unwrap_or_default()),
        ("hac.base_steps.feature", feature.to_string()),
        ("hac.base_steps.log_scale", log_scale.to_string()),
        ("hac.base_steps.offset", offset.to_string()),
    ]
}
