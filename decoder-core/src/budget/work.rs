//! What a frame costs in time, as counts that no clock is needed for.

use pocketsplat_format::Bundle;
use pocketsplat_format::bundle::{Coder, TierMeasures};
use pocketsplat_format::context::first_tap;

use super::limits::Budget;
use super::shape::{Resident, ScratchShape};

/// What a symbol takes in multiply-adds of f32, of which each takes 2.5 instructions on a Cortex-M4; a symbol takes 64.
const SYMBOL_MACS: usize = 26;
/// The same of a multiply-add of the context's network: 4.8 instructions.
const NETWORK_MACS: usize = 2;
/// The same of one of its inputs: 82 instructions for its share of a grid level's corners.
const INPUT_MACS: usize = 33;

/// Work of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Work {
    /// Multiply-adds of the heads.
    pub head_macs: u64,
    /// Anchors decoded from the bundle.
    pub decoded_anchors: u64,
    /// Pairs of a pixel and a splat evaluated for it.
    pub pixel_splats: u64,
}

impl Work {
    /// A bound on the work of the views that `measures` were taken over, at the budget's size.
    ///
    /// Each strip, or slab of one, may go over the whole scene. A frame smaller than those measured counts as one of their size.
    pub(super) fn most(
        measures: &TierMeasures,
        training_px: [u16; 2],
        budget: &Budget,
        passes: u64,
        shape: &ScratchShape,
    ) -> Self {
        let sides = [budget.width_px, budget.height_px].into_iter().zip(training_px);
        let area = |[width, height]: [u16; 2]| u32::from(width).saturating_mul(height.into());
        let is_larger = area([budget.width_px, budget.height_px]) > area(training_px);
        // In 1024ths, each side by itself: a division of 64 bits would link a kilobyte of text.
        let larger = sides.fold(u64::from(measures.max_kilo_pixels), |pixels, (planned, measured)| {
            pixels.saturating_mul((u32::from(planned) << 10).div_ceil(u32::from(measured).max(1)).into())
        });
        let pixels = u64::from(measures.max_kilo_pixels).saturating_mul(1024);
        let anchors = if shape.resident == Resident::Nothing { measures.max_decoded_anchors } else { 0 };
        let kilo_macs = if shape.resident.is_gaussians() { 0 } else { measures.max_head_kilo_macs };
        Self {
            head_macs: shape.evaluated_macs(u64::from(kilo_macs).saturating_mul(1024)).saturating_mul(passes),
            decoded_anchors: u64::from(anchors).saturating_mul(passes),
            pixel_splats: with_last_bits(if is_larger { larger.div_ceil(1024) } else { pixels }),
        }
    }
}

/// So many measured pixel evaluations and a 256th more, for the ellipses of two renderers that differ in the last bits.
fn with_last_bits(pixels: u64) -> u64 {
    pixels.saturating_add(pixels >> 8)
}

/// Multiply-adds that decoding an anchor is worth.
// Not inlined, for its size: of `Planner::variant`.
#[inline(never)]
pub(super) fn decoding_macs(bundle: &Bundle<'_>) -> u64 {
    let n_channels = bundle.header().n_channels();
    let symbols = n_channels.saturating_mul(SYMBOL_MACS);
    let macs = match bundle.coder() {
        Coder::Static(_) => symbols,
        Coder::Context(context) => {
            let [inputs, hidden] = [context.n_inputs(), context.n_hidden()];
            let layers = hidden.saturating_mul(inputs.saturating_add(context.n_outputs()));
            let taps = first_tap(context.feature_dim(), context.n_taps());
            // Inputs that are another anchor's values are there.
            let looked_up = if context.level_shifts().is_some() { 0 } else { inputs };
            let grid = looked_up.saturating_mul(INPUT_MACS);
            symbols.saturating_add(layers.saturating_add(taps).saturating_mul(NETWORK_MACS)).saturating_add(grid)
        }
    };
    macs as u64
}
