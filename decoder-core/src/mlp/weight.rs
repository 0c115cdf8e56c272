//! A weight in memory, and what it adds to a sum: floats of several widths.

use bytemuck::{Pod, Zeroable};

use crate::math::{from_half, to_half};

/// A weight as it is kept.
pub(crate) trait Weight: Pod {
    /// Rounds a weight of the file, which is a half or a symbol times a step.
    fn keep(weight: f32) -> Self;

    /// `sum + self·x`, rounded as this format does.
    fn added(self, sum: f32, x: f32) -> f32;

    /// The weight by itself, as the bias that a sum begins with.
    fn value(self) -> f32;
}

impl Weight for f32 {
    #[inline(always)]
    fn keep(weight: f32) -> Self {
        weight
    }

    #[inline(always)]
    fn added(self, sum: f32, x: f32) -> f32 {
        sum + self * x
    }

    #[inline(always)]
    fn value(self) -> f32 {
        self
    }
}

/// A half, widened when it is used.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(transparent)]
pub(crate) struct Half(u16);

impl Weight for Half {
    #[inline(always)]
    fn keep(weight: f32) -> Self {
        Self(to_half(weight))
    }

    #[inline(always)]
    fn added(self, sum: f32, x: f32) -> f32 {
        sum + self.value() * x
    }

    #[inline(always)]
    fn value(self) -> f32 {
        from_half(self.0)
    }
}

/// A half whose products and sums are rounded to halves, as a processor with nothing wider would.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(transparent)]
pub(crate) struct StrictHalf(u16);

impl Weight for StrictHalf {
    #[inline(always)]
    fn keep(weight: f32) -> Self {
        Self(to_half(weight))
    }

    #[inline(always)]
    fn added(self, sum: f32, x: f32) -> f32 {
        rounded(sum + rounded(self.value() * rounded(x)))
    }

    #[inline(always)]
    fn value(self) -> f32 {
        from_half(self.0)
    }
}

fn rounded(x: f32) -> f32 {
    from_half(to_half(x))
}
