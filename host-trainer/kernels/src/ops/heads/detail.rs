//! The detail residual: one small network shared by all Gaussians that adds to a colour what the anchor's feature says about it.

use super::head::add_rows;
use super::matmul::{Matrix, multiply};
use super::neural_gaussians::{Gaussian, Source};
use crate::real::Real;
use crate::scene::Head;

/// What [`forward`] leaves for [`backward`]; buffers are kept from step to step.
#[derive(Clone, Debug, Default)]
pub struct ForwardCache<R> {
    /// `[m, 3]` colours without residual.
    plain: Vec<R>,
    /// `[m, H]` hidden units.
    hidden: Vec<R>,
    /// `[n, H]` the part of the first layer that only the anchor decides.
    sums: Vec<R>,
}

/// W1 of the head in two parts: `[H, F]` for the feature, `[H, 3]` for the colour.
fn first_layer<R: Real>(head: &Head<R>) -> [Vec<R>; 2] {
    let f = head.n_in - 3;
    let rows = || head.w1.chunks_exact(head.n_in);
    [rows().flat_map(|row| &row[..f]).copied().collect(), rows().flat_map(|row| &row[f..]).copied().collect()]
}

/// Adds the residual to the colours of a block's Gaussians: H = x + F(f ⊕ x) with
/// F(z) = W2·relu(W1·z + b1) + b2 (the plug-and-play paper, eq. 5).
///
/// The sums over the feature are taken once an anchor. Nothing keeps H in 0 to 1 but the image's own limits.
///
/// * `features`: `[n, F]`. * `sources`: of the Gaussians. Cost: n·F·H + m·6·H multiply-adds.
pub fn forward<R: Real>(
    head: &Head<R>,
    features: &[R],
    sources: &[Source],
    gaussians: &mut [Gaussian<R>],
    kept: &mut ForwardCache<R>,
) {
    let (f, h, m) = (head.n_in - 3, head.n_hidden, gaussians.len());
    let n = features.len() / f;
    let [by_feature, by_colour] = first_layer(head);
    kept.sums.clear();
    kept.sums.extend(std::iter::repeat_n(&head.b1, n).flatten());
    multiply(Matrix::new(features, n, f), Matrix::new(&by_feature, h, f).t(), true, &mut kept.sums);
    kept.plain.clear();
    kept.plain.extend(gaussians.iter().flat_map(|g| g.colour));
    kept.hidden.clear();
    kept.hidden.extend(sources.iter().flat_map(|s| &kept.sums[s.row as usize * h..(s.row as usize + 1) * h]));
    multiply(Matrix::new(&kept.plain, m, 3), Matrix::new(&by_colour, h, 3).t(), true, &mut kept.hidden);
    for unit in &mut kept.hidden {
        *unit = unit.larger(R::ZERO);
    }
    let mut residuals: Vec<R> = std::iter::repeat_n(&head.b2, m).flatten().copied().collect();
    multiply(Matrix::new(&kept.hidden, m, h), Matrix::new(&head.w2, 3, h).t(), true, &mut residuals);
    for (gaussian, residual) in gaussians.iter_mut().zip(residuals.as_chunks::<3>().0) {
        for (colour, residual) in gaussian.colour.iter_mut().zip(residual) {
            *colour += *residual;
        }
    }
}

