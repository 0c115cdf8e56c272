//! The detail head: what is added to a Gaussian's colour, its first layer split into a part per anchor and one per Gaussian.

use pocketsplat_format::DecodeError;
use pocketsplat_format::bundle::{HeadView, WeightReader};

use super::block::HeadWeights;
use super::head::Head;
use crate::arena::Arena;

/// `W2·relu(W1·[feature, colour] + b1) + b2`.
///
/// Inputs are taken in ascending order, so the sums over the feature are the same for all Gaussians of an anchor.
#[derive(Clone, Copy)]
pub(crate) struct Detail<'s> {
    // In f32 whatever the other heads are kept in: what it reads of them comes from their outputs.
    head: Head<'s, 3>,
    feature_dim: usize,
}

impl<'s> Detail<'s> {
    pub(super) fn convert(
        arena: &mut Arena<'s>,
        head: &HeadView<'_>,
        weights: &mut WeightReader<'_>,
    ) -> Result<Self, DecodeError> {
        let feature_dim = head.n_in.saturating_sub(3);
        Ok(Self { feature_dim, head: Head::convert(arena, HeadWeights::F32, head, weights)? })
    }

    /// The part per anchor: fills `sums` with `b1 + W1·feature`.
    ///
    /// * `sums`: [`sums_len`](super::HeadShape::sums_len) floats.
    pub(crate) fn begin(&self, feature: &[f32], sums: &mut [f32]) {
        self.head.hidden.begin(feature, sums);
    }

    /// The part per Gaussian: what is added to `colour`.
    ///
    /// * `sums`: as [`Self::begin`] left them. * `hidden`: at least as many floats.
    pub(crate) fn residual(&self, colour: [f32; 3], sums: &[f32], hidden: &mut [f32]) -> [f32; 3] {
        self.head.hidden.go_on(sums, self.feature_dim, &colour, hidden);
        let hidden = hidden.get(..self.head.hidden.n_units).unwrap_or_default();
        self.head.output.outputs(0, hidden).unwrap_or_default()
    }
}
