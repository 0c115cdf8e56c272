//! Bits of whole anchors under what the context model says of them.

use super::adaptive_step::{EXPONENTS, clamp, clamp_backward};
use super::normal_bits;
use super::taps;
use crate::ops::simd::Level;
use crate::real::Real;
use crate::scene::ModelShape;

/// Least and largest log₂(scale/step): what the coder's tables reach, −32 and 31 eighths of an octave.
pub const LOG2_SCALES: [f64; 2] = [-4.0, 3.875];

/// Rows of the rate loss on their way; kept from call to call.
#[derive(Clone, Debug, Default)]
pub struct Scratch<R> {
    value: Vec<R>,
    mean: Vec<R>,
    log2_scale: Vec<R>,
    bits: Vec<R>,
    /// `[C]`, of the features used: what values leave of the means of their anchor's place.
    residual: Vec<R>,
    d_value: Vec<R>,
    d_log2_scale: Vec<R>,
}

impl<R: Real> Scratch<R> {
    fn resize(&mut self, len: usize) {
        let Self { value, mean, log2_scale, bits, residual, d_value, d_log2_scale } = self;
        for row in [value, mean, log2_scale, bits, residual, d_value, d_log2_scale] {
            row.resize(len, R::ZERO);
        }
    }
}

/// Some anchors and what the context model says of them.
#[derive(Clone, Copy, Debug)]
pub struct Rows<'a, R> {
    /// Widths.
    pub shape: &'a ModelShape,
    /// Of features, log-scales, offsets.
    pub base_steps: [R; 3],
    /// `[n, F]`, `[n, 6]`, `[n, 3K]`, noised or rounded.
    pub values: [&'a [R]; 3],
    /// `[n, K]`.
    pub drawn: &'a [bool],
    /// `[n, 2C + 3]`: means in base steps, log₂(scale/base step), log₂(step/base step) of the three groups.
    pub outputs: &'a [R],
    /// Features that a feature's mean follows at most.
    pub n_taps: usize,
    /// Their weights, see [`taps`].
    pub taps: &'a [R],
}

/// Where gradients go; every array is added to.
#[derive(Debug)]
pub struct Gradients<'a, R> {
    /// As [`Rows::values`].
    pub values: [&'a mut [R]; 3],
    /// As [`Rows::outputs`].
    pub outputs: &'a mut [R],
    /// As [`Rows::taps`].
    pub taps: &'a mut [R],
    /// `[n, K]`: weight times the bits of each drawn offset, which the masks save.
    pub drawn: &'a mut [R],
}

