//! Buffers that are kept from step to step.

use crate::real::Real;

/// Makes a buffer `len` zeros.
pub(super) fn refill<R: Real>(buffer: &mut Vec<R>, len: usize) {
    buffer.clear();
    buffer.resize(len, R::ZERO);
}
