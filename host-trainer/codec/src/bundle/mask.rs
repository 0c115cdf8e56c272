//! Which offsets of an anchor are drawn.

use pocketsplat_format::entropy::{self, FREQUENCY_TOTAL, N_MASK_CONTEXTS, Slot};

use super::stream::{Part, SlotList};

/// How often each offset is drawn, given how many before it are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct MaskModelDraft {
    /// `[K, N_MASK_CONTEXTS]` frequency of "drawn", which owns the lowest slots, as bytes.
    offsets: Vec<[[u8; 2]; N_MASK_CONTEXTS]>,
}

/// The masks of an anchor in order, each with its context.
fn with_contexts(drawn: u32, n_offsets: usize) -> impl Iterator<Item = (usize, usize, bool)> {
    (0..n_offsets).map(move |k| {
        let before = drawn & ((1 << k) - 1);
        (k, (before.count_ones() as usize).min(N_MASK_CONTEXTS - 1), (drawn >> k) & 1 == 1)
    })
}

impl MaskModelDraft {
    /// Counts the masks of all anchors; bit k of `drawn` is set iff offset k is drawn.
    pub(super) fn count(drawn: &[u32], n_offsets: usize) -> Self {
        let mut counts = vec![[[0_u64; 2]; N_MASK_CONTEXTS]; n_offsets];
        for &drawn in drawn {
            for (k, context, is_drawn) in with_contexts(drawn, n_offsets) {
                counts[k][context][usize::from(is_drawn)] += 1;
            }
        }
        let frequency = |[hidden, drawn]: [u64; 2]| {
            let total = hidden + drawn;
            let share = if total == 0 { 0.5 } else { drawn as f64 / total as f64 };
            // Both outcomes stay possible, so that any set of masks can be coded.
            (share * f64::from(FREQUENCY_TOTAL)).round().clamp(1.0, f64::from(FREQUENCY_TOTAL - 1)) as u16
        };
        let bytes = |counts| u16::to_le_bytes(frequency(counts));
        Self { offsets: counts.iter().map(|contexts| contexts.map(bytes)).collect() }
    }

    /// The model of a bundle.
    pub(super) fn of(masks: &entropy::MaskModel<'_>) -> Self {
        Self { offsets: masks.offsets().to_vec() }
    }

    /// The model as the decoder has it.
    pub(super) fn view(&self) -> entropy::MaskModel<'_> {
        entropy::MaskModel::new(&self.offsets)
    }

    /// Appends the slots of an anchor's masks.
    pub(super) fn push(&self, drawn: u32, list: &mut SlotList) {
        let model = self.view();
        for (k, context, is_drawn) in with_contexts(drawn, model.n_offsets()) {
            let end = model.frequency(k, context).unwrap_or_default();
            let (start, end) = if is_drawn { (0, end) } else { (end, FREQUENCY_TOTAL) };
            list.push(Part::Mask, &Slot { symbol: (), start, frequency: end - start });
        }
    }
}
