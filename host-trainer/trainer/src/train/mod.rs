//! Training: one step, the optimiser, growth and pruning, the loop around them, and the folder that lets it go on after
//! an interruption.
//!
//! Folders in order, each importing only from those before it: [`schedule`], when what happens → [`density`], anchors come and go →
//! [`context`], what coding does to them → [`worth`], what they gain and cost → [`limits`], what fits → [`modules`], what may be
//! plugged in → [`config`], all settings of a run → [`run`], the run.

pub mod bench_scene;
pub mod config;
pub mod context;
pub mod density;
pub mod error;
pub mod exposures;
pub mod limits;
pub mod modules;
pub mod optimiser;
pub mod poses;
pub(crate) mod read_ahead;
pub mod run;
pub mod schedule;
pub(crate) mod streams;
#[cfg(test)]
pub(crate) mod test_capture;
pub mod views;
pub mod worth;

pub use config::TrainConfig;
pub use error::{DroppedStep, TrainError};
pub use run::{Observer, Outcome, Trainer};
