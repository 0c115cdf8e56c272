//! Writes and measures the bundle of a finished run.

use std::path::{Path, PathBuf};

use anyhow::Result;
use pocketsplat_capture::dataset::{Capture, Split, View};
use pocketsplat_files::{Output, shell_word};
use pocketsplat_format::bundle::crc32;
use pocketsplat_instructions::level::Profile;
use pocketsplat_trainer::effects::Effect;
use pocketsplat_trainer::encode::{Encoding, Fitted};
use pocketsplat_trainer::train::Trainer;
use pocketsplat_trainer::train::limits::Finished;
use serde::{Deserialize, Serialize};

use super::limits;
use crate::command::bundle::BundleFile;
use crate::command::capture::background_name;
use crate::command::eval::{Evaluation, Measurements, Renderer, ViewEvaluation, measure};
use crate::command::process::peak_memory_bytes;
use crate::config::{CaptureOptions, Protocol};
use crate::program;
use crate::say::say;

/// Test views that tiers are measured with at most, evenly picked: more would cost time and say little.
const MOST_JUDGES: usize = 12;

/// What a finished run reports.
#[derive(Debug, Serialize)]
pub(crate) struct TrainResult {
    /// What trained and measured it.
    pub(crate) program: &'static str,
    pub(crate) bundle: PathBuf,
    pub(crate) bundle_bytes: usize,
    /// Its checksum: what is measured later is of this file and no other.
    pub(crate) bundle_crc: u32,
    /// What a decoder needs: `Device` or `Full`.
    pub(crate) profile: String,
    /// Least level that the whole scene keeps; 0 for none.
    pub(crate) level: u8,
    /// Scratch memory in which a device with limited memory draws the whole scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) scratch_bytes: Option<usize>,
    /// Predicted for the slowest frame of some training views, where there is a processor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) instructions: Option<u64>,
    pub(crate) n_anchors: usize,
    /// Of these, with a drawn offset; the others are not coded.
    pub(crate) n_valid_anchors: usize,
    pub(crate) drawn_offsets: usize,
    pub(crate) undrawn_offsets: usize,
    /// What coded the symbols: `context` or `static`.
    pub(crate) coder: &'static str,
    /// Bytes of features, log-scales and offsets under the float context model.
    pub(crate) estimated_bytes: Option<[f64; 3]>,
    pub(crate) bytes_per_anchor: f64,
    pub(crate) iterations: u32,
    pub(crate) dropped_steps: u32,
    pub(crate) train_s: f64,
    /// Processor time of all threads.
    pub(crate) train_processor_s: f64,
    pub(crate) iterations_per_s: f64,
    /// Of the steps' time, the share that was spent on waiting for photographs, where they do not lie in memory.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) photographs_waited_share: Option<f64>,
    pub(crate) background: String,
    pub(crate) effects: String,
    /// Of each training photograph, where they turned out to differ.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) exposures: Option<Vec<ViewExposure>>,
    /// Of each training camera, where poses were refined.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) poses: Option<Vec<PoseChange>>,
    /// Largest amount of memory that the program has held, where the system tells.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) peak_memory_bytes: Option<u64>,
    /// Of the bundle, over the views that are held out for testing, where there are any: as `eval` measures it.
    #[serde(flatten)]
    pub(crate) held_out: Option<HeldOut>,
    /// How the photographs were prepared, and the fingerprint of the capture.
    pub(crate) protocol: Protocol,
}

/// How a training photograph was exposed, against the mean of all.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct ViewExposure {
    pub(crate) view: String,
    /// Of red, green and blue light.
    pub(crate) stops: [f64; 3],
}

/// How far a training camera was moved from where the capture has it.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct PoseChange {
    pub(crate) view: String,
    pub(crate) turned_degrees: f64,
    /// Units of the capture.
    pub(crate) moved: f64,
}

/// How good a bundle is on views that training did not see.
#[derive(Debug, Serialize)]
pub(crate) struct HeldOut {
    pub(crate) psnr_db: f64,
    /// With the colours of each frame brought to its photograph's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) cc_psnr_db: Option<f64>,
    pub(crate) ssim: f64,
    pub(crate) n_test_views: usize,
    pub(crate) views: Vec<ViewEvaluation>,
}

