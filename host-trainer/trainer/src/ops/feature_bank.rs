//! The feature bank: an anchor's feature at three resolutions, mixed by weights that follow from where it is seen from.

use super::{Pinhole, Real, head, head_input};
use crate::scene::{BANK_WEIGHTS as N_WEIGHTS, Head};

/// What [`forward`] leaves for [`backward`]; buffers are kept from step to step.
#[derive(Clone, Debug, Default)]
pub struct Kept<R> {
    /// `[n, 4]` direction and distance.
    inputs: Vec<R>,
    /// `[n, F]` hidden units.
    hidden: Vec<R>,
    /// `[n, 3]` weights of the feature's fourth, of its half and of the whole, which add up to 1.
    weights: Vec<R>,
}

/// What the heads see in the place of the features: f' = w₀·tile(f₀ f₄ …, 4) + w₁·tile(f₀ f₂ …, 2) + w₂·f with
/// w = softmax(W2·relu(W1·[direction, distance] + b1) + b2); tile repeats the whole shortened vector (Lu et al. 2024, Scaffold-GS,
/// eq. 4).
///
/// * `positions`: `[n]`, world frame. * `features`: `[n, F]`, F divisible by 4. * `mixed`: `[n, F]`, overwritten. Cost: 10·n·F
///   multiply-adds.
pub fn forward<R: Real>(
    bank: &Head<R>,
    camera: &Pinhole<R>,
    positions: &[[R; 3]],
    features: &[R],
    kept: &mut Kept<R>,
    mixed: &mut Vec<R>,
) {
    kept.inputs.clear();
    for position in positions {
        let (direction, distance) = head_input::seen_from(camera, *position);
        kept.inputs.extend(direction);
        kept.inputs.push(distance);
    }
    kept.hidden.resize(positions.len() * bank.n_hidden, R::ZERO);
    kept.weights.resize(positions.len() * N_WEIGHTS, R::ZERO);
    head::forward(bank, &kept.inputs, &mut kept.hidden, &mut kept.weights);
    for weights in kept.weights.as_chunks_mut::<N_WEIGHTS>().0 {
        let largest = weights.iter().fold(weights[0], |most, logit| most.larger(*logit));
        *weights = weights.map(|logit| (logit - largest).exp());
        let sum: R = weights.iter().copied().sum();
        *weights = weights.map(|weight| weight / sum);
    }
    mixed.resize(features.len(), R::ZERO);
    mix(kept, features, mixed);
}

/// Other features of the same anchors, mixed by the weights that [`forward`] left.
///
/// * `features`, `mixed`: `[n, F]`, the latter overwritten.
pub fn mix<R: Real>(kept: &Kept<R>, features: &[R], mixed: &mut [R]) {
    let f = features.len() / (kept.weights.len() / N_WEIGHTS).max(1);
    let rows = mixed.chunks_exact_mut(f.max(1)).zip(features.chunks_exact(f.max(1)));
    for ((mixed, feature), [w0, w1, w2]) in rows.zip(kept.weights.as_chunks().0) {
        for (i, mixed) in mixed.iter_mut().enumerate() {
            let [quarter, half, whole] = sources(i, f).map(|source| feature[source]);
            *mixed = *w0 * quarter + *w1 * half + *w2 * whole;
        }
    }
}

/// Where the parts of number `i` of a mixed feature come from.
fn sources(i: usize, f: usize) -> [usize; N_WEIGHTS] {
    [4 * (i % (f / 4)), 2 * (i % (f / 2)), i]
}

