//! The field of the colours: what a place looks like from a direction, and how it learns.
//!
//! What the network gives is a coefficient of degree 0, of which a colour is max(0, ½ + Y₀·c), as the paper has it.

use pocketsplat_format::context::GridLevel;
use pocketsplat_kernels::ops::adam::{self, Moments, Step};
use pocketsplat_kernels::ops::simd::Level;
use pocketsplat_kernels::real::Real;
use pocketsplat_trainer::explicit::step::CloudGradients;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::grid::{self, CHANNELS, FEATURES, contracted};
use super::network::{self, INPUTS, N_WEIGHTS};

/// Gaussians of one task; gradients are summed task by task, so that they do not depend on the number of threads.
const BLOCK: usize = 256;

/// Values of an array that are moved by one task.
const MOVED: usize = 1 << 16;

/// Rows of the grid start within ± so much (Müller et al. 2022, section 4).
const START: f64 = 1e-4;

/// The field.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Field<R> {
    pub(super) levels: Vec<GridLevel>,
    /// Of all levels.
    pub(super) rows: Vec<[R; CHANNELS]>,
    pub(super) weights: Vec<R>,
}

/// Moments of a field.
pub(super) struct FieldOptimiser {
    n_steps: u32,
    rows: Moments<f32>,
    weights: Moments<f32>,
}

/// Gradients of a field.
pub(super) struct FieldGradients<R> {
    rows: Vec<[R; CHANNELS]>,
    pub(super) weights: Vec<R>,
}

impl Field<f32> {
    /// Small rows, and weights as wide as suits rectified units: U(±√(6/inputs)) (He et al. 2015).
    #[expect(clippy::cast_possible_truncation, reason = "single precision")]
    pub(super) fn new(log2_rows: u8, rng: &mut ChaCha8Rng) -> Self {
        let levels = grid::levels(log2_rows);
        let mut within = |most: f64| rng.random_range(-most..most) as f32;
        let rows = (0..grid::n_rows(&levels)).map(|_| [(); CHANNELS].map(|()| within(START))).collect();
        let n_inputs = |i: usize| if i < network::FIRST { INPUTS } else { network::HIDDEN };
        let weights = (0..N_WEIGHTS).map(|i| within((6.0 / n_inputs(i) as f64).sqrt())).collect();
        Self { levels, rows, weights }
    }
}

impl<R: Real> Field<R> {
    /// The coefficients `[N]` of degree 0 that a camera sees.
    pub(super) fn seen(&self, level: Level, centres: &[[R; 3]], eye: [R; 3]) -> Vec<[R; 3]> {
        let mut seen = vec![[R::ZERO; 3]; centres.len()];
        seen.par_chunks_mut(BLOCK).zip(centres.par_chunks(BLOCK)).for_each(|(seen, centres)| {
            level.run(
                #[inline(always)]
                || {
                    for (out, centre) in seen.iter_mut().zip(centres) {
                        *out = network::forward(&self.weights, &self.input(*centre, eye)).out;
                    }
                },
            );
        });
        seen
    }

    /// Gradients of [`Self::seen`]; places have none by way of their colours.
    ///
    /// * `d_seen`: of the Gaussians `drawn`, with respect to their coefficients.
    pub(super) fn backward(
        &self,
        level: Level,
        centres: &[[R; 3]],
        eye: [R; 3],
        drawn: &[u32],
        d_seen: &[[R; 3]],
    ) -> FieldGradients<R> {
        let mut d_features = vec![[R::ZERO; FEATURES]; drawn.len()];
        let tasks = d_features.par_chunks_mut(BLOCK).zip(drawn.par_chunks(BLOCK)).zip(d_seen.par_chunks(BLOCK));
        let parts: Vec<Vec<R>> = tasks
            .map(|((d_features, drawn), d_seen)| {
                let mut d_weights = vec![R::ZERO; N_WEIGHTS];
                level.run(
                    #[inline(always)]
                    || {
                        for ((d_features, index), d_out) in d_features.iter_mut().zip(drawn).zip(d_seen) {
                            let input = self.input(centres[*index as usize], eye);
                            let trace = network::forward(&self.weights, &input);
                            let d = network::backward(&self.weights, &input, &trace, d_out, &mut d_weights);
                            d_features.copy_from_slice(&d[..FEATURES]);
                        }
                    },
                );
                d_weights
            })
            .collect();
        let mut weights = vec![R::ZERO; N_WEIGHTS];
        parts.iter().for_each(|part| weights.iter_mut().zip(part).for_each(|(sum, d)| *sum += *d));
        let mut rows = vec![[R::ZERO; CHANNELS]; self.rows.len()];
        let units: Vec<_> = drawn.iter().map(|index| unit(centres[*index as usize])).collect();
        grid::backward(&self.levels, &units, &d_features, &mut rows);
        FieldGradients { rows, weights }
    }

