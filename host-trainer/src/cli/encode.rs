//! From a finished run to a bundle: coded, measured tier by tier, accounted for.

use anyhow::{Result, bail};
use pocketsplat::bundle::manifest::{cameras_to_measure, install, measure};
use pocketsplat::bundle::{self, BundleInfo, Coder, QuantisationSteps, WriteError, WriteOptions, Written};
use pocketsplat::dataset::{Background, Capture, View};
use pocketsplat::device::{Fitted, Limits, fitted};
use pocketsplat::train::finish::Finished;
use pocketsplat_core::{Budget, Bundle};
use serde::{Deserialize, Serialize};

/// How a run's scene becomes a bundle; decides nothing of its training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Encoding {
    /// What gives the symbols their frequencies.
    pub(crate) coder: Coder,
    /// Pruning rates of the tiers, falling to 0.
    pub(crate) tiers: Vec<f32>,
    /// Steps of scenes without a context model.
    pub(crate) quantisation: QuantisationSteps,
    /// What the bundle has to fit into.
    #[serde(default, skip_serializing_if = "Limits::is_none")]
    pub(crate) limits: Limits,
}

/// Shares of the mean steps for devices, finest first.
const FOR_DEVICES: [f32; 4] = [0.5, 0.65, 0.8, 1.0];

impl Default for Encoding {
    fn default() -> Self {
        let WriteOptions { steps, coder, pruning_rates, .. } = WriteOptions::default();
        Self { quantisation: steps, coder, tiers: pruning_rates, limits: Limits::default() }
    }
}

impl Encoding {
    /// What can be refused before anything is trained.
    ///
    /// # Errors
    /// A step that is not positive; rates that do not fall to 0.
    pub(crate) fn validate(&self) -> Result<()> {
        let QuantisationSteps { feature, log_scale, offset } = self.quantisation;
        for (name, step) in [("feature", feature), ("log_scale", log_scale), ("offset", offset)] {
            if !(step.is_finite() && step > 0.0) {
                bail!("the quantisation step of `{name}` is {step}, needs a positive number");
            }
        }
        let falls = self.tiers.windows(2).all(|pair| pair[0] > pair[1]);
        let within = self.tiers.iter().all(|rate| (0.0..1.0).contains(rate));
        if !(falls && within && self.tiers.last() == Some(&0.0)) {
            bail!("the tiers' pruning rates are {:?}, need to fall from below 1 to 0, as 0.4,0.2,0", self.tiers);
        }
        Ok(())
    }

    /// Codes a finished scene in tiers, as much of it as fits, measures each over training views and an orbit, and writes that
    /// into the bundle.
    pub(crate) fn encode(
        &self,
        finished: Finished,
        capture: &Capture,
        background: Background,
        held_out: &[View],
    ) -> Result<Fitted> {
        // Photographs are not larger than frames may be: loading has seen to it.
        let [width_px, height_px] = largest_px(capture).map(|px| px as u16);
        let frame = Budget::for_frame(width_px, height_px);
        let write = |finished: &Finished| {
            let mut written = self.coded(finished, capture, background)?;
            let cameras: Vec<_> = capture.train.iter().map(|view| view.camera.clone()).collect();
            let measures = measure(&Bundle::parse(&written.bytes)?, &cameras_to_measure(&cameras), held_out)?;
            install(&mut written.bytes, &measures)?;
            Ok(written)
        };
        Ok(fitted(finished, &self.limits, &frame, write)?)
    }

    /// Codes a scene, for a device with the finest tables that its flash has room for.
    ///
    /// A device that decodes in every frame pays six times as much for the context as for tables. Finer steps make up for
    /// steps that do not follow the place.
    fn coded(&self, finished: &Finished, capture: &Capture, background: Background) -> Result<Written, WriteError> {
        let chooses = self.coder == Coder::Auto && finished.scene.context.is_some();
        if chooses && self.limits.frame_instructions.is_some() {
            for mean_step_share in FOR_DEVICES {
                let written = self.write(finished, Coder::Static, mean_step_share, capture, background)?;
                if self.limits.flash_bytes.is_none_or(|most| written.bytes.len() as u64 <= most) {
                    return Ok(written);
                }
            }
        }
        self.write(finished, self.coder, 1.0, capture, background)
    }

    fn write(
        &self,
        finished: &Finished,
        coder: Coder,
        mean_step_share: f32,
        capture: &Capture,
        background: Background,
    ) -> Result<Written, WriteError> {
        let info = BundleInfo {
            normalisation: capture.normalisation,
            background: background.rgb8(),
            training_px: largest_px(capture),
            // Any training view will do for a device that has no camera of its own; the first is as good as another.
            preview: capture.train[0].camera.clone(),
        };
        let options = WriteOptions {
            steps: self.quantisation,
            coder,
            mean_step_share,
            importance: Some(finished.importance.clone()),
            pruning_rates: self.tiers.clone(),
            ..WriteOptions::default()
        };
        bundle::write(&finished.scene, &info, &options)
    }
}

/// Size of the training view with the longest side: what `eval` reduces photographs to unless told otherwise.
pub(crate) fn largest_px(capture: &Capture) -> [u32; 2] {
    let sizes = capture.train.iter().map(|view| [view.camera.width_px, view.camera.height_px]);
    sizes.max_by_key(|size| size[0].max(size[1])).unwrap_or_default()
}
