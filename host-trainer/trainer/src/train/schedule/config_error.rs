//! Errors of a configuration, and the check of a range.

use std::borrow::Cow;

/// A setting that no run can use, by its key in a configuration.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// A number is too small, too large or NaN.
    #[error("{key} is {found}, needs {low} to {high}")]
    OutOfRange {
        /// The key.
        key: Cow<'static, str>,
        /// Its value.
        found: f64,
        /// The least that is accepted.
        low: f64,
        /// The most that is accepted.
        high: f64,
    },
    /// The points span more voxels than the lattice of a bundle has.
    #[error(
        "train.voxel_size is {found:e}, needs at least {needed:e}: the capture's points span more voxels than the lattice of a \
         bundle has; set a larger --voxel-size"
    )]
    VoxelTooSmall {
        /// The edge, normalised units.
        found: f64,
        /// The least for this capture.
        needed: f64,
    },
    /// Every training view would be held out.
    #[error("train.validation_every is 1, needs 0 (none) or at least 2: some views have to be trained on")]
    NoViewLeft,
    /// A detail head that is not the detail module's.
    #[error(
        "train.shape.detail_hidden is {found}, needs {needed}, which train.modules.detail asks for: attach the module with \
         --effects +detail, or set train.modules.detail.hidden"
    )]
    DetailHidden {
        /// Units of the shape.
        found: usize,
        /// Those of the module, 0 without it.
        needed: usize,
    },
    /// A run so short that its context model begins after a module weighs bits.
    #[error(
        "train.iterations is {found}, needs at least {needed}: in a shorter run the context model begins after {key}"
    )]
    TooShort {
        /// Iterations of the run.
        found: u32,
        /// The least that will do.
        needed: u32,
        /// The key that asks for it.
        key: &'static str,
    },
    /// A module that weighs bits, in a run where they cost nothing.
    #[error(
        "{key} weighs error against bits, and train.hac.lambda is 0, so that bits cost nothing; needs a lambda above 0, \
         or --modules none"
    )]
    NoPrice {
        /// The key that asks for it.
        key: &'static str,
    },
    /// A module that weighs bits, in a run that has none.
    #[error("{key} weighs error against bits, needs a train.backbone with a rate: hac, hac-plus or contextgs")]
    NoRate {
        /// The key that asks for it.
        key: &'static str,
    },
}

/// Refuses a value outside its range; NaN is outside of all.
pub(crate) fn within(key: impl Into<Cow<'static, str>>, found: f64, low: f64, high: f64) -> Result<(), ConfigError> {
    if found >= low && found <= high {
        Ok(())
    } else {
        Err(ConfigError::OutOfRange { key: key.into(), found, low, high })
    }
}
