//! What a device reports when it fails.

use std::error::Error;

/// Why a device did not finish a step; nothing of the scene has changed.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct DeviceFault(Box<dyn Error + Send + Sync>);

impl DeviceFault {
    /// From what the device says.
    pub fn new(fault: impl Error + Send + Sync + 'static) -> Self {
        Self(Box::new(fault))
    }
}
