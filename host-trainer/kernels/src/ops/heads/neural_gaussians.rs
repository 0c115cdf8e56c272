//! From head outputs to the Gaussians of a view.

use super::mask;
use crate::real::Real;
use crate::real::per_axis;
use crate::scene::ModelShape;

/// A 3-D Gaussian with one colour, in the world frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Gaussian<R> {
    /// Centre, world frame.
    pub centre: [R; 3],
    /// Standard deviations along its own axes, normalised units.
    pub scale: [R; 3],
    /// Unit quaternion (w, x, y, z).
    pub rotation: [R; 4],
    /// In (0, 1).
    pub opacity: R,
    /// RGB in (0, 1), but for what [`super::detail`] adds.
    pub colour: [R; 3],
}

impl<R: Real> Gaussian<R> {
    /// Adds number by number, as gradients of the same Gaussian add up.
    pub fn add(&mut self, other: &Self) {
        let pairs =
            [(&mut self.centre, &other.centre), (&mut self.scale, &other.scale), (&mut self.colour, &other.colour)];
        for (sum, part) in pairs.into_iter().flat_map(|(sums, parts)| sums.iter_mut().zip(parts)) {
            *sum += *part;
        }
        for (sum, part) in self.rotation.iter_mut().zip(other.rotation) {
            *sum += part;
        }
        self.opacity += other.opacity;
    }
}

/// Where a Gaussian comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Source {
    /// Row of the anchor within its block.
    pub row: u32,
    /// Offset k < K.
    pub offset: u32,
}

/// Quaternions shorter than this are divided by it instead of by their length.
const NORM_FLOOR: f64 = 1e-12;

/// Raw outputs of the three heads over a block of n anchors, or gradients of the same shapes.
#[derive(Clone, Debug, Default)]
pub struct HeadOutputs<R> {
    /// `[n, K]` opacity logits.
    pub opacity: Vec<R>,
    /// `[n, 7K]`: per offset 3 scale logits, 4 quaternion components; `[n, K]` scale logits of isotropic Gaussians.
    pub covariance: Vec<R>,
    /// `[n, 3K]` colour logits.
    pub colour: Vec<R>,
}

impl<R: Real> HeadOutputs<R> {
    /// Makes every array zero and right for `n` anchors.
    pub fn reset(&mut self, shape: &ModelShape, n: usize) {
        let arrays =
            [(&mut self.opacity, 1), (&mut self.covariance, shape.covariance_outputs()), (&mut self.colour, 3)];
        for (array, per_offset) in arrays {
            array.clear();
            array.resize(n * shape.n_offsets * per_offset, R::ZERO);
        }
    }
}

/// Appends the Gaussians of a block of anchors that their mask draws and whose opacity is positive.
///
/// Where they are isotropic there is one scale and no rotation: scale = l_g·sigmoid in all directions.
///
/// α = tanh(logit), kept if α > 0 and the [`mask`] is open; colour = sigmoid; scale = l_g ⊙ sigmoid; rotation = q/‖q‖;
/// centre = x_a + O_k ⊙ l_a (Lu et al. 2024, Scaffold-GS, eqs. 5–8; layouts as [`OutputLayout`](crate::scene::OutputLayout) has them).
///
/// * `positions`: `[n]`. * `log_scales`: `[n, 6]` or `[n, 4]`. * `offsets`: `[n, 3K]`. * `mask_logits`: `[n, K]`.
/// * `gaussians`, `sources`: anchors, then offsets, ascending.
#[expect(clippy::too_many_arguments, reason = "one slice per input and output, as every operation has it")]
#[inline(always)]
pub fn forward<R: Real>(
    shape: &ModelShape,
    positions: &[[R; 3]],
    log_scales: &[R],
    offsets: &[R],
    mask_logits: &[R],
    outputs: &HeadOutputs<R>,
    gaussians: &mut Vec<Gaussian<R>>,
    sources: &mut Vec<Source>,
) {
    let k_all = shape.n_offsets;
    let first = sources.len();
    for row in 0..positions.len() {
        let drawn = (0..k_all).filter(|k| {
            let at = row * k_all + k;
            // What tanh makes of it has the same sign.
            mask::is_open(mask_logits[at]) && outputs.opacity[at] > R::ZERO
        });
        sources.extend(drawn.map(|k| Source { row: index(row), offset: index(k) }));
    }
    let sources = &sources[first..];
    let sigmoids = sigmoids(shape, outputs, sources);
    let mut opacities: Vec<R> =
        sources.iter().map(|s| outputs.opacity[s.row as usize * k_all + s.offset as usize]).collect();
    for opacity in &mut opacities {
        *opacity = opacity.tanh();
    }
    let (mut last, mut l_a, mut l_g) = (None, [R::ZERO; 3], [R::ZERO; 3]);
    for ((source, sigmoids), opacity) in sources.iter().zip(&sigmoids).zip(opacities) {
        let row = source.row as usize;
        let at = row * k_all + source.offset as usize;
        if last != Some(row) {
            last = Some(row);
            let sizes = &log_scales[row * shape.n_log_scales()..][..shape.n_log_scales()];
            l_a = per_axis(|i| sizes[i].exp());
            l_g = if shape.anisotropic { per_axis(|i| sizes[3 + i].exp()) } else { [sizes[3].exp(); 3] };
        }
        let rotation = if shape.anisotropic {
            let raw = quaternion(outputs, at);
            let inverse = R::ONE / length(raw).larger(R::real(NORM_FLOOR));
            raw.map(|q| q * inverse)
        } else {
            [R::ONE, R::ZERO, R::ZERO, R::ZERO]
        };
        let [s0, s1, s2, red, green, blue] = *sigmoids;
        gaussians.push(Gaussian {
            centre: per_axis(|i| positions[row][i] + offsets[at * 3 + i] * l_a[i]),
            scale: [l_g[0] * s0, l_g[1] * s1, l_g[2] * s2],
            rotation,
            opacity,
            colour: [red, green, blue],
        });
    }
}

