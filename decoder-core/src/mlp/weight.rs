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

#[cfg(test)]
mod tests {
    use half::f16;

    use super::{Half, Weight};

    #[test]
    fn sums_are_those_of_the_format() {
        let mut state = 3_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 8_388_608.0 - 1.0
        };
        for _ in 0..10_000 {
            let [sum, weight, x] = [10.0 * random(), random(), 3.0 * random()];
            let weight_half = f16::from_f32(weight);
            assert_eq!(Half::keep(weight).added(sum, x), sum + weight_half.to_f32() * x, "products and sums of floats");
        }
    }
}
