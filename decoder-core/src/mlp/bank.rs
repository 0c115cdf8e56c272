//! The feature bank: an anchor's feature at three resolutions, mixed by weights that follow from where it is seen from.

use super::head::Head;
use super::numbers::TwoLayers;
use crate::arena::Arena;
use crate::arithmetic::{F32, Functions};
use crate::bundle::{BANK_INPUTS, BANK_WEIGHTS, HeadView, WeightReader};
use crate::error::DecodeError;

/// The head that weighs the resolutions: in f32 whatever the others are in, because it is small and all of them follow from it.
pub(crate) struct Bank<'s>(Head<'s, f32, BANK_WEIGHTS>);

impl<'s> Bank<'s> {
    pub(super) fn convert(
        arena: &mut Arena<'s>,
        head: &HeadView<'_>,
        weights: &mut WeightReader<'_>,
    ) -> Result<Self, DecodeError> {
        Ok(Self(Head::converted(arena, head, weights)?))
    }

    /// softmax(W2·relu(W1·[direction, distance] + b1) + b2); the largest logit is taken off first, so that none overflows.
    ///
    /// * `hidden`: at least F floats.
    pub(crate) fn weights<F: Functions>(
        &self,
        seen_from: [f32; BANK_INPUTS],
        hidden: &mut [f32],
    ) -> [f32; BANK_WEIGHTS] {
        let units = TwoLayers::<F32, BANK_WEIGHTS>::activate(&self.0, &seen_from, hidden);
        let logits = self.0.outputs(0, units).unwrap_or_default();
        let mut largest = f32::NEG_INFINITY;
        for logit in logits {
            largest = if logit > largest { logit } else { largest };
        }
        let [e0, e1, e2] = logits.map(|logit| F::exp(logit - largest));
        let sum = e0 + e1 + e2;
        [e0 / sum, e1 / sum, e2 / sum]
    }
}

/// f'ᵢ = w₀·f₄₍ᵢ mod F/4₎ + w₁·f₂₍ᵢ mod F/2₎ + w₂·fᵢ, the whole shortened vectors repeated.
///
/// * `feature`: `[F]`, F divisible by 4. * `mixed`: its first F are overwritten.
pub(crate) fn mix([w0, w1, w2]: [f32; BANK_WEIGHTS], feature: &[f32], mixed: &mut [f32]) {
    let quarter = feature.iter().step_by(4).cycle();
    let half = feature.iter().step_by(2).cycle();
    for (((mixed, whole), half), quarter) in mixed.iter_mut().zip(feature).zip(half).zip(quarter) {
        *mixed = w0 * quarter + w1 * half + w2 * whole;
    }
}

#[cfg(test)]
mod tests {
    use super::mix;

    #[test]
    fn shortened_features_are_repeated_as_a_whole() {
        let feature = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
        let mixed = |weights| {
            let mut mixed = [9.0; 9];
            mix(weights, &feature, &mut mixed);
            assert_eq!(mixed[8], 9.0, "nothing behind the feature");
            mixed[..8].to_vec()
        };
        assert_eq!(mixed([0.0, 0.0, 1.0]), feature, "all weight on the whole feature leaves it");
        assert_eq!(mixed([1.0, 0.0, 0.0]), [0.0, 4.0, 0.0, 4.0, 0.0, 4.0, 0.0, 4.0]);
        assert_eq!(mixed([0.0, 1.0, 0.0]), [0.0, 2.0, 4.0, 6.0, 0.0, 2.0, 4.0, 6.0]);
        assert_eq!(mixed([0.5, 0.25, 0.25])[1], 2.0 + 0.5 + 0.25);
    }
}
