//! Adam over all explicit Gaussians, with a rate per group.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::Cloud;
use super::config::CloudRates;
use super::step::CloudGradients;
use crate::train::optimiser::retain_rows;
use pocketsplat_kernels::ops::adam::{self, Moments, Step};
use pocketsplat_kernels::ops::image::spherical_harmonics::MOST;
use pocketsplat_kernels::ops::simd::Level;

/// Gaussians one task updates.
const ROWS: usize = 2048;

/// Numbers of a colour's coefficients.
const COLOUR: usize = 3 * MOST;

/// Marks a Gaussian that the step did not draw.
const UNDRAWN: u32 = u32::MAX;

/// Moments of every parameter; rows as the Gaussians'.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CloudOptimiser {
    /// Steps taken.
    pub n_steps: u32,
    /// `[N, 3]`.
    pub centres: Moments<f32>,
    /// `[N, 3]`.
    pub log_scales: Moments<f32>,
    /// `[N, 4]`.
    pub rotations: Moments<f32>,
    /// `[N]`.
    pub opacity_logits: Moments<f32>,
    /// `[N, 48]`.
    pub harmonics: Moments<f32>,
}

/// One array with its moments.
struct Group<'a> {
    width: usize,
    parameters: &'a mut [f32],
    moments: &'a mut Moments<f32>,
}

impl CloudOptimiser {
    /// Zero moments of `n` Gaussians.
    pub fn new(n: usize) -> Self {
        let mut optimiser = Self::default();
        optimiser.grow(n);
        optimiser
    }

    /// The arrays and what each has of a Gaussian.
    pub(super) fn each_mut(&mut self) -> [(&mut Moments<f32>, usize); 5] {
        [
            (&mut self.centres, 3),
            (&mut self.log_scales, 3),
            (&mut self.rotations, 4),
            (&mut self.opacity_logits, 1),
            (&mut self.harmonics, COLOUR),
        ]
    }

    /// Appends zero moments up to `n` Gaussians in all.
    pub fn grow(&mut self, n: usize) {
        for (moments, width) in self.each_mut() {
            moments.first.resize(n * width, 0.0);
            moments.second.resize(n * width, 0.0);
        }
    }

    /// Drops the moments of Gaussians that `keep` does not mark.
    pub fn retain(&mut self, keep: &[bool]) {
        for (moments, width) in self.each_mut() {
            retain_rows(&mut moments.first, width, keep);
            retain_rows(&mut moments.second, width, keep);
        }
    }

    /// Puts the moments of Gaussian `order[i]` in row `i`.
    pub fn reorder(&mut self, order: &[usize]) {
        for (moments, width) in self.each_mut() {
            for values in [&mut moments.first, &mut moments.second] {
                *values = order.iter().flat_map(|row| &values[row * width..][..width]).copied().collect();
            }
        }
    }

    /// Forgets where opacities were going.
    pub fn forget_opacities(&mut self) {
        self.opacity_logits.first.fill(0.0);
        self.opacity_logits.second.fill(0.0);
    }

    /// Moves every parameter; a Gaussian that was not drawn has gradient 0, and coefficients beyond the degree that is drawn stay.
    ///
    /// * `progress`: share of the rates' path that is behind. * `extent`: of the capture; scales the rate of the centres.
    pub fn apply(
        &mut self,
        level: Level,
        cloud: &mut Cloud<f32>,
        gradients: &CloudGradients<f32>,
        rates: &CloudRates,
        [progress, extent]: [f64; 2],
    ) {
        self.n_steps += 1;
        let t = self.n_steps;
        let step = |rate: f64| Step::new(rate, t);
        let mut row_of = vec![UNDRAWN; cloud.len()];
        for (row, index) in (0u32..).zip(&gradients.drawn) {
            row_of[*index as usize] = row;
        }
        let stored = &gradients.stored;
        let n_drawn = 3 * cloud.degree.n_coefficients();
        let Cloud { centres, log_scales, rotations, opacity_logits, harmonics, .. } = cloud;
        let group = |width, parameters, moments| Group { width, parameters, moments };
        let moved = step(rates.centre.at(progress) * extent);
        group(3, centres.as_flattened_mut(), &mut self.centres).update(level, &row_of, |[p, m, v], row| {
            adam::update(moved, p, m, v, row.map(|row| &stored[row].centre[..]));
        });
        let scaled = step(rates.log_scale.at(progress));
        group(3, log_scales.as_flattened_mut(), &mut self.log_scales).update(level, &row_of, |[p, m, v], row| {
            adam::update(scaled, p, m, v, row.map(|row| &stored[row].log_scale[..]));
        });
        let turned = step(rates.rotation.at(progress));
        group(4, rotations.as_flattened_mut(), &mut self.rotations).update(level, &row_of, |[p, m, v], row| {
            adam::update(turned, p, m, v, row.map(|row| &stored[row].rotation[..]));
        });
        let faded = step(rates.opacity.at(progress));
        group(1, opacity_logits, &mut self.opacity_logits).update(level, &row_of, |[p, m, v], row| {
            adam::update(faded, p, m, v, row.map(|row| std::slice::from_ref(&stored[row].opacity_logit)));
        });
        let (plain, banded) = (step(rates.colour.at(progress)), step(rates.colour.at(progress) / rates.bands_divisor));
        group(COLOUR, harmonics.as_flattened_mut(), &mut self.harmonics).update(level, &row_of, |[p, m, v], row| {
            let gradient = row.map(|row| gradients.harmonics[row].as_flattened());
            let (first, rest) = (gradient.map(|g| &g[..3]), gradient.map(|g| &g[3..n_drawn]));
            adam::update(plain, &mut p[..3], &mut m[..3], &mut v[..3], first);
            adam::update(banded, &mut p[3..n_drawn], &mut m[3..n_drawn], &mut v[3..n_drawn], rest);
        });
    }
}

impl Group<'_> {
    /// Calls `move_row` with parameters, first and second moments of each Gaussian and the row of its gradient.
    #[inline(always)]
    fn update(self, level: Level, row_of: &[u32], move_row: impl Fn([&mut [f32]; 3], Option<usize>) + Sync) {
        let Self { width, parameters, moments, .. } = self;
        let len = ROWS * width;
        let parts = parameters.par_chunks_mut(len).zip(moments.first.par_chunks_mut(len));
        parts.zip(moments.second.par_chunks_mut(len)).zip(row_of.par_chunks(ROWS)).for_each(|(((p, m), v), rows)| {
            level.run(
                #[inline(always)]
                || {
                    let each = p.chunks_exact_mut(width).zip(m.chunks_exact_mut(width)).zip(v.chunks_exact_mut(width));
                    for (((p, m), v), row) in each.zip(rows) {
                        move_row([p, m, v], (*row != UNDRAWN).then_some(*row as usize));
                    }
                },
            );
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_go_where_their_gaussians_go() {
        let mut optimiser = CloudOptimiser::new(3);
        optimiser.centres.first = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0];
        optimiser.opacity_logits.second = vec![5.0, 6.0, 7.0];
        optimiser.reorder(&[2, 0, 1]);
        assert_eq!(optimiser.centres.first, [2.0, 2.0, 2.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
        assert_eq!(optimiser.opacity_logits.second, [7.0, 5.0, 6.0]);
    }
}