/// The views that tiers are measured with: those held out of training for it, else some of the test views.
fn judges(trainer: &Trainer<'_>, capture: &Capture) -> Vec<View> {
    let held_out: Vec<View> = trainer.validation_views().cloned().collect();
    if !held_out.is_empty() {
        return held_out;
    }
    let n = capture.test.len().min(MOST_JUDGES);
    (0..n).map(|i| capture.test[i * capture.test.len() / n].clone()).collect()
}

/// Writes the bundle of a finished run, and measures it on the test views.
pub(super) fn write_bundle(
    trainer: &Trainer<'_>,
    capture: &Capture,
    options: &CaptureOptions,
    encoding: &Encoding,
    output: &Output,
) -> Result<TrainResult> {
    let protocol = Protocol::of(capture, options);
    if let Some(images) = protocol.omitted_images()? {
        say!(
            "warning: the name of the folder of images is too long for the bundle; give --images {} to eval and render",
            shell_word(Path::new(images))
        );
    }
    let finished = Finished { protocol: Some(protocol.to_text()?), ..trainer.finish()? };
    let held_out = judges(trainer, capture);
    let refined = trainer.refined_capture();
    let fitted = encoding.encode(finished, refined.as_ref().unwrap_or(capture), &held_out)?;
    output.write(&fitted.written.bytes)?;
    let file = BundleFile { path: output.path().to_owned(), bytes: fitted.written.bytes.clone() };
    limits::say(&file, &encoding.limits, &fitted)?;
    let Fitted { finished, plan, instructions, .. } = fitted;
    let held_out = if capture.test.is_empty() {
        None
    } else {
        let what = Measurements::default();
        let Evaluation { psnr_db, cc_psnr_db, ssim, n_views, views, .. } =
            measure(&file, capture, options, Split::Test, Renderer::Core, &what)?;
        Some(HeldOut { psnr_db, cc_psnr_db, ssim, n_test_views: n_views, views })
    };
    let Finished { scene, background, n_undrawn, estimated_bits, .. } = finished;
    let bundle = file.parse()?;
    let of_whole = bundle.n_tiers().checked_sub(1).and_then(|tier| bundle.measures(tier));
    let n_anchors = scene.anchors.len();
    Ok(TrainResult {
        program: program::this(),
        bundle: output.path().to_owned(),
        bundle_bytes: file.bytes.len(),
        bundle_crc: crc32(&file.bytes),
        profile: Profile::of(&bundle.header().features).to_string(),
        level: of_whole.map_or(0, |measures| measures.level),
        scratch_bytes: plan.map(|plan| plan.least_len()),
        instructions,
        n_anchors,
        n_valid_anchors: (0..n_anchors).filter(|a| scene.anchors.has_drawn(*a)).count(),
        drawn_offsets: (0..scene.anchors.mask_logits.len()).filter(|offset| scene.anchors.is_drawn(*offset)).count(),
        undrawn_offsets: n_undrawn,
        coder: if bundle.context().is_some() { "context" } else { "static" },
        estimated_bytes: estimated_bits.map(|bits| bits.map(|bits| bits / 8.0)),
        bytes_per_anchor: file.bytes.len() as f64 / n_anchors as f64,
        iterations: trainer.iteration(),
        dropped_steps: trainer.n_dropped(),
        train_s: trainer.seconds(),
        train_processor_s: trainer.processor_seconds(),
        iterations_per_s: f64::from(trainer.iteration()) / trainer.seconds(),
        photographs_waited_share: trainer.waited_share(),
        background: background_name(background),
        effects: Effect::names(&Effect::all_in(trainer.config())),
        exposures: trainer.exposure_stops().map(|stops| {
            let of_view = |(view, stops): (&View, [f64; 3])| ViewExposure { view: view.name.clone(), stops };
            capture.train.iter().zip(stops).map(of_view).collect()
        }),
        poses: trainer.pose_changes().map(|changes| {
            let of_view = |(view, [turned_degrees, moved]): &(&View, [f64; 2])| PoseChange {
                view: view.name.clone(),
                turned_degrees: *turned_degrees,
                moved: moved / capture.normalisation.scale,
            };
            changes.iter().map(of_view).collect()
        }),
        peak_memory_bytes: peak_memory_bytes(),
        held_out,
        protocol,
    })
}
