//! What a view's rate comes to in the loss.

use pocketsplat_format::context::N_GROUPS;

use super::super::scene::DeviceScene;
use super::super::{Asked, Gpu};
use super::GpuCoding;
use pocketsplat_kernels::ops::rate::grid_bits;
use pocketsplat_kernels::step::coding::{RateReport, RateTerms};

/// Weights of a step's rate terms; see `step/context.rs`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Weights {
    pub(super) bit: f64,
    pub(super) mask: f64,
    pub(super) grid: f64,
}

impl Weights {
    /// * `n_of_view`, `n_drawn`: anchors of the view, and those of the scene that are drawn at all.
    pub(super) fn of(
        terms: &RateTerms,
        scene: &DeviceScene,
        [n_anchors, n_of_view, n_drawn, n_sampled]: [usize; 4],
    ) -> Self {
        let n_values = (n_anchors.max(1) * scene.shape.values_per_anchor()) as f64;
        Self {
            bit: terms.lambda * n_drawn as f64 / (n_values * n_sampled.max(1) as f64),
            mask: terms.mask / (n_of_view * scene.shape.n_offsets).max(1) as f64,
            grid: terms.lambda * terms.grid / n_values,
        }
    }
}

/// What a view's rate came to.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Rate {
    /// The terms of the loss.
    pub(in super::super) term: f32,
    pub(in super::super) report: RateReport,
}

impl GpuCoding {
    /// Asks for the number of the grid's values that are not negative.
    pub(in super::super) fn ask_positive(&self, gpu: &Gpu) -> Asked<u32> {
        self.grid_bits.n_positive.ask(gpu)
    }

    /// What the sums say of the rate.
    ///
    /// * `totals`: the [`N_RATE_TOTALS`](super::N_RATE_TOTALS) that [`Self::backward`] wrote. * `n_positive`: one number, as
    ///   [`Self::ask_positive`] gives it.
    pub(in super::super) fn rate(&self, scene: &DeviceScene, totals: &[f32], n_positive: &[u32]) -> Rate {
        let Weights { bit, mask, grid } = self.weights;
        let context = scene.context.as_ref().expect("asked before");
        let mut bits = [0.0; N_GROUPS];
        for of_network in totals[1..].chunks_exact(N_GROUPS).take(context.networks.len()) {
            for (sum, bits) in bits.iter_mut().zip(of_network) {
                *sum += f64::from(*bits);
            }
        }
        let mut term = mask * f64::from(totals[0]) + bit * bits.iter().sum::<f64>();
        if let Some(of_context) = context.grid.as_ref().filter(|_| grid > 0.0) {
            term += grid * grid_bits::bits(of_context.rows.values.len(), n_positive[0] as usize);
        }
        let n_sampled = self.n_sampled;
        #[expect(clippy::cast_possible_truncation, reason = "a term of the loss")]
        let term = term as f32;
        Rate { term, report: RateReport { n_sampled, bits: bits.map(|bits| bits / n_sampled.max(1) as f64) } }
    }
}
