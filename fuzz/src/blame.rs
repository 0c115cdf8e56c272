//! Whose mistake an error is.

use pocketsplat_format::{DecodeError, ErrorClass};

/// Nothing in a file makes the decoder blame itself.
pub(super) fn check_blame(error: &DecodeError) {
    assert_ne!(error.class(), ErrorClass::Internal, "{error}");
}
