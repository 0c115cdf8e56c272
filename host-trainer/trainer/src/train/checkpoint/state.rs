//! A trainer to a checkpoint and back.

use std::io::{self, Write};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::codec::{Decoder, Encoder};
use super::context;
use super::{CaptureDifference, CaptureSignature, CheckpointFault, Kernels};
use crate::ops::adam::Moments;
use crate::scene::{Anchors, Heads, ModelShape, Scene};
use crate::train::optimiser::Optimiser;
use crate::train::statistics::Statistics;
use crate::train::watchdog::Watchdog;
use crate::train::{TrainConfig, TrainError, Trainer};
use pocketsplat_capture::dataset::Capture;

/// Why a run can not go on from a checkpoint.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RestoreError {
    /// The bytes are not sound.
    #[error(transparent)]
    Fault(#[from] CheckpointFault),
    /// The capture is another one.
    #[error("this is not the capture that the run began with: {0}")]
    Capture(#[from] CaptureDifference),
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

impl<'a> Trainer<'a> {
    /// Writes everything that the next iteration depends on; see [`crate::train::checkpoint`] for the format.
    ///
    /// # Errors
    /// What `out` reports.
    pub fn save(&self, out: impl Write) -> io::Result<()> {
        let mut out = Encoder::begin(out)?;
        out.text(&toml::to_string(&self.config).map_err(io::Error::other)?)?;
        let kernels = self.kernels();
        out.text(&kernels.description)?;
        out.value(kernels.probe)?;
        self.signature.encode(&mut out)?;

        out.value([self.iteration, self.optimiser.n_steps])?;
        out.value([self.watchdog.n_dropped, self.watchdog.n_in_a_row])?;
        out.value([self.seconds, self.processor_seconds])?;
        out.value(self.rng.get_seed())?;
        out.value(self.rng.get_stream())?;
        out.value(self.rng.get_word_pos())?;
        out.values(&self.queue)?;

        let Anchors { lattice, features, log_scales, offsets, mask_logits, places } = &self.scene.anchors;
        out.values(lattice)?;
        out.values(places)?;
        let Optimiser { features: f, log_scales: s, offsets: o, mask_logits: m, .. } = &self.optimiser;
        for (values, moments) in [(features, f), (log_scales, s), (offsets, o), (mask_logits, m)] {
            out.values(values)?;
            out.values(&moments.first)?;
            out.values(&moments.second)?;
        }
        for heads in [&self.scene.heads, &self.optimiser.heads[0], &self.optimiser.heads[1]] {
            for group in heads.each().flat_map(|head| head.groups()) {
                out.values(group)?;
            }
        }
        if self.config.learns_background {
            out.value(self.background)?;
            out.values(&self.optimiser.background.first)?;
            out.values(&self.optimiser.background.second)?;
        }
        context::encode(&mut out, self.scene.context.as_ref(), self.optimiser.context.as_ref())?;
        let Statistics { opacity_sum, n_views, gradient_sum, n_drawn } = &self.statistics;
        out.values(opacity_sum)?;
        out.values(n_views)?;
        out.values(gradient_sum)?;
        out.values(n_drawn)?;
        out.end()
    }

    /// Reads what [`Self::save`] wrote.
    ///
    /// # Errors
    /// [`RestoreError`] when the bytes are damaged or `capture` is not the one that the run began with.
    pub fn restore(capture: &'a Capture, bytes: &[u8]) -> Result<Restored<'a>, RestoreError> {
        let mut from = Decoder::begin(bytes)?;
        let text = from.text("configuration")?;
        let config: TrainConfig = toml::from_str(&text)
            .map_err(|e| CheckpointFault::Text { what: "configuration", why: e.message().to_owned() })?;
        let written_by = Kernels { description: from.text("kernels")?, probe: from.value("probe")? };
        let begun_with = CaptureSignature::decode(&mut from)?;
        let mut trainer = Self::without_scene(capture, config)?;
        trainer.signature.matches(&begun_with)?;
        trainer.decode_state(&mut from)?;
        from.end()?;
        Ok(Restored { trainer, written_by })
    }

    fn decode_state(&mut self, from: &mut Decoder<'_>) -> Result<(), CheckpointFault> {
        let shape = self.config.shape;
        let ModelShape { feature_dim, n_offsets, .. } = shape;
        let [iteration, n_steps] = from.value("iteration")?;
        if iteration > self.config.iterations {
            let [found, needed] = [iteration, self.config.iterations].map(u64::from);
            return Err(CheckpointFault::Content { what: "iterations done", found, needed });
        }
        self.iteration = iteration;
        let [n_dropped, n_in_a_row] = from.value("dropped steps")?;
        self.watchdog = Watchdog { n_dropped, n_in_a_row };
        [self.seconds, self.processor_seconds] = from.value("seconds")?;
        self.rng = ChaCha8Rng::from_seed(from.value("random seed")?);
        self.rng.set_stream(from.value("random stream")?);
        self.rng.set_word_pos(from.value("random position")?);
        self.queue = from.values("view queue")?;
        let n_views = self.signature.n_views();
        if let Some(view) = self.queue.iter().find(|view| **view as usize >= n_views) {
            let [found, needed] = [u64::from(*view), n_views as u64 - 1];
            return Err(CheckpointFault::Content { what: "view in the queue", found, needed });
        }

        let lattice: Vec<[i32; 3]> = from.values("lattice")?;
        let n = lattice.len();
        let places: Vec<f32> = from.values("places")?;
        if !(places.is_empty() || places.len() == n) {
            let [found, needed] = [places.len(), n].map(|n| n as u64);
            return Err(CheckpointFault::Content { what: "number of places", found, needed });
        }
        let mut array = |what, width: usize| -> Result<_, CheckpointFault> {
            let len = n * width;
            let values: Vec<f32> = from.exactly(what, len)?;
            let moments = Moments { first: from.exactly(what, len)?, second: from.exactly(what, len)? };
            Ok((values, moments))
        };
        let (features, f) = array("features", feature_dim)?;
        let (log_scales, s) = array("log-scales", shape.n_log_scales())?;
        let (offsets, o) = array("offsets", 3 * n_offsets)?;
        let (mask_logits, m) = array("mask logits", n_offsets)?;
        let voxel_size = self.config.voxel_size_for(self.capture);
        let mut heads = || {
            let mut heads = Heads::filled(&shape, 0.0f32);
            for group in heads.each_mut().flat_map(|head| head.groups_mut()) {
                *group = from.exactly("heads", group.len())?;
            }
            Ok::<_, CheckpointFault>(heads)
        };
        let anchors = Anchors { lattice, features, log_scales, offsets, mask_logits, places };
        self.scene = Scene { shape, voxel_size, anchors, heads: heads()?, context: None };
        let heads = [heads()?, heads()?];
        let mut background = Moments::zeros(3);
        if self.config.learns_background {
            self.background = from.value("background")?;
            background = Moments { first: from.exactly("background", 3)?, second: from.exactly("background", 3)? };
        }
        let (model, moments) = context::decode(from, &shape)?.unzip();
        self.scene.context = model;
        self.optimiser = Optimiser {
            n_steps,
            features: f,
            log_scales: s,
            offsets: o,
            mask_logits: m,
            heads,
            background,
            context: moments,
        };
        self.statistics = Statistics {
            opacity_sum: from.exactly("opacity sums", n)?,
            n_views: from.exactly("view counts", n)?,
            gradient_sum: from.exactly("gradient sums", n * n_offsets)?,
            n_drawn: from.exactly("drawn counts", n * n_offsets)?,
        };
        Ok(())
    }
}
