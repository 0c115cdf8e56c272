//! When what happens in a run: learning rates, growth and pruning, the phases of coding, as numbers that a user may set.

mod config_error;
mod densification;
mod exposure;
mod hac;
mod half_size;
mod rates;

pub use config_error::ConfigError;
pub(crate) use config_error::within;
pub use densification::Densification;
pub use exposure::ExposureChoice;
pub use hac::{Backbone, Hac};
pub use half_size::HalfSize;
pub use rates::{LearningRate, Rates};
