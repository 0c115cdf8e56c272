//! Cells as codes, and codes as a trie: the coder's side of section 4.

use pocketsplat_format::bundle::Lattice;
use pocketsplat_format::entropy::{FREQUENCY_TOTAL, N_TRIE_CONTEXTS, TrieModel};

use super::stream::{Slots, frequencies};

/// Frequencies of a level: for each context where "both" and "only 0" end.
pub type LevelEnds = [[u16; 2]; N_TRIE_CONTEXTS];

/// A node on the way to a code: its level, its context, and 0 for both children, 1 for child 0 only, 2 for child 1 only.
struct Node {
    level: usize,
    context: usize,
    symbol: usize,
}

/// The code of a cell: bit b − 1 of z, y, x, then bit b − 2, and so on.
pub fn code(min: [i32; 3], bits: u8, cell: [i32; 3]) -> u64 {
    let [x, y, z] = std::array::from_fn(|axis| u64::from(cell[axis].abs_diff(min[axis])));
    (0..bits).rev().fold(0, |code, bit| code << 3 | (z >> bit & 1) << 2 | (y >> bit & 1) << 1 | (x >> bit & 1))
}

/// The nodes that `codes[at]` is the first to reach.
fn new_nodes(codes: &[u64], at: usize, n_levels: usize) -> Vec<Node> {
    let code = codes[at];
    let prefix = |code: u64, level: usize| code >> (n_levels - level);
    let has = |level: usize, child: u64| {
        codes.iter().any(|&other| prefix(other, level) == prefix(code, level) && prefix(other, level + 1) & 1 == child)
    };
    let symbol = |level: usize| match [has(level, 0), has(level, 1)] {
        [true, true] => 0,
        [true, false] => 1,
        _ => 2,
    };
    let is_new = |level: usize| at == 0 || prefix(codes[at - 1], level) != prefix(code, level);
    (0..n_levels)
        .filter(|&level| is_new(level))
        .map(|level| {
            let context = (level.saturating_sub(3)..level).filter(|&above| symbol(above) == 0).count().min(2);
            Node { level, context, symbol: symbol(level) }
        })
        .collect()
}

/// The frequencies of the tries of `chunks`, whose codes ascend.
pub fn count(chunks: &[Vec<u64>], n_levels: usize) -> Vec<LevelEnds> {
    let mut counts = vec![[[0_u32; 3]; N_TRIE_CONTEXTS]; n_levels];
    for codes in chunks {
        for node in (0..codes.len()).flat_map(|at| new_nodes(codes, at, n_levels)) {
            counts[node.level][node.context][node.symbol] += 1;
        }
    }
    let ends = |counts: [u32; 3]| {
        let shares = frequencies(&counts, FREQUENCY_TOTAL);
        [shares[0], shares[0] + shares[1]]
    };
    counts.into_iter().map(|level| level.map(ends)).collect()
}

/// The slots of the nodes that `codes[at]` is the first to reach.
pub fn slots(levels: &[LevelEnds], codes: &[u64], at: usize) -> Vec<Slots> {
    new_nodes(codes, at, levels.len())
        .into_iter()
        .map(|Node { level, context, symbol }| {
            let [both, zero] = levels[level][context];
            [(0, both), (both, zero - both), (zero, FREQUENCY_TOTAL - zero)][symbol]
        })
        .collect()
}

/// The lattice section.
pub fn section(min: [i32; 3], bits: u8, levels: &[LevelEnds]) -> Vec<u8> {
    let bytes: Vec<_> = levels.iter().map(|level| level.map(|ends| ends.map(u16::to_le_bytes))).collect();
    Lattice { min, bits, trie: TrieModel::new(&bytes) }.emit().collect()
}