/// Bits of the drawn values of features, log-scales and offsets, and weight times their gradients.
///
/// In units of the step s = base·2^e a value is x = v/s, its mean m·2^−e, its scale 2^(l − e); see [`normal_bits`] for the rest.
/// With m the mean before the taps move it, ∂bits/∂e = −ln 2·(x − m)·∂bits/∂x − ∂bits/∂l. To be called under
/// [`Level::run`](crate::ops::simd::Level::run).
///
/// * `weight`: of one bit in the loss.
#[inline(always)]
pub fn forward_backward<R: Real>(
    rows: &Rows<'_, R>,
    weight: R,
    scratch: &mut Scratch<R>,
    gradients: &mut Gradients<'_, R>,
) -> [f64; 3] {
    let (f, k, n_channels) = (rows.shape.feature_dim, rows.shape.n_offsets, rows.shape.values_per_anchor());
    let n_log_scales = rows.shape.n_log_scales();
    let first_offset = f + n_log_scales;
    // First channel and width of the groups.
    let groups = [(0, f), (f, n_log_scales), (first_offset, 3 * k)];
    let ln_2 = R::real(std::f64::consts::LN_2);
    scratch.resize(n_channels);
    let mut sums = [0.0; 3];
    let outputs = rows.outputs.chunks_exact(2 * n_channels + 3);
    let d_outputs = gradients.outputs.chunks_exact_mut(2 * n_channels + 3);
    for (row, (output, d_output)) in outputs.zip(d_outputs).enumerate() {
        let (means, rest) = output.split_at(n_channels);
        let (log2_scales, exponents) = rest.split_at(n_channels);
        for (group, (first, width)) in groups.into_iter().enumerate() {
            let exponent = clamp(exponents[group], EXPONENTS);
            let per_base = (-(exponent * ln_2)).exp();
            let per_unit = per_base / rows.base_steps[group];
            let values = &rows.values[group][row * width..(row + 1) * width];
            let channels = first..first + width;
            let to = (&mut scratch.value[channels.clone()], &mut scratch.mean[channels.clone()]);
            for i in 0..width {
                to.0[i] = values[i] * per_unit;
                to.1[i] = means[first + i] * per_base;
            }
            for (to, log2_scale) in scratch.log2_scale[channels.clone()].iter_mut().zip(&log2_scales[channels]) {
                *to = clamp(*log2_scale - exponent, LOG2_SCALES);
            }
        }
        // Features come first.
        taps::forward(rows.n_taps, rows.taps, &scratch.value[..f], &mut scratch.mean[..f], &mut scratch.residual[..f]);
        for c in f..n_channels {
            scratch.residual[c] = scratch.value[c] - scratch.mean[c];
        }
        normal_bits::forward_backward(
            &scratch.value,
            &scratch.mean,
            &scratch.log2_scale,
            &mut scratch.bits,
            &mut scratch.d_value,
            &mut scratch.d_log2_scale,
        );
        let drawn = &rows.drawn[row * k..(row + 1) * k];
        for (offset, drawn) in drawn.iter().enumerate() {
            let channels = first_offset + 3 * offset..first_offset + 3 * (offset + 1);
            if *drawn {
                let bits: R = scratch.bits[channels].iter().copied().sum();
                gradients.drawn[row * k + offset] += weight * bits;
            } else {
                scratch.bits[channels.clone()].fill(R::ZERO);
                scratch.d_value[channels.clone()].fill(R::ZERO);
                scratch.d_log2_scale[channels].fill(R::ZERO);
            }
        }
        let Scratch { residual, d_value, .. } = scratch;
        d_value.iter_mut().for_each(|d| *d = weight * *d);
        taps::backward(rows.n_taps, rows.taps, &residual[..f], &mut d_value[..f], gradients.taps);
        let (d_means, rest) = d_output.split_at_mut(n_channels);
        let (d_log2_scales, d_exponents) = rest.split_at_mut(n_channels);
        for (group, (first, width)) in groups.into_iter().enumerate() {
            let exponent = clamp(exponents[group], EXPONENTS);
            let per_base = (-(exponent * ln_2)).exp();
            let per_unit = per_base / rows.base_steps[group];
            let d_values = &mut gradients.values[group][row * width..(row + 1) * width];
            let mut d_exponent = R::ZERO;
            for i in 0..width {
                let c = first + i;
                let d_value = scratch.d_value[c];
                let unclamped = log2_scales[c] - exponent;
                let d_log2_scale = weight * scratch.d_log2_scale[c];
                d_values[i] += d_value * per_unit;
                d_means[c] -= d_value * per_base;
                d_log2_scales[c] += clamp_backward(unclamped, LOG2_SCALES, d_log2_scale);
                // A scale at the end of its range stays there whatever the step.
                let through_scale = if unclamped == scratch.log2_scale[c] { d_log2_scale } else { R::ZERO };
                d_exponent -= ln_2 * d_value * scratch.residual[c] + through_scale;
            }
            d_exponents[group] += clamp_backward(exponents[group], EXPONENTS, d_exponent);
            sums[group] += scratch.bits[first..first + width].iter().map(|b| (*b).into()).sum::<f64>();
        }
    }
    sums
}