/// The sigmoids of three scale logits and three colour logits of each source, in one loop that vectorises.
#[inline(always)]
fn sigmoids<R: Real>(shape: &ModelShape, outputs: &HeadOutputs<R>, sources: &[Source]) -> Vec<[R; 6]> {
    let n_outputs = shape.covariance_outputs();
    let logits = sources.iter().map(|source| {
        let at = source.row as usize * shape.n_offsets + source.offset as usize;
        let [c0, c1, c2] = if shape.anisotropic { [0, 1, 2] } else { [0; 3] };
        let (scale, colour) = (&outputs.covariance[at * n_outputs..][..n_outputs], &outputs.colour[at * 3..][..3]);
        [scale[c0], scale[c1], scale[c2], colour[0], colour[1], colour[2]]
    });
    let mut values: Vec<[R; 6]> = logits.collect();
    for value in values.as_flattened_mut() {
        *value = value.sigmoid();
    }
    values
}

/// The raw quaternion of an anisotropic offset.
#[inline(always)]
fn quaternion<R: Real>(outputs: &HeadOutputs<R>, at: usize) -> [R; 4] {
    let cov = &outputs.covariance[at * 7..at * 7 + 7];
    [cov[3], cov[4], cov[5], cov[6]]
}

/// Gradients of [`forward`], given those of the Gaussians it appended.
///
/// The opacity is α·b with b the hard mask, so dL/db = α·dL/d(opacity), which reaches the logit as [`mask::slope`] has it.
///
/// * `d_outputs`, `d_log_scales` `[n, 6]` or `[n, 4]`, `d_offsets` `[n, 3K]`, `d_mask_logits` `[n, K]`: zero on entry, added to.
#[expect(clippy::too_many_arguments, reason = "one slice per input and per gradient, as every operation has it")]
#[inline(always)]
pub fn backward<R: Real>(
    shape: &ModelShape,
    log_scales: &[R],
    offsets: &[R],
    mask_logits: &[R],
    outputs: &HeadOutputs<R>,
    gaussians: &[Gaussian<R>],
    sources: &[Source],
    d_gaussians: &[Gaussian<R>],
    d_outputs: &mut HeadOutputs<R>,
    d_log_scales: &mut [R],
    d_offsets: &mut [R],
    d_mask_logits: &mut [R],
) {
    let (n_log_scales, n_outputs) = (shape.n_log_scales(), shape.covariance_outputs());
    // Not those of the Gaussians, to whose colours others may have added.
    let sigmoids = sigmoids(shape, outputs, sources);
    let place = |source: &Source| source.row as usize * shape.n_offsets + source.offset as usize;
    let mut slopes: Vec<R> = sources.iter().map(|source| mask_logits[place(source)]).collect();
    for slope in &mut slopes {
        *slope = mask::slope(*slope);
    }
    let (mut last, mut sizes) = (None, [R::ZERO; 3]);
    let drawn = gaussians.iter().zip(sources).zip(d_gaussians);
    for (((g, source), d), (sigmoids, slope)) in drawn.zip(sigmoids.iter().zip(slopes)) {
        let (row, at) = (source.row as usize, place(source));
        if last != Some(row) {
            last = Some(row);
            sizes = per_axis(|i| log_scales[row * n_log_scales + i].exp());
        }
        d_outputs.opacity[at] += d.opacity * (R::ONE - g.opacity * g.opacity);
        d_mask_logits[at] += d.opacity * g.opacity * slope;
        for i in 0..3 {
            let colour = sigmoids[3 + i];
            d_outputs.colour[at * 3 + i] += d.colour[i] * colour * (R::ONE - colour);
            // scale = e^s · σ, so ∂/∂s = scale, and ∂/∂logit = scale · (1 − σ); isotropic: all three are one.
            let axis = if shape.anisotropic { i } else { 0 };
            let (log_scale, logit) = (row * n_log_scales + 3 + axis, at * n_outputs + axis);
            d_log_scales[log_scale] += d.scale[i] * g.scale[i];
            d_outputs.covariance[logit] += d.scale[i] * g.scale[i] * (R::ONE - sigmoids[i]);
            d_offsets[at * 3 + i] += d.centre[i] * sizes[i];
            d_log_scales[row * n_log_scales + i] += d.centre[i] * offsets[at * 3 + i] * sizes[i];
        }
        if !shape.anisotropic {
            continue;
        }
        let raw = quaternion(outputs, at);
        let norm = length(raw);
        // Below the floor the division is by a constant, and nothing is projected out.
        let radial = if norm > R::real(NORM_FLOOR) { dot(g.rotation, d.rotation) } else { R::ZERO };
        let inverse = R::ONE / norm.larger(R::real(NORM_FLOOR));
        for i in 0..4 {
            d_outputs.covariance[at * 7 + 3 + i] += (d.rotation[i] - g.rotation[i] * radial) * inverse;
        }
    }
}

