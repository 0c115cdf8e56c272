//! Keeps Gaussians small: the mean volume of those a view draws.

use crate::ops::heads::neural_gaussians::Gaussian;
use crate::real::Real;

/// `weight · mean(s_x·s_y·s_z)` (Lu et al. 2024, Scaffold-GS, eq. 10), over `n_all` Gaussians of the view.
///
/// A block's share: sums its own Gaussians and divides by the number in the whole view.
pub fn forward<R: Real>(gaussians: &[Gaussian<R>], weight: R, n_all: usize) -> R {
    let sum: R = gaussians.iter().map(|g| g.scale[0] * g.scale[1] * g.scale[2]).sum();
    weight * sum / R::real(n_all.max(1) as f64)
}

/// Adds the gradient of [`forward`] to the scales of `d_gaussians`.
pub fn backward<R: Real>(gaussians: &[Gaussian<R>], weight: R, n_all: usize, d_gaussians: &mut [Gaussian<R>]) {
    let share = weight / R::real(n_all.max(1) as f64);
    for (g, d) in gaussians.iter().zip(d_gaussians) {
        let [x, y, z] = g.scale;
        d.scale[0] += share * y * z;
        d.scale[1] += share * x * z;
        d.scale[2] += share * x * y;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::{assert_gradient, random};

    #[test]
    fn backward_agrees_with_finite_differences() {
        let x: Vec<f64> = random(1, 15).iter().map(|v| v.abs() + 0.01).collect();
        let unpack = |x: &[f64]| -> Vec<Gaussian<f64>> {
            x.chunks_exact(3).map(|s| Gaussian { scale: [s[0], s[1], s[2]], ..Gaussian::default() }).collect()
        };
        let mut d = vec![Gaussian::default(); 5];
        backward(&unpack(&x), 0.01, 5, &mut d);
        let analytic: Vec<f64> = d.iter().flat_map(|d| d.scale).collect();
        assert_gradient("volume", &x, &analytic, |x| forward(&unpack(x), 0.01, 5));
    }
}
