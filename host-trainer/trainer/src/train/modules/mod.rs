//! Modules: improvements that plug into the training of any backbone.
//!
//! A module is a struct of settings in a file of this folder and a line in [`modules!`](Modules). Attached by `--modules`,
//! or as an effect by `--effects`, it may
//!
//! * widen the model: [`Module::shape`] switches on heads of [`ModelShape`], which the optimiser moves, checkpoints keep, bundles
//!   store and decoders evaluate as they do the others;
//! * add to the loss of every step, on the image, on the Gaussians or on the anchors: [`Terms`];
//! * drop or rank anchors between two iterations: [`Module::event`];
//! * leave anchors out of a step: [`Module::pruned_share`].
//!
//! It sees blocks of visible anchors and a [`StepInfo`], never a backbone.
//!
//! # Another module
//!
//! One that keeps offsets short, as `modules/short.rs`:
//!
//! ```
//! use pocketsplat_kernels::real::Real;
//! use pocketsplat_kernels::scene::Scene;
//! use pocketsplat_trainer::train::modules::Module;
//! use pocketsplat_kernels::step::{Block, StepInfo, Terms};
//! use serde::{Deserialize, Serialize};
//!
//! #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
//! #[serde(default)]
//! pub struct Short {
//!     /// Weight of the mean squared offset.
//!     pub weight: f64,
//! }
//!
//! impl Default for Short {
//!     fn default() -> Self {
//!         Self { weight: 1e-4 }
//!     }
//! }
//!
//! impl<R: Real> Terms<R> for Short {
//!     fn on_anchors(&self, _at: &StepInfo, scene: &Scene<R>, blocks: &mut [Block<R>]) -> R {
//!         let n = blocks.iter().map(|b| b.d_offsets.len()).sum::<usize>().max(1);
//!         let share = R::real(self.weight / n as f64);
//!         let width = 3 * scene.shape.n_offsets;
//!         let mut sum = R::ZERO;
//!         for block in blocks {
//!             for (anchor, d) in block.anchors.iter().zip(block.d_offsets.chunks_exact_mut(width)) {
//!                 let offsets = &scene.anchors.offsets[*anchor as usize * width..][..width];
//!                 for (d, x) in d.iter_mut().zip(offsets) {
//!                     sum += *x * *x;
//!                     *d += R::real(2.0) * share * *x;
//!                 }
//!             }
//!         }
//!         share * sum
//!     }
//! }
//!
//! impl Module for Short {}
//! ```
//!
//! and `short: Short,` among the modules below. It then has a place in configurations, `[train.modules.short]`, and its gradient is
//! checked as the others' are, by a line in the tests of [`pocketsplat_kernels::step`].

pub mod detail;
pub mod distribution;
pub mod pruning;
pub mod rdo;
#[cfg(test)]
mod tests;

use std::fmt::Debug;

use serde::{Deserialize, Serialize};

use super::density::Visibility;
use super::error::TrainError;
use super::limits::{Finished, Fit, LimitProbe, LimitShares};
use super::schedule::ConfigError;
use super::worth::{Probe, Worth};
use pocketsplat_kernels::real::Real;
use pocketsplat_kernels::scene::{ModelShape, Scene};
use pocketsplat_kernels::step::{StepInfo, Terms, Workspace};

pub use detail::Detail;
pub use distribution::Distribution;
pub use pruning::Pruning;
pub use rdo::Rdo;

/// What a module may look at between two iterations.
#[derive(Clone, Copy, Debug)]
pub struct RunView<'a> {
    pub(super) probe: Probe<'a>,
    pub(super) limits: Option<LimitProbe<'a>>,
}

impl RunView<'_> {
    /// The scene as it stands.
    pub fn scene(&self) -> &Scene<f32> {
        self.probe.scene
    }

    /// The run's seed.
    pub fn seed(&self) -> u64 {
        self.probe.seed
    }

    /// What the views that training sees show of the scene; see [`Visibility::new`].
    pub fn visibility(&self, contributions: bool) -> Visibility {
        let Probe { scene, views, .. } = self.probe;
        Visibility::new(scene, &mut Workspace::new(&scene.shape), &views.trained_cameras(), contributions)
    }

    /// What the images would lose with each offset and anchor, and what these cost; see [`Worth`].
    ///
    /// # Errors
    /// [`TrainError::NoContext`] before there is a context model that says what values cost.
    pub fn worth(&self) -> Result<Worth, TrainError> {
        self.probe.worth()
    }

    /// Weight of a value's bits in the loss.
    pub fn lambda(&self) -> f64 {
        self.probe.lambda
    }

    /// Whether the bundle has limits to keep.
    pub fn is_limited(&self) -> bool {
        self.limits.is_some()
    }

    /// Whether one of them is its length.
    pub fn limits_bytes(&self) -> bool {
        self.limits.is_some_and(|limits| limits.limits_bytes)
    }

    /// What the bundle takes of its limits without these offsets, counted through all anchors'; nothing where it has none.
    ///
    /// Cost: a forward pass over the views, and a coding.
    ///
    /// # Errors
    /// [`TrainError::LimitProbe`] for a scene that has no bundle.
    pub fn shares_without(&self, offsets: &[usize]) -> Result<LimitShares, TrainError> {
        let Some(limits) = self.limits else { return Ok(LimitShares::default()) };
        let Probe { scene, views, background, .. } = self.probe;
        let mut scene = scene.clone();
        scene.anchors.mask(offsets);
        limits.shares(&Finished::of(scene, &views.trained_cameras(), background)?)
    }
}