fn dot<R: Real>(a: [R; 4], b: [R; 4]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
}

fn length<R: Real>(q: [R; 4]) -> R {
    dot(q, q).sqrt()
}

fn index(i: usize) -> u32 {
    u32::try_from(i).expect("a block holds a few hundred anchors")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::{assert_gradient, random};
    use crate::scene::MASK_THRESHOLD;

    const SHAPE: ModelShape = ModelShape::plain(4, 3);
    const BALLS: ModelShape = ModelShape { anisotropic: false, ..SHAPE };
    const N: usize = 4;

    /// Numbers that decide about a block: outputs of the heads, log-scales, offsets.
    fn n_inputs(shape: &ModelShape) -> usize {
        N * (shape.n_offsets * (7 + shape.covariance_outputs()) + shape.n_log_scales())
    }

    fn parts(g: &Gaussian<f64>) -> [f64; 14] {
        let mut out = [0.0; 14];
        out[..3].copy_from_slice(&g.centre);
        out[3..6].copy_from_slice(&g.scale);
        out[6..10].copy_from_slice(&g.rotation);
        out[10] = g.opacity;
        out[11..].copy_from_slice(&g.colour);
        out
    }

    fn split(shape: &ModelShape, x: &[f64]) -> (HeadOutputs<f64>, Vec<f64>, Vec<f64>) {
        let k = shape.n_offsets;
        let mut rest = x;
        let mut take = |n: usize| {
            let (a, b) = rest.split_at(n);
            rest = b;
            a.to_vec()
        };
        let covariance = N * k * shape.covariance_outputs();
        let outputs = HeadOutputs { opacity: take(N * k), covariance: take(covariance), colour: take(N * 3 * k) };
        (outputs, take(N * shape.n_log_scales()), take(N * 3 * k))
    }

    /// Every fifth offset is masked.
    fn mask_logits() -> Vec<f64> {
        (0..N * SHAPE.n_offsets).map(|i| if i % 5 == 4 { MASK_THRESHOLD } else { i as f64 - 4.0 }).collect()
    }

    fn run(shape: &ModelShape, x: &[f64]) -> (Vec<Gaussian<f64>>, Vec<Source>) {
        let (outputs, log_scales, offsets) = split(shape, x);
        let (mut gaussians, mut sources) = (Vec::new(), Vec::new());
        let positions = [[0.1, 0.2, 0.3]; N];
        let logits = mask_logits();
        forward(shape, &positions, &log_scales, &offsets, &logits, &outputs, &mut gaussians, &mut sources);
        (gaussians, sources)
    }

    #[test]
    fn what_is_masked_is_not_drawn() {
        let mut x = random(3, n_inputs(&SHAPE));
        x[..N * SHAPE.n_offsets].fill(0.5);
        let drawn: Vec<u32> = run(&SHAPE, &x).1.iter().map(|s| s.row * 3 + s.offset).collect();
        assert_eq!(drawn, [0, 1, 2, 3, 5, 6, 7, 8, 10, 11]);
    }

    #[test]
    fn backward_agrees_with_finite_differences() {
        let k = SHAPE.n_offsets;
        for (shape, seed) in [SHAPE, BALLS].iter().flat_map(|shape| (0..6).map(move |seed| (shape, seed))) {
            let mut x = random(seed, n_inputs(shape));
            for logit in &mut x[..N * k] {
                *logit += 0.05 * logit.signum();
            }
            if seed == 4 {
                // Saturated sigmoids and a large base size.
                x[N * k..N * k + 3].copy_from_slice(&[30.0, -30.0, 8.0]);
                x[N * k * (4 + shape.covariance_outputs()) + 3] = 3.0;
            }
            if seed == 5 && shape.anisotropic {
                // A quaternion a thousand times shorter than the others.
                for q in &mut x[N * k + 3..N * k + 7] {
                    *q *= 1e-3;
                }
            }
            let (gaussians, sources) = run(shape, &x);
            let weights = random(seed + 50, gaussians.len() * 14);
            let f = |x: &[f64]| run(shape, x).0.iter().flat_map(parts).zip(&weights).map(|(p, w)| p * w).sum::<f64>();
            let d: Vec<Gaussian<f64>> = weights
                .chunks_exact(14)
                .map(|w| Gaussian {
                    centre: [w[0], w[1], w[2]],
                    scale: [w[3], w[4], w[5]],
                    rotation: [w[6], w[7], w[8], w[9]],
                    opacity: w[10],
                    colour: [w[11], w[12], w[13]],
                })
                .collect();
            let (outputs, log_scales, offsets) = split(shape, &x);
            let mut d_outputs = HeadOutputs::default();
            d_outputs.reset(shape, N);
            let (mut d_log_scales, mut d_offsets) = (vec![0.0; log_scales.len()], vec![0.0; offsets.len()]);
            let (logits, mut d_mask_logits) = (mask_logits(), vec![0.0; N * k]);
            backward(
                shape,
                &log_scales,
                &offsets,
                &logits,
                &outputs,
                &gaussians,
                &sources,
                &d,
                &mut d_outputs,
                &mut d_log_scales,
                &mut d_offsets,
                &mut d_mask_logits,
            );
            // The mask stands for a factor 1 + σ(m) − σ(m₀) of the opacity.
            let mut expected = vec![0.0; N * k];
            for ((gaussian, source), d) in gaussians.iter().zip(&sources).zip(&d) {
                let at = (source.row * 3 + source.offset) as usize;
                expected[at] = d.opacity * gaussian.opacity * mask::slope(logits[at]);
            }
            assert_eq!(d_mask_logits, expected);
            let analytic =
                [d_outputs.opacity, d_outputs.covariance, d_outputs.colour, d_log_scales, d_offsets].concat();
            assert_gradient("neural gaussians", &x, &analytic, f);
        }
    }

    #[test]
    fn isotropic_gaussians_reach_equally_far_in_every_direction() {
        let x = random(9, n_inputs(&BALLS));
        let (gaussians, sources) = run(&BALLS, &x);
        let (outputs, log_scales, _) = split(&BALLS, &x);
        assert!(!gaussians.is_empty());
        for (gaussian, source) in gaussians.iter().zip(sources) {
            let at = (source.row * 3 + source.offset) as usize;
            let deviation = log_scales[source.row as usize * 4 + 3].exp() * outputs.covariance[at].sigmoid();
            assert_eq!((gaussian.scale, gaussian.rotation), ([deviation; 3], [1.0, 0.0, 0.0, 0.0]));
        }
    }

    #[test]
    fn a_zero_quaternion_gives_no_infinity() {
        let mut x = vec![0.5; n_inputs(&SHAPE)];
        let k = SHAPE.n_offsets;
        x[N * k..N * k * 8].fill(0.0);
        let (gaussians, _) = run(&SHAPE, &x);
        assert!(gaussians.iter().all(|g| parts(g).iter().all(|p| p.is_finite())));
    }
}
