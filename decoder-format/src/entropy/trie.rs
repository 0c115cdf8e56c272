//! A set of codes of equal length, coded as a binary trie, depth first.
//!
//! A node either has both children or one of them; which, is a symbol. So n codes cost n − 1 symbols "both" and one "only"
//! for every other node on a path, and neighbours share their paths. Codes come in ascending order, one at a time.

use pocketsplat_half::{LEVELS_AT_ONCE, LevelFrequencies, descend};

use super::ans::AnsReader;
use super::model::{FREQUENCY_TOTAL, Slot, SymbolModel};

/// Contexts of a node: how many of its last three ancestors have both children, 2 and 3 counted alike.
pub const N_TRIE_CONTEXTS: usize = 3;

/// The frequencies of a trie's symbols, level by level from the root.
#[derive(Clone, Copy, Debug)]
pub struct TrieModel<'a> {
    /// `[n_levels][N_TRIE_CONTEXTS]` of `end_both`, `end_zero`.
    levels: &'a [LevelFrequencies],
}

/// The frequencies of one node's symbol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NodeModel {
    /// The slots below are "both children".
    pub end_both: u16,
    /// The slots from `end_both` to here are "only child 0", the others "only child 1".
    pub end_zero: u16,
}

/// Which children a node has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Children {
    /// 0 alone.
    Zero = 0,
    /// 1 alone.
    One = 1,
    /// 0 and 1.
    Both = 2,
}

/// Walks over one trie, code by code.
#[derive(Clone, Copy, Debug)]
pub struct TrieReader<'a> {
    levels: &'a [LevelFrequencies],
    /// The path taken, its last branch lowest.
    code: u64,
    /// The nodes of the path that have both children.
    both: u64,
    started: bool,
    exhausted: bool,
}

impl<'a> TrieModel<'a> {
    /// Takes the frequencies of a trie with as many levels as given; the caller has checked that each `end_both` ≤
    /// `end_zero` ≤ [`FREQUENCY_TOTAL`].
    #[must_use]
    pub fn new(levels: &'a [LevelFrequencies]) -> Self {
        Self { levels }
    }

    /// `[n_levels][N_TRIE_CONTEXTS]` of `end_both`, `end_zero`, as bytes.
    #[must_use]
    pub fn levels(&self) -> &'a [LevelFrequencies] {
        self.levels
    }

    /// Levels, that is bits of a code.
    #[must_use]
    pub fn n_levels(&self) -> usize {
        self.levels.len()
    }

    /// The model of a node at `level`, 0 at the root, in `context`.
    #[must_use]
    pub fn node(&self, level: usize, context: usize) -> Option<NodeModel> {
        self.levels.get(level)?.get(context).map(|&bytes| NodeModel::from_bytes(bytes))
    }

    /// Starts a trie at its root.
    #[must_use]
    pub fn codes(&self) -> TrieReader<'a> {
        TrieReader { levels: self.levels, code: 0, both: 0, started: false, exhausted: false }
    }
}

impl NodeModel {
    /// Reads `end_both` and `end_zero`.
    #[inline]
    fn from_bytes([end_both, end_zero]: [[u8; 2]; 2]) -> Self {
        Self { end_both: u16::from_le_bytes(end_both), end_zero: u16::from_le_bytes(end_zero) }
    }
}

impl SymbolModel for NodeModel {
    type Symbol = Children;

    #[inline]
    fn slot(&self, quantile: u16) -> Slot<Children> {
        let (symbol, start, end) = if quantile < self.end_both {
            (Children::Both, 0, self.end_both)
        } else if quantile < self.end_zero {
            (Children::Zero, self.end_both, self.end_zero)
        } else {
            (Children::One, self.end_zero, FREQUENCY_TOTAL)
        };
        Slot { symbol, start, frequency: end.wrapping_sub(start) }
    }
}

