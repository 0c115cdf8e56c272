//! The network of the colours: two hidden layers of rectified units.

use pocketsplat_kernels::real::Real;

use super::grid::FEATURES;

/// What goes in: features of a place, the direction from the camera to it, and 1.
pub(super) const INPUTS: usize = FEATURES + 4;
/// Units of a hidden layer.
pub(super) const HIDDEN: usize = 64;
/// What comes out: RGB.
const OUTPUTS: usize = 3;

/// Numbers of the layers.
pub(super) const FIRST: usize = INPUTS * HIDDEN;
const SECOND: usize = HIDDEN * HIDDEN;
pub(super) const N_WEIGHTS: usize = FIRST + SECOND + HIDDEN * OUTPUTS;

/// What a backward pass needs of a forward pass.
pub(super) struct Trace<R> {
    first: [R; HIDDEN],
    second: [R; HIDDEN],
    /// The network's answer.
    pub(super) out: [R; OUTPUTS],
}

/// Of each layer a row for each number that goes in.
struct Layers<'a, R> {
    first: &'a [[R; HIDDEN]],
    second: &'a [[R; HIDDEN]],
    last: &'a [[R; OUTPUTS]],
}

impl<'a, R> Layers<'a, R> {
    #[inline(always)]
    fn of(weights: &'a [R]) -> Self {
        let (first, rest) = weights.split_at(FIRST);
        let (second, last) = rest.split_at(SECOND);
        Self { first: first.as_chunks().0, second: second.as_chunks().0, last: last.as_chunks().0 }
    }
}

/// W₃ᵀ·relu(W₂ᵀ·relu(W₁ᵀ·x)). Sums run in one order, whatever the processor.
#[inline(always)]
pub(super) fn forward<R: Real>(weights: &[R], input: &[R; INPUTS]) -> Trace<R> {
    let Layers { first, second, last } = Layers::of(weights);
    let first = weighted(first, input).map(rectified);
    let second = weighted(second, &first).map(rectified);
    Trace { out: weighted(last, &second), first, second }
}

/// Gradient of [`forward`].
///
/// * `d_weights`: added to. * returns dL/d(input).
#[inline(always)]
pub(super) fn backward<R: Real>(
    weights: &[R],
    input: &[R; INPUTS],
    trace: &Trace<R>,
    d_out: &[R; OUTPUTS],
    d_weights: &mut [R],
) -> [R; INPUTS] {
    let Layers { first, second, last } = Layers::of(weights);
    let (d_first, d_rest) = d_weights.split_at_mut(FIRST);
    let (d_second, d_last) = d_rest.split_at_mut(SECOND);
    let mut d_hidden = layer_backward(last, &trace.second, d_out, d_last.as_chunks_mut().0);
    cut(&mut d_hidden, &trace.second);
    let mut d_hidden = layer_backward(second, &trace.first, &d_hidden, d_second.as_chunks_mut().0);
    cut(&mut d_hidden, &trace.first);
    layer_backward(first, input, &d_hidden, d_first.as_chunks_mut().0)
}

#[inline(always)]
fn weighted<R: Real, const N: usize>(rows: &[[R; N]], input: &[R]) -> [R; N] {
    let mut out = [R::ZERO; N];
    for (row, x) in rows.iter().zip(input) {
        for i in 0..N {
            out[i] += row[i] * *x;
        }
    }
    out
}

#[inline(always)]
fn layer_backward<R: Real, const IN: usize, const OUT: usize>(
    rows: &[[R; OUT]],
    input: &[R; IN],
    d_out: &[R; OUT],
    d_rows: &mut [[R; OUT]],
) -> [R; IN] {
    let mut d_input = [R::ZERO; IN];
    for (((row, d_row), x), d_x) in rows.iter().zip(d_rows).zip(input).zip(&mut d_input) {
        // Eight sums, so that the loop vectorises in an order of its own choice.
        let mut sums = [R::ZERO; 8];
        for i in 0..OUT {
            d_row[i] += *x * d_out[i];
            sums[i % 8] += row[i] * d_out[i];
        }
        *d_x = sums.into_iter().sum();
    }
    d_input
}

#[inline(always)]
fn rectified<R: Real>(x: R) -> R {
    x.larger(R::ZERO)
}

#[inline(always)]
fn cut<R: Real>(d: &mut [R], values: &[R]) {
    d.iter_mut().zip(values).for_each(|(d, value)| *d = if *value > R::ZERO { *d } else { R::ZERO });
}

#[cfg(test)]
mod tests {
    use pocketsplat_kernels::finite_difference::{assert_piecewise_gradient, random};

    use super::*;

    #[test]
    fn backward_agrees_with_finite_differences() {
        let mut x = random(1, INPUTS + N_WEIGHTS);
        x[INPUTS..].iter_mut().for_each(|w| *w *= 0.3);
        let loss = |x: &[f64]| {
            let (input, weights) = x.split_first_chunk().unwrap();
            let [r, g, b] = forward(weights, input).out;
            r - 0.5 * g + r * b
        };
        let (input, weights) = x.split_first_chunk().unwrap();
        let trace = forward(weights, input);
        let [r, _, b] = trace.out;
        let mut d_weights = vec![0.0; N_WEIGHTS];
        let d_input = backward(weights, input, &trace, &[1.0 + b, -0.5, r], &mut d_weights);
        assert_piecewise_gradient("network", &x, &[&d_input[..], &d_weights].concat(), loss);
    }
}