/// Gradients of [`forward`]; anchors do not move, so where they are seen from has none.
///
/// * `d_mixed`: `[n, F]`. * `d_features`, `d_bank`: added to.
pub fn backward<R: Real>(
    bank: &Head<R>,
    features: &[R],
    kept: &Kept<R>,
    d_mixed: &[R],
    d_features: &mut [R],
    d_bank: &mut Head<R>,
) {
    let f = features.len() / (kept.weights.len() / N_WEIGHTS).max(1);
    let mut d_logits = Vec::with_capacity(kept.weights.len());
    let rows = features.chunks_exact(f.max(1)).zip(d_mixed.chunks_exact(f.max(1)));
    let rows = rows.zip(d_features.chunks_exact_mut(f.max(1)));
    for (((feature, d_mixed), d_feature), weights) in rows.zip(kept.weights.as_chunks::<N_WEIGHTS>().0) {
        let mut d_weights = [R::ZERO; N_WEIGHTS];
        for (i, d) in d_mixed.iter().enumerate() {
            for ((source, weight), d_weight) in sources(i, f).into_iter().zip(weights).zip(&mut d_weights) {
                d_feature[source] += *weight * *d;
                *d_weight += feature[source] * *d;
            }
        }
        let mean: R = weights.iter().zip(&d_weights).map(|(w, d)| *w * *d).sum();
        d_logits.extend(weights.iter().zip(d_weights).map(|(w, d)| *w * (d - mean)));
    }
    let mut d_hidden = vec![R::ZERO; kept.hidden.len()];
    let mut d_inputs = vec![R::ZERO; kept.inputs.len()];
    head::backward(bank, &kept.inputs, &kept.hidden, &d_logits, &mut d_hidden, &mut d_inputs, d_bank);
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};

    use super::*;
    use crate::ops::finite_difference::{assert_piecewise_gradient, random};
    use pocketsplat_capture::camera::Camera;

    const F: usize = 8;
    /// The last one is the camera's own place.
    const POSITIONS: [[f64; 3]; 3] = [[0.3, -0.2, 0.9], [1.0, 0.0, 5.1], [0.0, 0.0, -3.0]];

    fn camera() -> Pinhole<f64> {
        Pinhole::new(&Camera {
            rotation: DMat3::IDENTITY,
            translation: DVec3::new(0.0, 0.0, 3.0),
            focal_px: [50.0; 2],
            principal_px: [16.0; 2],
            width_px: 32,
            height_px: 32,
        })
    }

    /// A bank and the features of all positions.
    fn split(x: &[f64]) -> (Head<f64>, &[f64]) {
        let mut head = Head::filled(4, F, N_WEIGHTS, 0.0);
        let mut rest = x;
        for group in head.groups_mut() {
            let (values, after) = rest.split_at(group.len());
            group.copy_from_slice(values);
            rest = after;
        }
        (head, rest)
    }

    fn mixed(bank: &Head<f64>, features: &[f64]) -> (Kept<f64>, Vec<f64>) {
        let (mut kept, mut mixed) = (Kept::default(), Vec::new());
        forward(bank, &camera(), &POSITIONS, features, &mut kept, &mut mixed);
        (kept, mixed)
    }

    #[test]
    fn all_weight_on_the_whole_feature_leaves_it_as_it_is() {
        let features = random(1, 3 * F);
        for (of, expected) in
            [(2, [0, 1, 2, 3, 4, 5, 6, 7]), (1, [0, 2, 4, 6, 0, 2, 4, 6]), (0, [0, 4, 0, 4, 0, 4, 0, 4])]
        {
            let mut bank = Head::filled(4, F, N_WEIGHTS, 0.0);
            bank.b2[of] = 2000.0;
            let expected: Vec<f64> = (0..3).flat_map(|row| expected.map(|i: usize| features[row * F + i])).collect();
            assert_eq!(mixed(&bank, &features).1, expected, "weight {of}");
        }
        let (kept, even) = mixed(&Head::filled(4, F, N_WEIGHTS, 0.0), &features);
        assert!(kept.weights.iter().all(|weight| (weight - 1.0 / 3.0).abs() < 1e-15), "a third each");
        assert!((even[3] - (features[4] + features[6] + features[3]) / 3.0).abs() < 1e-15);
    }

    #[test]
    fn backward_agrees_with_finite_differences() {
        let n_weights = Head::filled(4, F, N_WEIGHTS, 0.0).n_params();
        for seed in 0..4 {
            let mut x = random(seed, n_weights + 3 * F);
            if seed == 3 {
                // One weight next to 1.
                x[n_weights - 1] = 12.0;
            }
            let weights = random(seed + 10, 3 * F);
            let (bank, features) = split(&x);
            let (kept, _) = mixed(&bank, features);
            let (mut d_features, mut d_bank) = (vec![0.0; 3 * F], Head::filled(4, F, N_WEIGHTS, 0.0));
            backward(&bank, features, &kept, &weights, &mut d_features, &mut d_bank);
            let analytic = [d_bank.groups().concat(), d_features].concat();
            assert_piecewise_gradient("feature bank", &x, &analytic, |x| {
                let (bank, features) = split(x);
                mixed(&bank, features).1.iter().zip(&weights).map(|(f, w)| f * w).sum()
            });
        }
    }
}
