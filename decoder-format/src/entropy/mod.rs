//! Entropy decoding: bytes to integer symbols, in integer arithmetic alone.
//!
//! Whatever decides a symbol lives here, once, and the trainer's encoder uses the same frequencies, so a bundle decodes
//! to the same symbols on every target. The module knows nothing of anchors or of what a symbol means.
// Tests may index and add as they like; this is about bytes that nobody vouches for.
#![cfg_attr(not(test), deny(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::panic))]

mod ans;
mod mask;
mod model;
mod normal;
#[cfg(test)]
pub(crate) mod testing;
mod trie;

pub use ans::AnsReader;
pub use mask::{MaskModel, N_MASK_CONTEXTS};
pub use model::{FREQUENCY_TOTAL, PRECISION_BITS, Slot, SymbolModel, UniformByte};
pub use normal::{EIGHTHS, N_PHASES, N_SCALES, NormalModel, SCALE_ONE, SymbolSlots};
pub use trie::{Children, N_TRIE_CONTEXTS, NodeModel, TrieModel, TrieReader};
