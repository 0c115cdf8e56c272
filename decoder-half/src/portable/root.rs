//! The square root.

/// The square root, rounded correctly; NaN of a number below 0.
///
/// # Budget
/// About 60 instructions without an FPU; 5 with that of a Cortex-M.
#[inline]
#[must_use]
pub fn sqrt(x: f32) -> f32 {
    libm::sqrtf(x)
}
