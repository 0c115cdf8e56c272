//! The run itself: its iterations, its checkpoints, the folder that it works in.

mod anchor_changes;
pub mod checkpoint;
pub mod device_sync;
pub mod folder;
mod fork;
#[cfg(test)]
mod gpu_tests;
mod learned;
mod method;
mod observer;
mod residence;
mod save;
mod state;
mod step;
#[cfg(test)]
mod tests;
mod trainer;
pub mod watchdog;

pub use folder::{
    Ending, Interval, LoggedStep, ProgressLog, Resumed, RunError, RunFolder, fork, is_file_of_run, newest_preview,
    photographs_in, points_in,
};
pub use learned::Learned;
pub use method::{Method, Run};
pub use observer::{Observer, Outcome};
pub use save::{RestoreError, Restored};
pub use state::{Machine, RunState, Setup};
pub use trainer::{Neural, StepMachine, Trainer};
