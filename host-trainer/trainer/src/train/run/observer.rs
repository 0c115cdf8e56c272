//! What a run gives back: to whom it reports, and what an iteration did.

use crate::train::error::DroppedStep;
use crate::train::exposures::ExposureDecision;
use crate::train::limits::Fit;
use pocketsplat_kernels::scene::Scene;
use pocketsplat_kernels::step::StepReport;

/// Hears of every step of a run.
pub trait Observer {
    /// After iteration `iteration` (from 1).
    fn step(&mut self, iteration: u32, report: &StepReport<f32>, scene: &Scene<f32>);

    /// When an iteration changed nothing, because of what `step` says; [`Self::step`] follows.
    fn dropped(&mut self, _step: &DroppedStep) {}

    /// When anchors were left out so that the bundle fits.
    fn fitted(&mut self, _fit: &Fit) {}

    /// When it was decided whether each photograph has an exposure of its own.
    fn exposed(&mut self, _decided: &ExposureDecision) {}

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
    /// What was decided about exposures, where this iteration ended with that.
    pub decided: Option<ExposureDecision>,
}
