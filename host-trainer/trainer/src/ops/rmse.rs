//! Root of the mean squared difference of two images.

use crate::real::Real;

/// `Σ (image − truth)²` over pixels and channels.
pub fn squared_sum<R: Real>(image: &[R], truth: &[R]) -> f64 {
    // Blocks of fixed size, so that the sum's rounding is the same however it is scheduled.
    let blocks = image.chunks(4096).zip(truth.chunks(4096));
    blocks.map(|(a, b)| a.iter().zip(b).map(|(x, y)| Into::<f64>::into((*x - *y) * (*x - *y))).sum::<f64>()).sum()
}

/// `√(Σ (image − truth)² / n)`.
///
/// * `squared_sum`: as [`squared_sum`] finds it.
pub fn forward<R: Real>(squared_sum: f64, n_values: usize) -> R {
    R::real((squared_sum / n_values as f64).sqrt())
}

/// Adds `weight · (image − truth)/√(n · Σ (image − truth)²)` to `d_image`; nothing where the images are equal.
///
/// * `squared_sum`: as [`squared_sum`] finds it.
pub fn backward<R: Real>(image: &[R], truth: &[R], squared_sum: f64, weight: R, d_image: &mut [R]) {
    if squared_sum > 0.0 {
        let step = weight / R::real((image.len() as f64 * squared_sum).sqrt());
        for ((x, y), d) in image.iter().zip(truth).zip(d_image) {
            *d += step * (*x - *y);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::{assert_gradient, random};

    #[test]
    fn backward_agrees_with_finite_differences() {
        let (x, truth) = (random(1, 60), random(2, 60));
        let mut d = vec![0.0; 60];
        backward(&x, &truth, squared_sum(&x, &truth), 0.8, &mut d);
        assert_gradient("rmse", &x, &d, |x| 0.8 * forward::<f64>(squared_sum(x, &truth), x.len()));
        let mut d = vec![0.0; 60];
        backward(&truth, &truth, 0.0, 0.8, &mut d);
        assert!(d.iter().all(|d| *d == 0.0), "no gradient where nothing differs");
    }
}
