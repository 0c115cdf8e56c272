//! A target for the sum of a view's opacities.

use serde::{Deserialize, Serialize};

use super::Real;

/// What the squared distance to the target is divided by; the paper's weight fits the first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Normalisation {
    /// (Σα − T)²/N.
    #[default]
    Count,
    /// (Σα − T)², as eq. 4 is printed: with 10⁵ Gaussians it drowns every other term.
    Literal,
    /// ((Σα − T)/N)².
    Mean,
}

/// The term `weight·(Σα − T)²`, divided as `normalisation` says, and its derivative by each α (the plug-and-play paper,
/// eq. 4).
///
/// * `sum`: Σα. * `n`: N, how many Gaussians could be drawn. * `target`: T.
pub fn forward_backward<R: Real>(sum: R, n: usize, target: R, weight: R, normalisation: Normalisation) -> (R, R) {
    let n = R::real(n.max(1) as f64);
    let divisor = match normalisation {
        Normalisation::Count => n,
        Normalisation::Literal => R::ONE,
        Normalisation::Mean => n * n,
    };
    let beyond = sum - target;
    (weight * beyond * beyond / divisor, R::real(2.0) * weight * beyond / divisor)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ops::finite_difference::{assert_gradient, random};

    #[test]
    fn backward_agrees_with_finite_differences() {
        let x: Vec<f64> = random(1, 9).iter().map(|v| v.abs()).collect();
        for normalisation in [Normalisation::Count, Normalisation::Literal, Normalisation::Mean] {
            let term = |x: &[f64]| forward_backward(x.iter().sum(), 12, 0.7, 0.4, normalisation);
            let d = vec![term(&x).1; x.len()];
            assert_gradient("opacity target", &x, &d, |x| term(x).0);
        }
    }

    #[test]
    fn the_mean_of_the_opacities_decides_whatever_their_number() {
        let (few, _) = forward_backward(30.0f64, 100, 0.1, 1e-5, Normalisation::Count);
        let (many, _) = forward_backward(30_000.0f64, 100_000, 100.0, 1e-5, Normalisation::Count);
        assert!((many / few / 1000.0 - 1.0).abs() < 1e-9, "it grows with N, not with N²");
    }
}
