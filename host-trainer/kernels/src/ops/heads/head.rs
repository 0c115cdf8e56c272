//! One anchor MLP over a block of anchors: `y = W2·relu(W1·x + b1) + b2`.

use super::matmul::{Matrix, multiply};
use crate::real::Real;
use crate::scene::Head;

/// Evaluates a head for `n` anchors.
///
/// * `input`: `[n, ≥ n_in]`, of which the first n_in of a row count. * `hidden`: `[n, n_hidden]`, overwritten with relu(W1·x + b1), which
///   backward needs.
/// * `output`: `[n, n_out]`, overwritten. Cost: n·(n_in + n_out)·n_hidden multiply-adds.
pub fn forward<R: Real>(head: &Head<R>, input: &[R], hidden: &mut [R], output: &mut [R]) {
    let n = hidden.len() / head.n_hidden;
    for row in hidden.chunks_exact_mut(head.n_hidden) {
        row.copy_from_slice(&head.b1);
    }
    let w1 = Matrix::new(&head.w1, head.n_hidden, head.n_in);
    multiply(Matrix::first_columns(input, n, head.n_in), w1.t(), true, hidden);
    for h in hidden.iter_mut() {
        *h = h.larger(R::ZERO);
    }
    for row in output.chunks_exact_mut(head.n_out) {
        row.copy_from_slice(&head.b2);
    }
    multiply(Matrix::new(hidden, n, head.n_hidden), Matrix::new(&head.w2, head.n_out, head.n_hidden).t(), true, output);
}

/// Gradients of [`forward`].
///
/// With δ = d_output: dW2 += δᵀ·h, db2 += Σδ, dh = δ·W2 where h > 0, dW1 += dhᵀ·x, db1 += Σdh, dx += dh·W1.
///
/// * `input`, `hidden`: as forward left them. * `d_hidden`: scratch `[n, n_hidden]`.
/// * `d_input`: as `input`, added to. * `d_head`: added to.
pub fn backward<R: Real>(
    head: &Head<R>,
    input: &[R],
    hidden: &[R],
    d_output: &[R],
    d_hidden: &mut [R],
    d_input: &mut [R],
    d_head: &mut Head<R>,
) {
    let n = hidden.len() / head.n_hidden;
    let d_out = Matrix::new(d_output, n, head.n_out);
    multiply(d_out.t(), Matrix::new(hidden, n, head.n_hidden), true, &mut d_head.w2);
    add_rows(d_output, &mut d_head.b2);
    multiply(d_out, Matrix::new(&head.w2, head.n_out, head.n_hidden), false, d_hidden);
    for (d, h) in d_hidden.iter_mut().zip(hidden) {
        *d = if *h > R::ZERO { *d } else { R::ZERO };
    }
    let d_hid = Matrix::new(d_hidden, n, head.n_hidden);
    multiply(d_hid.t(), Matrix::first_columns(input, n, head.n_in), true, &mut d_head.w1);
    add_rows(d_hidden, &mut d_head.b1);
    multiply(d_hid, Matrix::new(&head.w1, head.n_hidden, head.n_in), true, d_input);
}

/// `sum[j] += Σ_i rows[i, j]`.
pub(super) fn add_rows<R: Real>(rows: &[R], sum: &mut [R]) {
    for row in rows.chunks_exact(sum.len()) {
        for (s, r) in sum.iter_mut().zip(row) {
            *s += *r;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::{assert_piecewise_gradient, random};

    /// Σ weights · outputs, a scalar whose gradient exercises every output.
    fn objective(head: &Head<f64>, input: &[f64], weights: &[f64]) -> f64 {
        let n = weights.len() / head.n_out;
        let (mut hidden, mut output) = (vec![0.0; n * head.n_hidden], vec![0.0; n * head.n_out]);
        forward(head, input, &mut hidden, &mut output);
        output.iter().zip(weights).map(|(o, w)| o * w).sum()
    }

    #[test]
    fn backward_agrees_with_finite_differences() {
        // The last sees the first of 36 columns, and what lies behind them has no gradient.
        for (seed, n, row, n_in, n_hidden, n_out) in [(1, 5, 7, 7, 4, 3), (2, 1, 3, 3, 8, 10), (3, 17, 36, 33, 32, 7)] {
            let mut head = Head::filled(n_in, n_hidden, n_out, 0.0f64);
            for (i, group) in head.groups_mut().into_iter().enumerate() {
                let len = group.len();
                group.copy_from_slice(&random(seed * 10 + i as u64, len));
            }
            let input = random(seed + 100, n * row);
            let weights = random(seed + 200, n * n_out);
            let (mut hidden, mut output) = (vec![0.0; n * n_hidden], vec![0.0; n * n_out]);
            forward(&head, &input, &mut hidden, &mut output);
            let mut d_input = vec![0.0; input.len()];
            let mut d_head = Head::filled(n_in, n_hidden, n_out, 0.0);
            backward(&head, &input, &hidden, &weights, &mut vec![0.0; hidden.len()], &mut d_input, &mut d_head);
            assert_piecewise_gradient("input", &input, &d_input, |x| objective(&head, x, &weights));
            for group in 0..4 {
                let start = head.groups()[group].to_vec();
                assert_piecewise_gradient("weights", &start, d_head.groups()[group], |x| {
                    let mut moved = head.clone();
                    moved.groups_mut()[group].copy_from_slice(x);
                    objective(&moved, &input, &weights)
                });
            }
        }
    }
}
