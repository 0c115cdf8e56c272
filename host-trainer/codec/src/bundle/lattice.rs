//! Positions: the lattice cells of a chunk as a binary trie over their Morton codes.
//!
//! The trie is walked depth first, 0 before 1, and each inner node says which children it has. That takes 9 to 13 bits an
//! anchor on trained scenes, where packed coordinates take 20 and more. The idea of coding occupancy by depth is that of
//! octrees (Meagher 1982); one bit at a time needs three symbols instead of 255, and learns as much from its ancestors.

use pocketsplat_format::bundle::{Lattice, MAX_LATTICE_BITS, MAX_LATTICE_MIN};
use pocketsplat_format::entropy::{Children, FREQUENCY_TOTAL, N_TRIE_CONTEXTS, Slot, TrieModel};

use super::WriteError;
use super::frequencies::frequencies;
use super::stream::{Part, SlotList};
use pocketsplat_kernels::ops::rate::file_order;

/// The bit of the root in a set of levels.
const TOP_LEVEL: u64 = 1 << 63;
/// Ancestors of a node that its context looks at.
const N_ANCESTORS: u32 = 3;

/// Where Morton codes count from, and how long they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct LatticeFrame {
    pub(super) min: [i32; 3],
    pub(super) bits_per_axis: u32,
}

/// A node as its children are coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Node {
    /// Its depth; the root has 0.
    level: usize,
    context: usize,
    children: Children,
}

/// How often nodes of each level and context have which children.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct LatticeModelDraft {
    pub(super) frame: LatticeFrame,
    /// `[3·bits_per_axis, N_TRIE_CONTEXTS]` ends of the slots of "both" and of "only 0", as bytes; "only 1" has the rest.
    levels: Vec<[[[u8; 2]; 2]; N_TRIE_CONTEXTS]>,
}

impl LatticeFrame {
    /// The smallest frame of the cells of `anchors` whose lowest corner is a multiple of 2^shift.
    ///
    /// * `cells`: `[n_anchors]` of the scene.
    ///
    /// # Errors
    /// [`WriteError::BeyondLattice`] and [`WriteError::LatticeTooWide`].
    pub(super) fn of(cells: &[[i32; 3]], anchors: &[usize], shift: u8) -> Result<Self, WriteError> {
        for &anchor in anchors {
            if let Some(&found) = cells[anchor].iter().find(|c| c.unsigned_abs() > MAX_LATTICE_MIN) {
                return Err(WriteError::BeyondLattice { anchor, found, limit: MAX_LATTICE_MIN as i32 });
            }
        }
        let along = |axis: usize| anchors.iter().map(move |&anchor| cells[anchor][axis]);
        let min: [i32; 3] =
            std::array::from_fn(|axis| file_order::aligned(along(axis).min().unwrap_or_default(), shift));
        let spans = (0..3).map(|axis| along(axis).max().unwrap_or_default().abs_diff(min[axis]));
        let span = spans.max().unwrap_or_default();
        let bits_per_axis = u32::BITS - span.leading_zeros();
        if bits_per_axis > u32::from(MAX_LATTICE_BITS) {
            return Err(WriteError::LatticeTooWide { found: span, limit: (1 << MAX_LATTICE_BITS) - 1 });
        }
        Ok(Self { min, bits_per_axis })
    }

    /// Morton code of a cell: bits of z, y and x in turn from the highest on, x lowest.
    pub(super) fn code(&self, cell: [i32; 3]) -> u64 {
        let offset: [u32; 3] = std::array::from_fn(|axis| cell[axis].abs_diff(self.min[axis]));
        file_order::code(offset, self.bits_per_axis)
    }

    /// Levels of the trie, leaves apart.
    pub(super) fn n_levels(&self) -> u32 {
        3 * self.bits_per_axis
    }
}

/// A walk over the trie of a chunk, in coding order.
pub(super) struct Walk<'c> {
    /// Morton codes, ascending.
    codes: &'c [u64],
    n_levels: u32,
    /// Levels on the path to the latest anchor whose node has both children, the root's bit highest.
    both: u64,
}

