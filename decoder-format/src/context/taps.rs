//! The intra-anchor context: what the features before a feature say about it (Chen et al. 2025, HAC++, section 3.3; there by
//! small networks, here linear).

use crate::error::{DecodeError, Field, in_range};

/// Most taps.
pub const MAX_TAPS: u8 = 64;
/// Bits of the fraction of a tap's weight.
pub const TAP_BITS: u32 = 7;

/// Half a weight's unit, which rounds.
const HALF: i32 = 1 << (TAP_BITS - 1);

/// Weights before those of feature `feature`: feature c has min(c, `n_taps`), for the features just before it.
#[must_use]
pub const fn first_tap(feature: usize, n_taps: usize) -> usize {
    let short = if feature < n_taps { feature } else { n_taps };
    // 0 + 1 + … for the short rows, then `n_taps` each.
    let triangle = short.saturating_mul(short.saturating_sub(1)) >> 1;
    triangle.saturating_add(feature.saturating_sub(short).saturating_mul(n_taps))
}

/// The weights of a context's taps, i8 in units of 2⁻⁷.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Taps<'a> {
    weights: &'a [u8],
    n_taps: usize,
}

impl<'a> Taps<'a> {
    pub(super) fn new(weights: &'a [u8], n_taps: u8) -> Result<Self, DecodeError> {
        in_range(Field::ContextTaps, n_taps.into(), 0, MAX_TAPS.into())?;
        Ok(Self { weights, n_taps: n_taps.into() })
    }

    pub(super) fn n_taps(&self) -> usize {
        self.n_taps
    }

    /// `(Σ weights·residuals + 64) >> 7` over the features before: how far, in eighths of the step, they move the mean of
    /// `feature`.
    ///
    /// * `residuals`: of all features before.
    ///
    /// # Budget
    /// A multiply-add a tap, about 5 instructions each on a Cortex-M4.
    #[inline(always)]
    pub(super) fn shift(&self, feature: usize, residuals: &[i16]) -> i32 {
        let n = feature.min(self.n_taps);
        let weights = self.weights.get(first_tap(feature, self.n_taps)..).unwrap_or_default();
        let residuals = residuals.get(residuals.len().saturating_sub(n)..).unwrap_or_default();
        // At most 64·2⁷·2¹⁵.
        let sum = weights.iter().zip(residuals).fold(HALF, |sum, (&weight, &residual)| {
            sum.wrapping_add(i32::from(weight as i8).wrapping_mul(i32::from(residual)))
        });
        sum >> TAP_BITS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_follow_one_another() {
        for n_taps in 0..70 {
            let mut first = 0;
            for feature in 0..200 {
                assert_eq!(first_tap(feature, n_taps), first, "feature {feature} of {n_taps} taps");
                first += feature.min(n_taps);
            }
        }
    }

    #[test]
    fn a_tap_weighs_the_feature_that_far_before() {
        // Feature 1: one weight; 2, 3, 4: two each, the nearest feature last.
        let weights = [10, 20, 30, 40, 50, 60, (-128_i8) as u8];
        let taps = Taps::new(&weights, 2).expect("within the limit");
        let residuals = [128, -256, 384, 512];
        let shifts: std::vec::Vec<i32> = (0..5).map(|c| taps.shift(c, &residuals[..c])).collect();
        assert_eq!(shifts, [0, 10, 20 - 60, -2 * 40 + 3 * 50, 3 * 60 - 4 * 128]);
        assert_eq!(Taps::new(&[(-1_i8) as u8], 1).expect("within").shift(1, &[65]), -1, "-65/128, halves up");
        assert_eq!(Taps::new(&[(-1_i8) as u8], 1).expect("within").shift(1, &[64]), 0);
        assert!(Taps::new(&[], MAX_TAPS + 1).is_err());
    }
}
