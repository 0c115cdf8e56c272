//! A run on explicit Gaussians to a checkpoint and back; see [`crate::train::run::checkpoint`] for what stands around it.

use std::io::{self, Write};

use pocketsplat_capture::dataset::Capture;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::config::CloudConfig;
use super::density::DensityStatistics;
use super::optimiser::CloudOptimiser;
use super::train::CloudTrainer;
use crate::train::run::Resumable;
use crate::train::run::checkpoint::envelope::{self, Progress, RandomState, needs, part};
use crate::train::run::checkpoint::{CaptureSignature, CheckpointFault, Kernels, RestoreError};
use pocketsplat_kernels::ops::image::spherical_harmonics::MOST;

/// As the checkpoints of anchors have it, with a letter of its own.
const MAGIC: [u8; 8] = *b"\x8bPSGRN\r\n";

/// A run ready to go on.
#[derive(Debug)]
pub struct RestoredCloud<'a> {
    /// As it was.
    pub trainer: CloudTrainer<'a>,
    /// What wrote the checkpoint; where it differs from [`CloudTrainer::kernels`], the run will not end in the same bits.
    pub written_by: Kernels,
}

/// Centres, log-scales, rotations, opacity logits, coefficients.
type Arrays = (Vec<[f32; 3]>, Vec<[f32; 3]>, Vec<[f32; 4]>, Vec<f32>, Vec<[f32; 3]>);
/// The Gaussians and what belongs to them.
type Learned = (Arrays, CloudOptimiser, DensityStatistics);

impl<'a> CloudTrainer<'a> {
    /// What this run is computed with.
    pub fn kernels(&self) -> Kernels {
        Kernels::of_this_machine(self.level)
    }

    /// Writes everything that the next iteration depends on.
    ///
    /// # Errors
    /// What `out` reports.
    pub fn save(&self, out: impl Write) -> io::Result<()> {
        let config = toml::to_string(&self.config).map_err(io::Error::other)?;
        let progress = (self.iteration, self.watchdog, [self.seconds, self.processor_seconds], &self.queue);
        let random = (self.rng.get_seed(), self.rng.get_stream(), self.rng.get_word_pos());
        let cloud = &self.cloud;
        let arrays = (&cloud.centres, &cloud.log_scales, &cloud.rotations, &cloud.opacity_logits, &cloud.harmonics);
        let learned = (arrays, &self.optimiser, &self.statistics);
        envelope::write(out, MAGIC, &(config, self.kernels(), &self.signature, progress, random, learned))
    }

    /// Reads what [`Self::save`] wrote.
    ///
    /// # Errors
    /// [`RestoreError`] when the bytes are damaged or `capture` is not the one that the run began with.
    pub fn restore(capture: &'a Capture, bytes: &[u8]) -> Result<RestoredCloud<'a>, RestoreError> {
        let (config, rest): (String, _) = part(envelope::content(bytes, MAGIC)?)?;
        let config: CloudConfig = toml::from_str(&config)
            .map_err(|e| CheckpointFault::Form { what: "configuration", why: e.message().to_owned() })?;
        let ((written_by, begun_with), rest): ((Kernels, CaptureSignature), _) = part(rest)?;
        let mut trainer = Self::without_cloud(capture, config)?;
        trainer.signature.matches(&begun_with).map_err(RestoreError::Capture)?;
        let ((progress, (seed, stream, position), learned), rest): ((Progress, RandomState, Learned), _) = part(rest)?;
        needs("bytes after the state", rest.len(), 0)?;
        (trainer.iteration, trainer.watchdog, [trainer.seconds, trainer.processor_seconds], trainer.queue) = progress;
        trainer.rng = ChaCha8Rng::from_seed(seed);
        trainer.rng.set_stream(stream);
        trainer.rng.set_word_pos(position);
        let (arrays, optimiser, statistics) = learned;
        let cloud = &mut trainer.cloud;
        (cloud.centres, cloud.log_scales, cloud.rotations, cloud.opacity_logits, cloud.harmonics) = arrays;
        (trainer.optimiser, trainer.statistics) = (optimiser, statistics);
        trainer.check()?;
        Ok(RestoredCloud { trainer, written_by })
    }

    /// That counters and lengths agree with configuration and capture.
    fn check(&mut self) -> Result<(), CheckpointFault> {
        if self.iteration > self.config.iterations {
            needs("iterations done", self.iteration as usize, self.config.iterations as usize)?;
        }
        let n_views = self.n_views();
        if let Some(view) = self.queue.iter().find(|view| **view as usize >= n_views) {
            needs("view in the queue", *view as usize, n_views - 1)?;
        }
        let (cloud, n) = (&self.cloud, self.cloud.len());
        needs("log-scales", cloud.log_scales.len(), n)?;
        needs("rotations", cloud.rotations.len(), n)?;
        needs("opacities", cloud.opacity_logits.len(), n)?;
        needs("coefficients", cloud.harmonics.len(), n * MOST)?;
        for (moments, width) in self.optimiser.each_mut() {
            needs("first moments", moments.first.len(), n * width)?;
            needs("second moments", moments.second.len(), n * width)?;
        }
        let DensityStatistics { gradient_sum, n_drawn, widest_px } = &self.statistics;
        needs("gradient sums", gradient_sum.len(), n)?;
        needs("drawn counts", n_drawn.len(), n)?;
        needs("widths", widest_px.len(), n)
    }
}

impl Resumable for CloudTrainer<'_> {
    fn iteration(&self) -> u32 {
        self.iteration
    }

    fn iterations(&self) -> u32 {
        self.config.iterations
    }

    fn seconds(&self) -> f64 {
        self.seconds
    }

    fn n_dropped(&self) -> u32 {
        self.watchdog.n_dropped
    }

    fn size(&self) -> [usize; 2] {
        [self.cloud.len(); 2]
    }

    fn save(&self, out: &mut dyn Write) -> io::Result<()> {
        self.save(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::explicit::train::tests::tiny_cloud_config;
    use crate::train::test_capture::{many_views, tiny_capture};

    #[test]
    fn a_restored_run_ends_in_the_same_bits() {
        let capture = tiny_capture();
        let mut whole = CloudTrainer::new(&capture, tiny_cloud_config(40)).unwrap();
        let mut kept = Vec::new();
        while !whole.is_done() {
            if whole.iteration == 23 {
                whole.save(&mut kept).unwrap();
            }
            whole.advance().unwrap();
        }
        let mut restored = CloudTrainer::restore(&capture, &kept).unwrap().trainer;
        while !restored.is_done() {
            restored.advance().unwrap();
        }
        assert!(restored.cloud == whole.cloud && restored.optimiser == whole.optimiser, "the same bits");
    }

    #[test]
    fn damage_and_other_captures_are_refused() {
        let capture = tiny_capture();
        let trainer = CloudTrainer::new(&capture, tiny_cloud_config(40)).unwrap();
        let mut bytes = Vec::new();
        trainer.save(&mut bytes).unwrap();
        let other = many_views(6);
        assert!(matches!(CloudTrainer::restore(&other, &bytes), Err(RestoreError::Capture(_))));
        for at in [0, 9, 500, bytes.len() - 1] {
            let mut damaged = bytes.clone();
            damaged[at] ^= 1;
            assert!(matches!(CloudTrainer::restore(&capture, &damaged), Err(RestoreError::Fault(_))), "byte {at}");
        }
        assert!(matches!(CloudTrainer::restore(&capture, &bytes[..700]), Err(RestoreError::Fault(_))));
    }
}
