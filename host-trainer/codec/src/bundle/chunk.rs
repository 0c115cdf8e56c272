//! One chunk: the slots of its anchors, one after the other.

use pocketsplat_format::Bundle;
use pocketsplat_format::bundle::Coder;

use super::channel_coder::ChannelCoder;
use super::channels::ContextWork;
use super::decoded::shape_of;
use super::lattice::{LatticeModelDraft, Walk};
use super::mask::MaskModelDraft;
use super::stream::SlotList;
use super::table::TableSet;
use pocketsplat_kernels::scene::ModelShape;

/// Everything that gives symbols their frequencies.
pub(super) struct Models<'c> {
    pub(super) shape: ModelShape,
    pub(super) lattice: LatticeModelDraft,
    /// Absent when every offset of every anchor is drawn.
    pub(super) masks: Option<MaskModelDraft>,
    pub(super) channels: ChannelCoder<'c>,
}

/// The anchors of a chunk as integers.
#[derive(Clone, Copy)]
pub(super) struct ChunkRows<'r> {
    /// `[n]` lattice cells in ascending order of their Morton codes.
    pub(super) lattice: &'r [[i32; 3]],
    /// `[n]` bit k is set iff offset k is drawn.
    pub(super) drawn: &'r [u32],
    /// `[n, n_channels]`.
    pub(super) symbols: &'r [i16],
}

impl<'b> Models<'b> {
    /// The models of a bundle, to code it once more.
    pub(super) fn of(bundle: &Bundle<'b>) -> Self {
        Self {
            shape: shape_of(bundle),
            lattice: LatticeModelDraft::of(bundle.lattice()),
            masks: bundle.masks().map(MaskModelDraft::of),
            channels: match bundle.coder() {
                Coder::Static(tables) => ChannelCoder::Tables(TableSet::of(tables)),
                Coder::Context(context) => ChannelCoder::Context(*context),
            },
        }
    }
}

impl<'c> Models<'c> {
    /// The slots of a chunk in reading order: of each anchor position, masks, channels.
    pub(super) fn slots(&self, rows: ChunkRows<'_>) -> SlotList {
        let codes: Vec<u64> = rows.lattice.iter().map(|&cell| self.lattice.frame.code(cell)).collect();
        let mut walk = Walk::new(&self.lattice.frame, &codes);
        let mut work = ContextWork::default();
        let mut list = SlotList::default();
        let symbols = rows.symbols.chunks(self.shape.values_per_anchor());
        for (anchor, ((&lattice, &drawn), symbols)) in rows.lattice.iter().zip(rows.drawn).zip(symbols).enumerate() {
            self.lattice.push(&mut walk, anchor, &mut list);
            if let Some(masks) = &self.masks {
                masks.push(drawn, &mut list);
            }
            self.channels.push(&mut work, &self.shape, lattice, drawn, symbols, &mut list);
        }
        list
    }
}