    #[inline(always)]
    fn input(&self, centre: [R; 3], eye: [R; 3]) -> [R; INPUTS] {
        let v = [centre[0] - eye[0], centre[1] - eye[1], centre[2] - eye[2]];
        let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt().larger(R::real(1e-12));
        input(&grid::features(&self.levels, &self.rows, unit(centre)), v.map(|v| v / length))
    }
}

/// What goes into the network.
#[inline(always)]
pub(super) fn input<R: Real>(features: &[R; FEATURES], [x, y, z]: [R; 3]) -> [R; INPUTS] {
    let mut input = [R::ONE; INPUTS];
    input[..FEATURES].copy_from_slice(features);
    input[FEATURES..FEATURES + 3].copy_from_slice(&[x, y, z]);
    input
}

#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "the grid's places are coarser")]
fn unit<R: Real>(centre: [R; 3]) -> [u16; 3] {
    contracted(centre.map(|x| Into::<f64>::into(x) as f32))
}

impl FieldOptimiser {
    pub(super) fn new(field: &Field<f32>) -> Self {
        let rows = Moments::zeros(field.rows.as_flattened().len());
        Self { n_steps: 0, rows, weights: Moments::zeros(field.weights.len()) }
    }

    /// Moves the field.
    pub(super) fn apply(&mut self, level: Level, field: &mut Field<f32>, gradients: &FieldGradients<f32>, rate: f64) {
        self.apply_to_weights(field, gradients, rate);
        let step = Step::new(rate, self.n_steps);
        let Moments { first, second } = &mut self.rows;
        let parts = field.rows.as_flattened_mut().par_chunks_mut(MOVED).zip(first.par_chunks_mut(MOVED));
        let parts = parts.zip(second.par_chunks_mut(MOVED)).zip(gradients.rows.as_flattened().par_chunks(MOVED));
        parts.for_each(|(((p, m), v), d)| {
            level.run(
                #[inline(always)]
                || adam::update(step, p, m, v, Some(d)),
            );
        });
    }

    /// Moves the network alone.
    pub(super) fn apply_to_weights(&mut self, field: &mut Field<f32>, gradients: &FieldGradients<f32>, rate: f64) {
        self.n_steps += 1;
        let Moments { first, second } = &mut self.weights;
        adam::update(Step::new(rate, self.n_steps), &mut field.weights, first, second, Some(&gradients.weights));
    }
}

/// Gradients of the coefficients of degree 0 of those that were drawn.
pub(super) fn of_colours(gradients: &CloudGradients<f32>) -> Vec<[f32; 3]> {
    gradients.harmonics.iter().map(|d| d[0]).collect()
}

#[cfg(test)]
mod tests {
    use pocketsplat_format::context::LevelKind;
    use pocketsplat_kernels::finite_difference::{assert_piecewise_gradient, random};

    use super::*;

    #[test]
    fn backward_agrees_with_finite_differences() {
        let levels = vec![GridLevel { kind: LevelKind::Volume, resolution: 30, n_rows: 8 }; 16];
        let n = CHANNELS * 8 * 16;
        let centres: Vec<[f64; 3]> = random(1, 9).as_chunks().0.to_vec();
        let (eye, w) = ([0.3, -2.0, 0.1], random(2, 9));
        let of = |x: &[f64]| {
            let (rows, weights) = x.split_at(n);
            Field { levels: levels.clone(), rows: rows.as_chunks().0.to_vec(), weights: weights.to_vec() }
        };
        let mut x = random(3, n + N_WEIGHTS);
        x[n..].iter_mut().for_each(|w| *w *= 0.3);
        // The second of the three is not drawn.
        let loss = |x: &[f64]| {
            let seen = of(x).seen(Level::detect(), &centres, eye);
            [0, 2].iter().map(|i| (0..3).map(|c| w[3 * i + c] * seen[*i][c]).sum::<f64>()).sum::<f64>()
        };
        let d_seen = [[w[0], w[1], w[2]], [w[6], w[7], w[8]]];
        let found = of(&x).backward(Level::detect(), &centres, eye, &[0, 2], &d_seen);
        let analytic = [found.rows.as_flattened(), &found.weights].concat();
        // A sample of the weights: each asks for four passes.
        let chosen: Vec<usize> = (0..n).chain((n..x.len()).step_by(37)).collect();
        let at = |part: &[f64]| {
            let mut whole = x.clone();
            chosen.iter().zip(part).for_each(|(i, value)| whole[*i] = *value);
            loss(&whole)
        };
        let pick = |values: &[f64]| chosen.iter().map(|i| values[*i]).collect::<Vec<_>>();
        assert_piecewise_gradient("field", &pick(&x), &pick(&analytic), at);
    }
}
