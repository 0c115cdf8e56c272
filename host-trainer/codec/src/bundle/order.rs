//! Which anchors a bundle holds and in which order: tiers by importance, in each the Morton curve, cut into chunks.

use std::ops::Range;

use pocketsplat_format::bundle::MAX_TIERS;

use super::WriteError;
use super::lattice::LatticeFrame;
use pocketsplat_kernels::ops::rate::file_order;
use pocketsplat_kernels::scene::Scene;

/// The anchors of a scene as a bundle holds them.
pub(super) struct Placement {
    pub(super) frame: LatticeFrame,
    /// `[n]` index in the scene, in file order.
    pub(super) order: Vec<usize>,
    /// `[n]` Morton codes, ascending within a tier.
    pub(super) codes: Vec<u64>,
    /// `[n]` bit k is set iff offset k is drawn; at least one is.
    pub(super) drawn: Vec<u32>,
    /// Anchors of each chunk, in file order.
    pub(super) chunks: Vec<Range<usize>>,
    /// `[n_tiers]` chunks up to and with each tier.
    pub(super) tier_chunks: Vec<usize>,
}

impl Placement {
    /// Leaves out anchors without a drawn offset and sorts the others: the more important ones into earlier tiers.
    ///
    /// * `importance`: `[n_anchors]` of the scene; without it there is one tier.
    /// * `pruning_rates`: of the scene that ends with each tier: the share of anchors that it lacks.
    ///
    /// # Errors
    /// [`WriteError::Tiers`], [`WriteError::Length`], [`WriteError::SharedCell`], and those of [`LatticeFrame::of`].
    pub(super) fn of(
        scene: &Scene<f32>,
        importance: Option<&[f32]>,
        pruning_rates: &[f32],
        chunk_anchors: usize,
    ) -> Result<Self, WriteError> {
        let n_offsets = scene.shape.n_offsets;
        // Where anchors follow anchors, the curve must go through their cells one after the other.
        let [_, shift, _] = scene.context.as_ref().and_then(|model| model.shifts).unwrap_or_default();
        let drawn_bits = |anchor: usize| {
            (0..n_offsets).fold(0, |bits, k| bits | (u32::from(scene.anchors.is_drawn(anchor * n_offsets + k)) << k))
        };
        let all_drawn: Vec<u32> = (0..scene.anchors.len()).map(drawn_bits).collect();
        let mut order: Vec<usize> = (0..scene.anchors.len()).filter(|&anchor| all_drawn[anchor] != 0).collect();
        let frame = LatticeFrame::of(&scene.anchors.lattice, &order, shift)?;
        let code = |&anchor: &usize| frame.code(scene.anchors.lattice[anchor]);
        order.sort_by_cached_key(code);
        if let Some(&[first, second]) = order.array_windows().find(|[a, b]| code(a) == code(b)) {
            let cell = scene.anchors.lattice[first];
            return Err(WriteError::SharedCell { anchors: [first, second], cell });
        }
        let tier_ends = match importance {
            None => vec![order.len()],
            Some(importance) => {
                if importance.len() != scene.anchors.len() {
                    let (needed, found) = (scene.anchors.len(), importance.len());
                    return Err(WriteError::Length { array: "importance", needed, found });
                }
                file_order::sort_by_importance(&mut order, importance);
                tier_ends(order.len(), pruning_rates)?
            }
        };
        let (chunks, tier_chunks) = file_order::cut(&mut order, &tier_ends, chunk_anchors, code);
        let codes = order.iter().map(code).collect();
        let drawn = order.iter().map(|&anchor| all_drawn[anchor]).collect();
        Ok(Self { frame, order, codes, drawn, chunks, tier_chunks })
    }
}

/// Checks that pruning rates fall from below 1 to 0, one a tier.
///
/// # Errors
/// [`WriteError::Tiers`].
pub fn check_pruning_rates(pruning_rates: &[f32]) -> Result<(), WriteError> {
    let falling = pruning_rates.iter().is_sorted_by(|a, b| a > b);
    let inside = pruning_rates.iter().all(|rate| (0.0..1.0).contains(rate));
    if pruning_rates.last() != Some(&0.0) || pruning_rates.len() > usize::from(MAX_TIERS) || !falling || !inside {
        return Err(WriteError::Tiers { found: pruning_rates.to_vec(), most: MAX_TIERS.into() });
    }
    Ok(())
}

/// Anchors up to and with each tier.
fn tier_ends(n_anchors: usize, pruning_rates: &[f32]) -> Result<Vec<usize>, WriteError> {
    check_pruning_rates(pruning_rates)?;
    Ok(file_order::tier_ends(n_anchors, pruning_rates))
}

#[cfg(test)]
mod tests {
    use super::tier_ends;

    #[test]
    fn tiers_end_where_their_rates_say() {
        assert_eq!(tier_ends(10, &[0.4, 0.25, 0.0]), Ok(vec![6, 8, 10]), "7.5 rounds up");
        assert_eq!(tier_ends(0, &[0.5, 0.0]), Ok(vec![0, 0]), "no anchors");
    }

    #[test]
    fn rates_must_fall_to_zero() {
        for rates in [&[0.4_f32, 0.5, 0.0][..], &[0.4], &[], &[1.0, 0.0], &[f32::NAN, 0.0], &[0.0; 9]] {
            assert!(tier_ends(10, rates).is_err(), "{rates:?}");
        }
    }
}