/// Gradients of [`forward`]: those of the colours with residual become those of the colours without.
///
/// * `d_gaussians`: colours replaced. * `d_features`, `d_head`: added to.
pub fn backward<R: Real>(
    head: &Head<R>,
    features: &[R],
    sources: &[Source],
    kept: &mut ForwardCache<R>,
    d_gaussians: &mut [Gaussian<R>],
    d_features: &mut [R],
    d_head: &mut Head<R>,
) {
    let (f, h, m) = (head.n_in - 3, head.n_hidden, d_gaussians.len());
    let n = features.len() / f;
    let [by_feature, by_colour] = first_layer(head);
    let d_residuals: Vec<R> = d_gaussians.iter().flat_map(|gaussian| gaussian.colour).collect();
    let d_out = Matrix::new(&d_residuals, m, 3);
    multiply(d_out.t(), Matrix::new(&kept.hidden, m, h), true, &mut d_head.w2);
    add_rows(&d_residuals, &mut d_head.b2);
    let mut d_hidden = vec![R::ZERO; m * h];
    multiply(d_out, Matrix::new(&head.w2, 3, h), false, &mut d_hidden);
    let d_sums = &mut kept.sums;
    d_sums.fill(R::ZERO);
    let rows = d_hidden.chunks_exact_mut(h).zip(kept.hidden.chunks_exact(h)).zip(sources);
    for ((d_hidden, hidden), source) in rows {
        let sums = &mut d_sums[source.row as usize * h..(source.row as usize + 1) * h];
        for ((d, unit), sum) in d_hidden.iter_mut().zip(hidden).zip(sums) {
            *d = if *unit > R::ZERO { *d } else { R::ZERO };
            *sum += *d;
        }
    }
    add_rows(d_sums, &mut d_head.b1);
    let mut d_by_feature = vec![R::ZERO; h * f];
    multiply(Matrix::new(d_sums, n, h).t(), Matrix::new(features, n, f), false, &mut d_by_feature);
    let mut d_by_colour = vec![R::ZERO; h * 3];
    multiply(Matrix::new(&d_hidden, m, h).t(), Matrix::new(&kept.plain, m, 3), false, &mut d_by_colour);
    let parts = d_by_feature.chunks_exact(f).zip(d_by_colour.chunks_exact(3));
    for (row, (feature, colour)) in d_head.w1.chunks_exact_mut(head.n_in).zip(parts) {
        for (sum, d) in row.iter_mut().zip(feature.iter().chain(colour)) {
            *sum += *d;
        }
    }
    multiply(Matrix::new(d_sums, n, h), Matrix::new(&by_feature, h, f), true, d_features);
    let mut d_plain = vec![R::ZERO; 3 * m];
    multiply(Matrix::new(&d_hidden, m, h), Matrix::new(&by_colour, h, 3), false, &mut d_plain);
    for (gaussian, d) in d_gaussians.iter_mut().zip(d_plain.as_chunks::<3>().0) {
        for (colour, d) in gaussian.colour.iter_mut().zip(d) {
            *colour += *d;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::{assert_piecewise_gradient, random};
    use crate::ops::heads::head;

    const F: usize = 4;
    const H: usize = 5;
    /// Gaussians of three anchors; the second has none.
    const ROWS: [u32; 5] = [0, 0, 2, 2, 2];

    fn sources() -> Vec<Source> {
        (0..).zip(ROWS).map(|(offset, row)| Source { row, offset }).collect()
    }

    fn split(x: &[f64]) -> (Head<f64>, &[f64], Vec<Gaussian<f64>>) {
        let mut head = Head::filled(F + 3, H, 3, 0.0);
        let mut rest = x;
        for group in head.groups_mut() {
            let (values, after) = rest.split_at(group.len());
            group.copy_from_slice(values);
            rest = after;
        }
        let (features, colours) = rest.split_at(3 * F);
        let of = |c: &[f64; 3]| Gaussian { colour: *c, ..Gaussian::default() };
        (head, features, colours.as_chunks().0.iter().map(of).collect())
    }

    /// Σ weights·colours.
    fn objective(x: &[f64], weights: &[f64]) -> f64 {
        let (head, features, mut gaussians) = split(x);
        forward(&head, features, &sources(), &mut gaussians, &mut ForwardCache::default());
        gaussians.iter().flat_map(|g| g.colour).zip(weights).map(|(c, w)| c * w).sum()
    }

    #[test]
    fn a_residual_is_the_whole_network_of_feature_and_colour() {
        let n = Head::filled(F + 3, H, 3, 0.0).n_params() + 3 * F + 3 * ROWS.len();
        let x = random(3, n);
        let (network, features, mut gaussians) = split(&x);
        let plain: Vec<[f64; 3]> = gaussians.iter().map(|g| g.colour).collect();
        forward(&network, features, &sources(), &mut gaussians, &mut ForwardCache::default());
        for ((gaussian, plain), row) in gaussians.iter().zip(plain).zip(ROWS) {
            let input = [&features[row as usize * F..][..F], &plain].concat();
            let mut output = [0.0; 3];
            head::forward(&network, &input, &mut [0.0; H], &mut output);
            for i in 0..3 {
                assert!((gaussian.colour[i] - plain[i] - output[i]).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn backward_agrees_with_finite_differences() {
        let n_weights = Head::filled(F + 3, H, 3, 0.0).n_params();
        for seed in 0..3 {
            let x = random(seed, n_weights + 3 * F + 3 * ROWS.len());
            let weights = random(seed + 10, 3 * ROWS.len());
            let (network, features, mut gaussians) = split(&x);
            let mut kept = ForwardCache::default();
            forward(&network, features, &sources(), &mut gaussians, &mut kept);
            let of = |c: &[f64; 3]| Gaussian { colour: *c, ..Gaussian::default() };
            let mut d_gaussians: Vec<Gaussian<f64>> = weights.as_chunks().0.iter().map(of).collect();
            let (mut d_features, mut d_head) = (vec![0.0; 3 * F], Head::filled(F + 3, H, 3, 0.0));
            backward(&network, features, &sources(), &mut kept, &mut d_gaussians, &mut d_features, &mut d_head);
            let mut analytic = d_head.groups().concat();
            analytic.extend(d_features);
            analytic.extend(d_gaussians.iter().flat_map(|g| g.colour));
            assert_piecewise_gradient("detail", &x, &analytic, |x| objective(x, &weights));
        }
    }
}
