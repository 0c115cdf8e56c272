//! What a run consists of: what is set up once, what changes with every iteration, what computes it.

use pocketsplat_capture::dataset::Capture;
use serde::{Deserialize, Serialize};

use super::checkpoint::CaptureSignature;
use super::watchdog::Watchdog;
use crate::train::limits::LimitProbe;
use crate::train::read_ahead::ReadAhead;
use crate::train::views::TrainingViews;

/// What a run was asked for. Nothing of it changes while it goes on but the cameras of `views`, which follow from the state where poses are
/// refined.
#[derive(Clone, Debug)]
pub struct Setup<'a, C> {
    /// The configuration, resolved for the capture.
    pub config: C,
    /// What it trains on.
    pub capture: &'a Capture,
    /// What the capture looks like.
    pub signature: CaptureSignature,
    /// The capture's training views.
    pub views: TrainingViews<'a>,
    /// The limits that the bundle has to keep, if any.
    pub limits: Option<LimitProbe<'a>>,
}

/// Everything that the next iteration depends on; a checkpoint holds it in this order.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RunState<L> {
    /// Iterations done.
    pub iteration: u32,
    /// Steps that were not applied.
    pub watchdog: Watchdog,
    /// Wall-clock seconds spent in iterations.
    pub seconds: f64,
    /// Seconds of processor time spent in iterations, of all threads: what does not depend on what else the machine does.
    pub processor_seconds: f64,
    /// Views left of the current pass over the capture, taken from the end.
    pub queue: Vec<u32>,
    /// The scene and what belongs to it.
    pub learned: L,
}

/// What iterations are computed with.
#[derive(Clone, Debug)]
pub struct Machine<D> {
    /// What computes steps.
    pub device: D,
    /// Photographs that are read meanwhile.
    pub(crate) photographs: ReadAhead,
}