/// Bits of the drawn values of features, log-scales and offsets, and of each drawn offset `[n, K]`; no gradients.
pub fn forward<R: Real>(level: Level, rows: &Rows<'_, R>) -> ([f64; 3], Vec<R>) {
    let mut d_values = rows.values.map(|values| vec![R::ZERO; values.len()]);
    let (mut d_outputs, mut of_offsets) = (vec![R::ZERO; rows.outputs.len()], vec![R::ZERO; rows.drawn.len()]);
    let mut d_taps = vec![R::ZERO; rows.taps.len()];
    let mut scratch = Scratch::default();
    let sums = level.run(
        #[inline(always)]
        || {
            let values = d_values.each_mut().map(Vec::as_mut_slice);
            // The gradient of a mask at weight 1 is what it saves.
            let mut unused = Gradients { values, outputs: &mut d_outputs, taps: &mut d_taps, drawn: &mut of_offsets };
            forward_backward(rows, R::ONE, &mut scratch, &mut unused)
        },
    );
    (sums, of_offsets)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::{assert_piecewise_gradient, random};

    const SHAPE: ModelShape = ModelShape { view_colour: true, ..ModelShape::plain(4, 3) };
    const N: usize = 5;
    /// Channels: 4 features, 6 log-scales, 9 offsets.
    const C: usize = 19;

    struct Found {
        bits: [f64; 3],
        gradient: Vec<f64>,
        drawn: Vec<f64>,
    }

    const N_TAPS: usize = 2;
    /// Two of feature 2 and of feature 3, one of feature 1.
    const N_WEIGHTS: usize = 5;

    /// `x`: features, log-scales, offsets, outputs, taps.
    fn run(x: &[f64], drawn: &[bool], weight: f64) -> Found {
        let (features, rest) = x.split_at(N * 4);
        let (log_scales, rest) = rest.split_at(N * 6);
        let (offsets, rest) = rest.split_at(N * 9);
        let (outputs, taps) = rest.split_at(N * (2 * C + 3));
        let rows = Rows {
            shape: &SHAPE,
            base_steps: [1.0, 0.1, 0.2],
            values: [features, log_scales, offsets],
            drawn,
            outputs,
            n_taps: N_TAPS,
            taps,
        };
        let mut gradient = vec![0.0; x.len()];
        let (d_features, rest) = gradient.split_at_mut(N * 4);
        let (d_log_scales, rest) = rest.split_at_mut(N * 6);
        let (d_offsets, rest) = rest.split_at_mut(N * 9);
        let (d_outputs, d_taps) = rest.split_at_mut(N * (2 * C + 3));
        let mut d_drawn = vec![0.0; N * 3];
        let values = [d_features, d_log_scales, d_offsets];
        let mut into = Gradients { values, outputs: d_outputs, taps: d_taps, drawn: &mut d_drawn };
        let bits = forward_backward(&rows, weight, &mut Scratch::default(), &mut into);
        Found { bits, gradient, drawn: d_drawn }
    }

    fn inputs(seed: u64) -> (Vec<f64>, Vec<bool>) {
        let mut x = random(seed, N * C);
        x[..N * 4].iter_mut().for_each(|v| *v *= 3.0);
        x[N * 4..N * 10].iter_mut().for_each(|v| *v *= 0.3);
        x.extend(random(seed + 1, N * (2 * C + 3)).iter().map(|v| 1.5 * v));
        x.extend(random(seed + 3, N_WEIGHTS).iter().map(|v| 0.5 * v));
        (x, random(seed + 2, N * 3).iter().map(|v| *v > -0.4).collect())
    }

    #[test]
    fn backward_agrees_with_finite_differences() {
        for seed in [1, 11, 21] {
            let (mut x, drawn) = inputs(seed);
            // A step and a scale out of their ranges, where the true gradient is 0 and the way back is open.
            let last = x.len() - N_WEIGHTS - 1;
            x[last] = -3.5;
            x[N * C + C + 1] = 9.0;
            let mut found = run(&x, &drawn, 0.7);
            let out = [last, N * C + C + 1];
            assert!(found.gradient[out[1]] >= 0.0, "a scale that is too large is only ever lowered");
            for i in out {
                found.gradient[i] = 0.0;
            }
            assert_piecewise_gradient("anchor bits", &x, &found.gradient, |x| {
                0.7 * run(x, &drawn, 0.7).bits.iter().sum::<f64>()
            });
        }
    }

    #[test]
    fn masks_save_the_bits_of_their_offsets() {
        let (x, drawn) = inputs(5);
        let found = run(&x, &drawn, 1.0);
        assert_eq!(run(&x, &drawn, 0.0).bits, found.bits);
        let saved: f64 = found.drawn.iter().sum();
        assert!((saved - found.bits[2]).abs() < 1e-9);
        for (i, drawn) in drawn.iter().enumerate() {
            assert_eq!(*drawn, found.drawn[i] > 0.0);
            let offset = &found.gradient[N * 10 + 3 * i..N * 10 + 3 * i + 3];
            assert!(*drawn || offset == [0.0; 3], "an offset that is not drawn has no gradient");
        }
    }
}
