//! Activations of the heads.

use super::exp;

/// Below this magnitude [`tanh`] is a polynomial, because 1 − 2/(e²ˣ + 1) loses its digits there.
const TANH_SMALL: f32 = 0.5;

/// `(tanh x / x − 1)/x²` in powers of x² for |x| ≤ [`TANH_SMALL`]; the relative error of tanh is below 6e-8 there.
const TANH_TAIL: [f32; 4] = [-0.333_333_1, 0.133_304_76, -0.053_387_11, 0.017_988_745];

/// Returns 1/(1 + e⁻ˣ) with a relative error below 4e-7 for x ≥ −87.
///
/// # Budget
/// One [`exp()`] and one division.
///
/// ```
/// assert_eq!(pocketsplat_format::math::sigmoid(0.0), 0.5);
/// ```
#[inline(always)]
pub fn sigmoid(x: f32) -> f32 {
    1.0 / (1.0 + exp(-x))
}

/// Returns the hyperbolic tangent of x with a relative error below 4e-7; its sign is the sign of x.
///
/// # Budget
/// One [`exp()`], one division and a polynomial; both branches are evaluated and one is selected.
///
/// ```
/// assert_eq!(pocketsplat_format::math::tanh(0.0), 0.0);
/// assert!((pocketsplat_format::math::tanh(0.5) - 0.46211716).abs() < 2e-7);
/// ```
#[inline(always)]
pub fn tanh(x: f32) -> f32 {
    let magnitude = x.abs();
    let square = x * x;
    let [c0, c1, c2, c3] = TANH_TAIL;
    let small = x + x * square * (((c3 * square + c2) * square + c1) * square + c0);
    let large = (1.0 - 2.0 / (exp(2.0 * magnitude) + 1.0)).copysign(x);
    if magnitude < TANH_SMALL { small } else { large }
}

#[cfg(test)]
mod tests {
    use super::{sigmoid, tanh};

    /// The largest relative error of `ours` against `exact` over [−limit, limit].
    fn worst_relative(limit: f32, ours: impl Fn(f32) -> f32, exact: impl Fn(f64) -> f64) -> f64 {
        let steps = 2_000_000;
        (0..=steps)
            .map(|i| limit * (2.0 * (i as f32 / steps as f32) - 1.0))
            .filter(|&x| x != 0.0)
            .map(|x| (f64::from(ours(x)) / exact(f64::from(x)) - 1.0).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn tanh_is_accurate_and_odd() {
        let worst = worst_relative(12.0, tanh, f64::tanh);
        assert!(worst < 4e-7, "relative error {worst}");
        assert_eq!(tanh(-0.7), -tanh(0.7), "odd");
        assert_eq!((tanh(100.0), tanh(-100.0)), (1.0, -1.0), "saturates");
        assert!(tanh(1e-30) > 0.0 && tanh(-1e-30) < 0.0, "the sign survives");
        assert!(tanh(f32::NAN).is_nan(), "NaN stays NaN");
    }

    #[test]
    fn sigmoid_is_accurate() {
        let worst = worst_relative(80.0, sigmoid, |x| 1.0 / (1.0 + (-x).exp()));
        assert!(worst < 4e-7, "relative error {worst}");
        assert!(sigmoid(f32::NAN).is_nan(), "NaN stays NaN");
    }
}
