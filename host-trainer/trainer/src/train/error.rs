//! Why a run cannot start or go on, and why a step changed nothing.

use std::error::Error;
use std::fmt;

use pocketsplat_capture::dataset::PhotographError;
use pocketsplat_format::DecodeError;

use super::schedule::ConfigError;
use pocketsplat_kernels::integer_model::IntegerModelError;
use pocketsplat_kernels::step::DeviceFault;

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
    LimitProbe(#[source] Box<dyn Error + Send + Sync>),
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

/// A step that was not applied.
#[derive(Clone, Debug, PartialEq)]
pub struct DroppedStep {
    /// Which iteration, from 1.
    pub iteration: u32,
    /// The view it was drawn for.
    pub view: String,
    /// Why.
    pub cause: Cause,
}

impl fmt::Display for DroppedStep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "iteration {} dropped: with view `{}`, {}", self.iteration, self.view, self.cause)
    }
}

/// The first array, in the order of computation, that holds a value no parameter may be moved by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cause {
    /// Which array.
    pub array: &'static str,
    /// Of which anchor, where it belongs to one.
    pub anchor: Option<usize>,
    /// The value.
    pub value: f32,
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.array)?;
        if let Some(anchor) = self.anchor {
            write!(f, " of anchor {anchor}")?;
        }
        write!(f, " became {}", self.value)
    }
}
