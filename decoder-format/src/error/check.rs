//! What many checks share.

use super::{DecodeError, Field};

/// Checks `least <= found <= most` and names the limit that does not hold.
///
/// # Errors
/// [`DecodeError::OutOfRange`].
pub fn in_range(field: Field, found: u32, least: u32, most: u32) -> Result<(), DecodeError> {
    if found < least {
        return Err(DecodeError::OutOfRange { field, found, limit: least });
    }
    if found > most {
        return Err(DecodeError::OutOfRange { field, found, limit: most });
    }
    Ok(())
}

/// A length for an error message; bundles are below 4 GiB, so nothing is lost in practice.
#[must_use]
pub fn saturate(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}
