//! The intra-anchor context: features before a feature move its mean (Chen et al. 2025, HAC++, section 3.3; there by small
//! networks).
//!
//! With x the features and m the means that the anchor's place gives them, both in steps, r = x − m and
//!
//! μ_c = m_c + Σ_t w_ct·r_(c−t), t from 1 to min(c, T).

use pocketsplat_format::context::first_tap;

use crate::real::Real;

/// Moves `means` `[F]` by the residuals of the features before each.
///
/// * `taps`: `Σ_c min(c, n_taps)`. * `residuals`: `[F]`, filled: what each value leaves of its mean as it was.
pub fn forward<R: Real>(n_taps: usize, taps: &[R], values: &[R], means: &mut [R], residuals: &mut [R]) {
    for (residual, (value, mean)) in residuals.iter_mut().zip(values.iter().zip(&*means)) {
        *residual = *value - *mean;
    }
    for (feature, mean) in means.iter_mut().enumerate() {
        let n = feature.min(n_taps);
        let weights = &taps[first_tap(feature, n_taps)..][..n];
        for (weight, residual) in weights.iter().zip(&residuals[feature - n..feature]) {
            *mean += *weight * *residual;
        }
    }
}

/// Gradients from those of the bits in the values at fixed means, −∂bits/∂μ.
///
/// * `residuals`: as [`forward`] left them. * `d_values`: `[F]`, in: ∂bits/∂x at fixed means; out: the whole ∂bits/∂x, which is
///   −∂bits/∂m. * `d_taps`: added to.
pub fn backward<R: Real>(n_taps: usize, taps: &[R], residuals: &[R], d_values: &mut [R], d_taps: &mut [R]) {
    // Ascending: what is added to the features before a feature is not needed again.
    for feature in 1..d_values.len() {
        let n = feature.min(n_taps);
        let first = first_tap(feature, n_taps);
        let (before, own) = d_values.split_at_mut(feature);
        let rows = taps[first..first + n].iter().zip(&mut d_taps[first..first + n]);
        for ((weight, d_weight), (residual, d_before)) in
            rows.zip(residuals[feature - n..feature].iter().zip(&mut before[feature - n..]))
        {
            *d_weight -= own[0] * *residual;
            *d_before -= own[0] * *weight;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::{assert_gradient, random};

    #[test]
    fn backward_agrees_with_finite_differences() {
        for (n, n_taps) in [(1, 3), (5, 0), (6, 2), (6, 9)] {
            let n_weights = first_tap(n, n_taps);
            let x = [random(1, 2 * n), random(2, n_weights)].concat();
            // A loss of x − μ, as bits are.
            let slopes = random(3, n);
            let run = |x: &[f64]| {
                let (values, rest) = x.split_at(n);
                let (means, taps) = rest.split_at(n);
                let (mut means, mut residuals) = (means.to_vec(), vec![0.0; n]);
                forward(n_taps, taps, values, &mut means, &mut residuals);
                let loss: f64 = (0..n).map(|i| slopes[i] * (values[i] - means[i])).sum();
                (loss, residuals)
            };
            let (_, residuals) = run(&x);
            let (mut d_values, mut d_taps) = (slopes.clone(), vec![0.0; n_weights]);
            backward(n_taps, &x[2 * n..], &residuals, &mut d_values, &mut d_taps);
            let d_means: Vec<f64> = d_values.iter().map(|d| -d).collect();
            assert_gradient("taps", &x, &[d_values, d_means, d_taps].concat(), |x| run(x).0);
        }
    }
}
