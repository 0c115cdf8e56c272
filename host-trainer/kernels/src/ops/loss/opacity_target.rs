//! A target for the sum of a view's opacities.

use crate::real::Real;

/// The term `weight·(Σα − T)²/N` and its derivative by each α (the plug-and-play paper, eq. 4).
///
/// The paper prints no divisor; without one the term grows with N² and drowns every other.
///
/// * `sum`: Σα. * `n`: N, how many Gaussians could be drawn. * `target`: T.
pub fn forward_backward<R: Real>(sum: R, n: usize, target: R, weight: R) -> (R, R) {
    let n = R::real(n.max(1) as f64);
    let beyond = sum - target;
    (weight * beyond * beyond / n, R::real(2.0) * weight * beyond / n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::{assert_gradient, random};

    #[test]
    fn backward_agrees_with_finite_differences() {
        let x: Vec<f64> = random(1, 9).iter().map(|v| v.abs()).collect();
        let term = |x: &[f64]| forward_backward(x.iter().sum(), 12, 0.7, 0.4);
        let d = vec![term(&x).1; x.len()];
        assert_gradient("opacity target", &x, &d, |x| term(x).0);
    }

    #[test]
    fn the_mean_of_the_opacities_decides_whatever_their_number() {
        let (few, _) = forward_backward(30.0f64, 100, 0.1, 1e-5);
        let (many, _) = forward_backward(30_000.0f64, 100_000, 100.0, 1e-5);
        assert!((many / few / 1000.0 - 1.0).abs() < 1e-9, "it grows with N, not with N²");
    }
}