impl<'c> Walk<'c> {
    /// Starts at the root.
    pub(super) fn new(frame: &LatticeFrame, codes: &'c [u64]) -> Self {
        Self { codes, n_levels: frame.n_levels(), both: 0 }
    }

    /// Visits the nodes that anchor `anchor` is the first to reach; anchors come one after the other.
    fn visit(&mut self, anchor: usize, mut node: impl FnMut(Node)) {
        let Some((&code, later)) = self.codes[anchor..].split_first() else { return };
        let first_level = match anchor.checked_sub(1) {
            None => 0,
            // Where it leaves the path of the anchor before it, it takes the branch that is due; new nodes lie below.
            Some(before) => self.n_levels - (self.codes[before] ^ code).ilog2(),
        };
        for level in first_level..self.n_levels {
            let below = self.n_levels - 1 - level;
            let has_zero = (code >> below) & 1 == 0;
            // Codes that share the path to this node come first among the later ones.
            let n_shared = later.partition_point(|other| (other ^ code) >> below <= 1);
            let has_one = !has_zero || later[..n_shared].last().is_some_and(|last| (last >> below) & 1 == 1);
            let children = match (has_zero, has_one) {
                (true, true) => Children::Both,
                (true, false) => Children::Zero,
                (false, _) => Children::One,
            };
            let ancestors = self.both.unbounded_shr(u64::BITS - level) & ((1 << N_ANCESTORS) - 1);
            let context = (ancestors.count_ones() as usize).min(N_TRIE_CONTEXTS - 1);
            let place = TOP_LEVEL >> level;
            self.both = if children == Children::Both { self.both | place } else { self.both & !place };
            node(Node { level: level as usize, context, children });
        }
    }
}

impl LatticeModelDraft {
    /// Counts the nodes of all chunks; the codes of each ascend.
    pub(super) fn count<'c>(frame: LatticeFrame, chunks: impl Iterator<Item = &'c [u64]>) -> Self {
        let mut counts = vec![[[0_u64; 3]; N_TRIE_CONTEXTS]; frame.n_levels() as usize];
        for codes in chunks {
            let mut walk = Walk::new(&frame, codes);
            for anchor in 0..codes.len() {
                walk.visit(anchor, |node| counts[node.level][node.context][node.children as usize] += 1);
            }
        }
        let ends = |counts: [u64; 3]| {
            let [zero, one, both] = [Children::Zero, Children::One, Children::Both].map(|child| counts[child as usize]);
            // In the order of the slots.
            let frequencies = frequencies(&[both, zero, one], None);
            [frequencies[0], frequencies[0] + frequencies[1]].map(|end| u16::to_le_bytes(end as u16))
        };
        Self { frame, levels: counts.iter().map(|level| level.map(ends)).collect() }
    }

    /// The model of a bundle.
    pub(super) fn of(lattice: &Lattice<'_>) -> Self {
        Self {
            frame: LatticeFrame { min: lattice.min, bits_per_axis: lattice.bits.into() },
            levels: lattice.trie.levels().to_vec(),
        }
    }

    /// The model as the decoder has it.
    pub(super) fn view(&self) -> Lattice<'_> {
        let LatticeFrame { min, bits_per_axis } = self.frame;
        // At most 21.
        Lattice { min, bits: bits_per_axis as u8, trie: TrieModel::new(&self.levels) }
    }

    /// Appends the slots of the next anchor of a walk.
    pub(super) fn push(&self, walk: &mut Walk<'_>, anchor: usize, list: &mut SlotList) {
        walk.visit(anchor, |node| {
            let [end_both, end_zero] = self.levels[node.level][node.context].map(u16::from_le_bytes);
            let (start, end) = match node.children {
                Children::Both => (0, end_both),
                Children::Zero => (end_both, end_zero),
                Children::One => (end_zero, FREQUENCY_TOTAL),
            };
            list.push(Part::Position, &Slot { symbol: (), start, frequency: end - start });
        });
    }
}