/// What a module does to the anchors of a run.
#[derive(Clone, Debug, PartialEq)]
pub enum AnchorChange {
    /// `[n]` drops the anchors that are not marked.
    Keep(Vec<bool>),
    /// Switches these offsets off, counted through all anchors', and drops the anchors that have none left.
    Mask(Vec<usize>),
    /// `[n]` gives every anchor its [rank](pocketsplat_kernels::scene::Anchors::prune_rank).
    Rank(Vec<f32>),
    /// Switches offsets off as [`Self::Mask`] does, and weighs bits anew, so that the bundle fits.
    Fit {
        /// The offsets.
        masked: Vec<usize>,
        /// What is left.
        found: Fit,
    },
}

/// A plug-in of the training; everything has a default that does nothing.
pub trait Module: Terms<f32> + Terms<f64> + Debug {
    /// Refuses settings that no run can use.
    ///
    /// # Errors
    /// Setting, value and accepted range.
    fn check(&self) -> Result<(), ConfigError> {
        Ok(())
    }

    /// The shape of the model that it works on.
    fn shape(&self, shape: ModelShape) -> ModelShape {
        shape
    }

    /// Whether [`Self::event`] has something to do after this iteration: a scene that stands on a device is fetched for it.
    fn is_due(&self, _at: &StepInfo) -> bool {
        true
    }

    /// What becomes of the anchors after an iteration, when its time has come.
    ///
    /// # Errors
    /// What keeps it from finding out.
    fn event(&self, _at: &StepInfo, _run: &RunView<'_>) -> Result<Option<AnchorChange>, TrainError> {
        Ok(None)
    }

    /// Key and value of the share of the run at which it first weighs error against bits, if it ever does.
    fn weighs_bits_at(&self) -> Option<(&'static str, f64)> {
        None
    }

    /// Whether the masks of offsets are learned beside it.
    fn learns_masks(&self) -> bool {
        true
    }

    /// Share of the anchors that the step leaves out, those of the lowest [places](pocketsplat_kernels::scene::Anchors::prune_rank) first.
    fn pruned_share(&self, _at: &StepInfo) -> f32 {
        0.0
    }
}

macro_rules! modules {
    ($($(#[$doc:meta])* $name:ident: $module:ident,)*) => {
        /// The modules of a run; each is attached where it has settings.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
        pub struct Modules {
            $($(#[$doc])* #[serde(default, skip_serializing_if = "Option::is_none")] pub $name: Option<$module>,)*
        }

        impl Modules {
            /// The attached.
            pub fn each(&self) -> Vec<&dyn Module> {
                let mut all: Vec<&dyn Module> = Vec::new();
                $(all.extend(self.$name.as_ref().map(|module| module as &dyn Module));)*
                all
            }

            /// The terms of the attached.
            pub fn terms<R: Real>(&self) -> Vec<&dyn Terms<R>> {
                let mut all: Vec<&dyn Terms<R>> = Vec::new();
                $(all.extend(self.$name.as_ref().map(|module| module as &dyn Terms<R>));)*
                all
            }
        }
    };
}

modules! {
    /// Features near a normal distribution.
    distribution: Distribution,
    /// Fewer anchors and offsets, by what they are worth a bit.
    rdo: Rdo,
    /// Fewer anchors, or an order in which to leave them out; after `rdo`, so that it ranks those that stay.
    pruning: Pruning,
    /// A residual on the colours.
    detail: Detail,
}

impl Modules {
    /// Whether masks of offsets are learned with the attached modules.
    pub fn learns_masks(&self) -> bool {
        self.each().into_iter().all(|module| module.learns_masks())
    }

    /// Whether one of the attached weighs error against bits.
    pub fn weigh_bits(&self) -> bool {
        self.each().into_iter().any(|module| module.weighs_bits_at().is_some())
    }

    /// The shape that the attached modules work on.
    pub fn shape(&self, shape: ModelShape) -> ModelShape {
        self.each().into_iter().fold(shape, |shape, module| module.shape(shape))
    }
}
