//! The optimiser.

use serde::{Deserialize, Serialize};

use crate::real::Real;

/// Constants of Adam as Scaffold-GS sets them.
/// Decay of the mean of gradients.
pub const BETA1: f64 = 0.9;
/// Decay of the mean of their squares.
pub const BETA2: f64 = 0.999;
/// Keeps the quotient finite where no gradient ever came.
pub const EPSILON: f64 = 1e-15;

/// First and second moments of one parameter array.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Moments<R> {
    /// Running mean of the gradient.
    pub first: Vec<R>,
    /// Running mean of its square.
    pub second: Vec<R>,
}

impl<R: Real> Moments<R> {
    /// Zero moments of `len` parameters.
    pub fn zeros(len: usize) -> Self {
        Self { first: vec![R::ZERO; len], second: vec![R::ZERO; len] }
    }
}

/// Rate and bias corrections of one step, the same for every parameter of a group.
#[derive(Clone, Copy, Debug)]
pub struct Step<R> {
    /// Learning rate over the correction of the first moment.
    pub scale: R,
    /// Of the second moment's root.
    pub second_correction: R,
}

impl<R: Real> Step<R> {
    /// The step number `t ≥ 1` at learning rate `rate`.
    pub fn new(rate: f64, t: u32) -> Self {
        let t = f64::from(t);
        let (c1, c2) = (1.0 - BETA1.powf(t), 1.0 - BETA2.powf(t));
        Self { scale: R::real(rate / c1), second_correction: R::real(1.0 / c2.sqrt()) }
    }
}

/// m ← β₁m + (1−β₁)g, v ← β₂v + (1−β₂)g², p ← p − rate·m̂/(√v̂ + ε) (Kingma and Ba 2015, algorithm 1).
///
/// A parameter without a gradient (`gradient` is `None`) has g = 0: its moments decay and still move it, as in the dense
/// optimiser that the method's constants were tuned with. All slices have one length.
#[inline(always)]
pub fn update<R: Real>(step: Step<R>, parameters: &mut [R], first: &mut [R], second: &mut [R], gradient: Option<&[R]>) {
    let n = parameters.len();
    let (first, second) = (&mut first[..n], &mut second[..n]);
    match gradient {
        Some(g) => {
            let g = &g[..n];
            for i in 0..n {
                update_one(step, &mut parameters[i], &mut first[i], &mut second[i], g[i]);
            }
        }
        None => {
            for i in 0..n {
                update_one(step, &mut parameters[i], &mut first[i], &mut second[i], R::ZERO);
            }
        }
    }
}

#[inline(always)]
fn update_one<R: Real>(step: Step<R>, p: &mut R, m: &mut R, v: &mut R, g: R) {
    *m = R::real(BETA1) * *m + R::real(1.0 - BETA1) * g;
    *v = R::real(BETA2) * *v + R::real(1.0 - BETA2) * (g * g);
    *p -= step.scale * *m / (v.sqrt() * step.second_correction + R::real(EPSILON));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_step_moves_by_the_rate_against_the_gradient() {
        let mut p = [1.0f64, 1.0, 1.0];
        let mut m = Moments::zeros(3);
        update(Step::new(0.1, 1), &mut p, &mut m.first, &mut m.second, Some(&[2.0, -1e-6, 0.0]));
        assert!((p[0] - 0.9).abs() < 1e-9 && (p[1] - 1.1).abs() < 1e-9, "{p:?}");
        assert_eq!(p[2], 1.0, "no gradient, no moments, no step");
        // No gradient now, but the moments carry on.
        update(Step::new(0.1, 2), &mut p, &mut m.first, &mut m.second, None);
        assert!(p[0] < 0.9 && p[1] > 1.1 && p[2] == 1.0);
    }

    #[test]
    fn converges_on_a_quadratic() {
        let mut p = [3.0f64];
        let mut m = Moments::zeros(1);
        for t in 1..3000 {
            let g = [2.0 * (p[0] - 1.5)];
            update(Step::new(0.01, t), &mut p, &mut m.first, &mut m.second, Some(&g));
        }
        assert!((p[0] - 1.5).abs() < 1e-3, "{p:?}");
    }
}
