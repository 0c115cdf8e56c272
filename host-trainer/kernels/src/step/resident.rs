//! A scene that stays in a device's memory from step to step, with all that training moves.

use std::fmt;

use super::coding::Coding;
use super::fault::DeviceFault;
use super::image::ImageStages;
use super::{Loss, StepReport, TargetView};
use crate::ops::adam::{Moments, Step};
use crate::scene::{ContextNetwork, Heads, Scene};

/// What training keeps for the anchors and heads of a scene: what goes to a device.
#[derive(Clone, Copy, Debug)]
pub struct Trained<'a, R> {
    /// The parameters.
    pub scene: &'a Scene<R>,
    /// Of features, log-scales, offsets and mask logits.
    pub moments: [&'a Moments<R>; 4],
    /// First and second moments of the heads.
    pub heads: &'a [Heads<R>; 2],
    /// Of the context model, where there is one.
    pub context: Option<ContextMoments<'a, R>>,
    /// `[n]` sums of opacities, and `[n, K]` sums of gradients on the screen; see `train::density::statistics`.
    pub sums: [&'a [R]; 2],
    /// `[n]` views that saw an anchor, and `[n, K]` those that drew an offset.
    pub counts: [&'a [u32]; 2],
}

/// Moments of a context model.
#[derive(Clone, Copy, Debug)]
pub struct ContextMoments<'a, R> {
    /// Of the grid's rows.
    pub rows: &'a Moments<R>,
    /// First and second moments of the networks.
    pub networks: [&'a [ContextNetwork<R>]; 2],
}

/// The same, to be overwritten.
#[derive(Debug)]
pub struct ContextMomentsMut<'a, R> {
    /// See [`ContextMoments::rows`].
    pub rows: &'a mut Moments<R>,
    /// See [`ContextMoments::networks`].
    pub networks: [&'a mut [ContextNetwork<R>]; 2],
}

/// [`Trained`], to be overwritten with what comes back; lattice and shape stay.
#[derive(Debug)]
pub struct TrainedMut<'a, R> {
    /// See [`Trained::scene`].
    pub scene: &'a mut Scene<R>,
    /// See [`Trained::moments`].
    pub moments: [&'a mut Moments<R>; 4],
    /// See [`Trained::heads`].
    pub heads: &'a mut [Heads<R>; 2],
    /// See [`Trained::context`].
    pub context: Option<ContextMomentsMut<'a, R>>,
    /// See [`Trained::sums`].
    pub sums: [&'a mut Vec<R>; 2],
    /// See [`Trained::counts`].
    pub counts: [&'a mut Vec<u32>; 2],
}

/// How far Adam moves each group; `None` where a group stays.
#[derive(Clone, Debug)]
pub struct GroupSteps<R> {
    /// Features, log-scales, offsets, mask logits.
    pub anchors: [Option<Step<R>>; 4],
    /// The heads in file order.
    pub heads: Vec<Step<R>>,
    /// Networks and grid of the context model, where the last step asked it.
    pub context: Option<[Step<R>; 2]>,
}

/// What a step on a device gives back, besides the gradients, which stay there.
#[derive(Clone, Copy, Debug)]
pub struct ResidentStep<R> {
    /// As on the CPU.
    pub report: StepReport<R>,
    /// dL/d(background).
    pub d_background: [R; 3],
    /// Whether every gradient of a parameter is at most the limit that was asked for.
    pub is_sound: bool,
}

/// What else than this CPU computes.
pub trait StepDevice<R>: fmt::Debug + Send {
    /// Its name, in words.
    fn name(&self) -> String;

    /// The stages between splats and the loss, of splats that come from the CPU.
    fn images(&mut self) -> &mut dyn ImageStages<R>;

    /// The whole step, of a scene that stays there.
    fn resident(&mut self) -> &mut dyn Resident<R>;

    /// Drops the photographs that it keeps by their numbers: those of another capture may come.
    fn forget_photographs(&mut self);
}

/// Which scene a device holds: the number of [`Resident::load`]s, that one included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoadNumber(pub u64);

/// A device that holds one scene. Each function works on what [`Self::load`] brought last.
pub trait Resident<R> {
    /// The load that it works on; of two runs on one device the other's may have come after one's own.
    fn held(&self) -> Option<LoadNumber>;

    /// Whether a step with these terms can be computed there.
    fn can_step(&self, scene: &Scene<R>, loss: &Loss<'_, R>, coding: &Coding<'_, R>) -> bool;

    /// Whether steps report the seconds of their stages. They wait after each stage then, which makes the step longer.
    fn time_stages(&mut self, yes: bool);

    /// Takes everything over.
    ///
    /// # Errors
    /// [`DeviceFault`], as all of these.
    fn load(&mut self, trained: &Trained<'_, R>) -> Result<(), DeviceFault>;

    /// Loss and gradients of one view, as [`Workspace::step`](super::Workspace::step).
    ///
    /// * `limit`: the largest magnitude of a sound gradient.
    ///
    /// # Errors
    /// [`DeviceFault`].
    fn step(
        &mut self,
        target: &TargetView<'_, R>,
        loss: &Loss<'_, R>,
        coding: &Coding<'_, R>,
        limit: R,
    ) -> Result<ResidentStep<R>, DeviceFault>;

    /// Moves all parameters by the gradients of the last step.
    ///
    /// # Errors
    /// [`DeviceFault`].
    fn move_by(&mut self, steps: &GroupSteps<R>) -> Result<(), DeviceFault>;

    /// Adds the last step to the statistics of growth and pruning.
    ///
    /// # Errors
    /// [`DeviceFault`].
    fn add_statistics(&mut self) -> Result<(), DeviceFault>;

    /// Copies everything back.
    ///
    /// # Errors
    /// [`DeviceFault`].
    fn store(&self, trained: TrainedMut<'_, R>) -> Result<(), DeviceFault>;
}
