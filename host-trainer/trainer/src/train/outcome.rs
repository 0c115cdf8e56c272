//! What a run gives back: to whom it reports, what an iteration did, why it stopped.

use std::error::Error;

use pocketsplat_capture::dataset::PhotographError;
use pocketsplat_format::DecodeError;

use super::config_error::ConfigError;
use super::steering::Fit;
use super::watchdog::DroppedStep;
use pocketsplat_kernels::integer_model::IntegerModelError;
use pocketsplat_kernels::scene::Scene;
use pocketsplat_kernels::step::{DeviceFault, StepReport};

/// Hears of every step of a run.
pub trait Observer {
    /// After iteration `iteration` (from 1).
    fn step(&mut self, iteration: u32, report: &StepReport<f32>, scene: &Scene<f32>);

    /// When an iteration changed nothing, because of what `step` says; [`Self::step`] follows.
    fn dropped(&mut self, _step: &DroppedStep) {}

    /// When anchors were left out so that the bundle fits.
    fn fitted(&mut self, _fit: &Fit) {}

    /// When a picture for people could not be written; the run goes on.
    fn unwritten(&mut self, _why: &dyn std::error::Error) {}
}

/// What an iteration gives back.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Loss and sizes of the step.
    pub report: StepReport<f32>,
    /// Why it was not applied, if so: parameters, moments and statistics are as before, but for what events of modules and the end
    /// of growth do.
    pub dropped: Option<DroppedStep>,
    /// What was left so that the bundle fits, where this iteration ended with that.
    pub fit: Option<Fit>,
}

/// Why a run cannot start, or go on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TrainError {
    /// A setting is out of range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// No view to train on.
    #[error("the capture has no training view; check that its training split names images that exist")]
    NoViews,
    /// No point to start from.
    #[error("the capture has no point to start from; check its bounds")]
    NoPoints,
    /// A photograph that does not lie in memory could not be read.
    #[error(transparent)]
    Photograph(#[from] PhotographError),
    /// The scene has no context model.
    #[error("the scene has no context model; train it with `train.backbone` hac")]
    NoContext,
    /// The context model has no integer form.
    #[error("the context model cannot be written in integers; start anew with lower `train.rates` in a --config")]
    IntegerModel(#[from] IntegerModelError),
    /// The integer form of the context model is not one that a decoder reads.
    #[error("the integers of the context model cannot be read back; start anew with lower `train.rates` in a --config")]
    IntegersUnread(#[from] DecodeError),
    /// There is no bundle whose length and memory could be measured.
    #[error("the scene as it stands has no bundle to measure; please report it")]
    Gauge(#[source] Box<dyn Error + Send + Sync>),
    /// A GPU failed.
    #[error(transparent)]
    Device(#[from] DeviceFault),
    /// Another run was brought to the same device, over what was newer there of this one.
    #[error(
        "the GPU holds the scene of another run, and the newest steps of this one are gone; go on from its checkpoint with --resume, \
         one run on a GPU at a time"
    )]
    SceneReplaced,
    /// The cause of dropped steps does not pass.
    #[error(
        "{n} steps in a row would have made parameters infinite or NaN and were dropped, the last one so: {last}; \
         look at the photograph of that view, or start a new run with lower `train.rates` in a --config"
    )]
    Diverged {
        /// Steps dropped in a row.
        n: u32,
        /// The last one.
        last: DroppedStep,
    },
}
