//! Which offsets are drawn: a hard mask over trained logits, with the gradient of a soft one.

use crate::real::Real;
use crate::scene::MASK_THRESHOLD;

/// Whether an offset with this mask logit is drawn: the logit is above [`MASK_THRESHOLD`].
#[inline(always)]
pub fn is_open<R: Real>(logit: R) -> bool {
    logit > R::real(MASK_THRESHOLD)
}

/// σ'(logit) = σ·(1 − σ): the gradient that stands in for that of the hard mask (straight through; Chen et al. 2024, HAC).
#[inline(always)]
pub fn slope<R: Real>(logit: R) -> R {
    let open = logit.sigmoid();
    open * (R::ONE - open)
}

/// The mask term Σ σ(logit) of the loss, and its gradient.
///
/// * `weight`: of the sum in the loss. * `d_logits`: added to. * returns the weighted sum.
#[inline(always)]
pub fn term<R: Real>(logits: &[R], weight: R, d_logits: &mut [R]) -> R {
    let mut sum = R::ZERO;
    for (logit, d) in logits.iter().zip(d_logits) {
        let open = logit.sigmoid();
        sum += open;
        *d += weight * open * (R::ONE - open);
    }
    weight * sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::{assert_gradient, random};

    #[test]
    fn backward_agrees_with_finite_differences() {
        let logits: Vec<f64> = random(1, 40).iter().map(|v| 6.0 * v).collect();
        let mut d_logits = vec![0.0; 40];
        term(&logits, 0.3, &mut d_logits);
        for (logit, d) in logits.iter().zip(&d_logits) {
            assert!((0.3 * slope(*logit) - d).abs() < 1e-15);
        }
        assert_gradient("mask term", &logits, &d_logits, |x| term(x, 0.3, &mut [0.0; 40]));
    }
}
