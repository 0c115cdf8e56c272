//! Central differences of an f64 forward pass: the judge of every backward pass.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// `len` values in [−1, 1), the same for the same seed.
pub fn random(seed: u64, len: usize) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..len).map(|_| rng.random_range(-1.0..1.0)).collect()
}

/// Fourth-order central difference of `f` along `x[i]`: (8·(f(x+h) − f(x−h)) − (f(x+2h) − f(x−2h)))/(12h).
fn difference(x: &[f64], i: usize, h: f64, f: impl Fn(&[f64]) -> f64) -> f64 {
    let at = |step: f64| {
        let mut moved = x.to_vec();
        moved[i] += step;
        f(&moved)
    };
    (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h)
}

/// Asserts that `analytic` is the gradient of the smooth function `f` at `x`, to 1e-6 of the largest component.
///
/// h = 1e-4·max(|x|, 1e-2), for which the differences' own error of order h⁴ + ε/h stays below the tolerance.
pub fn assert_gradient(name: &str, x: &[f64], analytic: &[f64], f: impl Fn(&[f64]) -> f64) {
    assert_with_steps(name, x, analytic, &[1e-4], f);
}

/// As [`assert_gradient`] for a function made of smooth pieces (relu, cutoffs): where a step crosses into another
/// piece a smaller one is tried; a wrong gradient agrees with none of them.
pub fn assert_piecewise_gradient(name: &str, x: &[f64], analytic: &[f64], f: impl Fn(&[f64]) -> f64) {
    assert_with_steps(name, x, analytic, &[1e-4, 1e-5, 1e-6, 1e-7], f);
}

fn assert_with_steps(name: &str, x: &[f64], analytic: &[f64], steps: &[f64], f: impl Fn(&[f64]) -> f64) {
    assert_eq!(x.len(), analytic.len(), "{name}: one gradient per input");
    let scale = analytic.iter().fold(1e-3f64, |s, g| s.max(g.abs()));
    for (i, a) in analytic.iter().enumerate() {
        let mut tried = Vec::new();
        let agrees = steps.iter().any(|h| {
            let found = difference(x, i, h * x[i].abs().max(1e-2), &f);
            tried.push(found);
            (a - found).abs() <= 1e-6 * scale
        });
        assert!(agrees, "{name}[{i}]: backward says {a}, differences say {tried:?} (scale {scale})");
    }
}