impl TrieReader<'_> {
    /// The next code; one that has no place in the trie repeats the last, and [`is_complete`](Self::is_complete) fails.
    ///
    /// # Budget
    /// A symbol for every level below the branch where the code leaves the one before.
    #[inline]
    pub fn next(&mut self, symbols: &mut AnsReader<'_>) -> u64 {
        let n_new = if self.started {
            let due = self.due();
            if due == 0 {
                self.exhausted = true;
                return self.code;
            }
            // Back to the deepest node whose child 1 is due, and into that child.
            let n_up = due.trailing_zeros();
            self.code = (self.code >> n_up) | 1;
            self.both >>= n_up;
            n_up as usize
        } else {
            self.started = true;
            self.levels.len()
        };
        let (_, below) = self.levels.split_at_checked(self.levels.len().wrapping_sub(n_new)).unwrap_or_default();
        for levels in below.chunks(LEVELS_AT_ONCE) {
            self.descend(levels, symbols);
        }
        self.code
    }

    /// Goes down by at most [`LEVELS_AT_ONCE`] levels.
    #[inline]
    fn descend(&mut self, levels: &[LevelFrequencies], symbols: &mut AnsReader<'_>) {
        let [code, both] = descend(levels, self.both as u32, symbols.stream());
        let n = levels.len() as u32 & 63;
        self.code = (self.code << n) | u64::from(code);
        // The bits above the new ones are those below them in the path.
        self.both = (self.both << n) | (u64::from(both) & (1_u64 << n).wrapping_sub(1));
    }

    /// The nodes of the path whose child 1 is still due: they have both, and the path goes through 0.
    fn due(&self) -> u64 {
        self.both & !self.code
    }

    /// Whether every code was read and no more than those.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.due() == 0 && !self.exhausted
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use pocketsplat_half::{LevelFrequencies, NODE_CONTEXTS};

    use super::{Children, NodeModel, TrieModel};
    use crate::entropy::testing::{AnsWriter, slot_of};
    use crate::entropy::{AnsReader, Slot};

    /// Another model at each level and in each context.
    fn levels(n: usize) -> Vec<LevelFrequencies> {
        let node = |level: usize, context: usize| {
            let end_both = (300 + 97 * (level % 10) + 1000 * context) as u16;
            let end_zero = end_both + 150 + 31 * (level as u16 % 20);
            [end_both, end_zero].map(u16::to_le_bytes)
        };
        (0..n).map(|level| std::array::from_fn(|context| node(level, context))).collect()
    }

    /// The symbols of sorted codes, by recursion over the set: the definition rather than the reader's way.
    fn symbols_of(codes: &[u64], n_left: usize, path: &[bool], model: &TrieModel<'_>, slots: &mut Vec<Slot<()>>) {
        let Some(bit) = n_left.checked_sub(1) else { return };
        let split = codes.partition_point(|code| code >> bit & 1 == 0);
        let (zeros, ones) = codes.split_at(split);
        let children = match (zeros.is_empty(), ones.is_empty()) {
            (false, false) => Children::Both,
            (false, true) => Children::Zero,
            (true, false) => Children::One,
            (true, true) => return,
        };
        let n_both = path.iter().rev().take(3).filter(|&&both| both).count();
        let node = model.node(path.len(), n_both.min(2)).expect("a level of the trie");
        slots.push(slot_of(&node, |found| found == children));
        let path = [path, &[children == Children::Both]].concat();
        for half in [zeros, ones] {
            symbols_of(half, bit, &path, model, slots);
        }
    }

    #[test]
    fn codes_come_back_in_order() {
        let mut state = 1_u64;
        for (n_levels, n_codes) in [(0, 1), (1, 1), (1, 2), (6, 64), (30, 200), (63, 50)] {
            let mut codes: Vec<u64> = (0..n_codes)
                .map(|i| {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                    let full = if n_levels == 6 { i } else { state >> 1 };
                    full & ((1 << n_levels) - 1)
                })
                .collect();
            codes.sort_unstable();
            codes.dedup();
            let levels = levels(n_levels);
            let model = TrieModel::new(&levels);
            let mut slots = Vec::new();
            symbols_of(&codes, n_levels, &[], &model, &mut slots);
            let words = AnsWriter::words(&slots);
            let mut symbols = AnsReader::new(&words);
            let mut reader = model.codes();
            let read: Vec<u64> = codes.iter().map(|_| reader.next(&mut symbols)).collect();
            assert_eq!(read, codes, "{n_levels} levels");
            assert!(reader.is_complete(), "{n_levels} levels: no branch is left");
            assert_eq!(symbols.finish(), Ok(()), "{n_levels} levels: no symbol is left");
            assert_eq!(
                (reader.next(&mut symbols), reader.is_complete()),
                (codes[codes.len() - 1], false),
                "one too many"
            );
        }
    }

    #[test]
    fn a_branch_not_taken_is_noticed() {
        let levels = levels(1);
        let node = TrieModel::new(&levels).node(0, 0).expect("the root");
        let words = AnsWriter::words(&[slot_of(&node, |found| found == Children::Both)]);
        let mut reader = TrieModel::new(&levels).codes();
        assert_eq!(reader.next(&mut AnsReader::new(&words)), 0, "child 0 first");
        assert!(!reader.is_complete(), "child 1 is due");
    }

    #[test]
    fn contexts_count_the_ancestors_with_both_children() {
        for pattern in 0..8_u32 {
            assert_eq!(NODE_CONTEXTS >> (2 * pattern) & 3, pattern.count_ones().min(2), "pattern {pattern:03b}");
        }
    }

    #[test]
    fn the_slots_of_a_node_fill_the_range() {
        let node = NodeModel { end_both: 100, end_zero: 4096 };
        use crate::entropy::SymbolModel as _;
        assert_eq!(node.slot(99), Slot { symbol: Children::Both, start: 0, frequency: 100 }, "below end_both");
        assert_eq!(node.slot(4095), Slot { symbol: Children::Zero, start: 100, frequency: 3996 }, "no room for one");
    }
}
