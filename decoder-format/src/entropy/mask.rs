//! Which of an anchor's offsets are drawn, one symbol each.

use super::ans::AnsReader;
use super::model::{FREQUENCY_TOTAL, Slot, SymbolModel};

/// Contexts of an offset's symbol: how many offsets before it are drawn, 3 and more counted alike.
pub const N_MASK_CONTEXTS: usize = 4;

/// The frequencies of "drawn", offset by offset.
#[derive(Clone, Copy, Debug)]
pub struct MaskModel<'a> {
    /// `[K][N_MASK_CONTEXTS]`, each 1..=4095.
    offsets: &'a [[[u8; 2]; N_MASK_CONTEXTS]],
}

/// The frequency of "drawn"; it owns the slots below.
struct Drawn(u16);

impl SymbolModel for Drawn {
    type Symbol = bool;

    #[inline]
    fn slot(&self, quantile: u16) -> Slot<bool> {
        if quantile < self.0 {
            Slot { symbol: true, start: 0, frequency: self.0 }
        } else {
            Slot { symbol: false, start: self.0, frequency: FREQUENCY_TOTAL.wrapping_sub(self.0) }
        }
    }
}

impl<'a> MaskModel<'a> {
    /// Takes the frequencies of at most 32 offsets; the caller has checked that each is 1..=4095.
    #[must_use]
    pub fn new(offsets: &'a [[[u8; 2]; N_MASK_CONTEXTS]]) -> Self {
        Self { offsets }
    }

    /// `[K][N_MASK_CONTEXTS]` frequencies of "drawn", as bytes.
    #[must_use]
    pub fn offsets(&self) -> &'a [[[u8; 2]; N_MASK_CONTEXTS]] {
        self.offsets
    }

    /// Offsets K.
    #[must_use]
    pub fn n_offsets(&self) -> usize {
        self.offsets.len()
    }

    /// The frequency with which offset `offset` is drawn when `n_drawn` of those before it are.
    #[must_use]
    pub fn frequency(&self, offset: usize, n_drawn: usize) -> Option<u16> {
        let contexts = self.offsets.get(offset)?;
        contexts.get(n_drawn.min(N_MASK_CONTEXTS.wrapping_sub(1))).map(|&frequency| u16::from_le_bytes(frequency))
    }

    /// Decodes the next anchor's mask: bit k is set when offset k is drawn.
    ///
    /// # Budget
    /// A symbol an offset.
    #[inline]
    pub fn mask(&self, symbols: &mut AnsReader<'_>) -> u32 {
        let mut mask = 0_u32;
        let mut bit = 1_u32;
        let mut n_drawn = 0_usize;
        for contexts in self.offsets {
            let frequency = contexts.get(n_drawn & 3).copied().unwrap_or_default();
            if symbols.symbol(&Drawn(u16::from_le_bytes(frequency))) {
                mask |= bit;
                n_drawn = n_drawn.wrapping_add(1).min(3);
            }
            bit = bit.wrapping_shl(1);
        }
        mask
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::{Drawn, MaskModel, N_MASK_CONTEXTS};
    use crate::entropy::AnsReader;
    use crate::entropy::testing::{AnsWriter, slot_of};

    #[test]
    fn masks_come_back() {
        const K: usize = 6;
        let frequencies: [[u16; N_MASK_CONTEXTS]; K] =
            std::array::from_fn(|k| std::array::from_fn(|n| (1 + 700 * k + 150 * n) as u16));
        let bytes = frequencies.map(|contexts| contexts.map(u16::to_le_bytes));
        let model = MaskModel::new(&bytes);
        let mut slots = Vec::new();
        for mask in 0..1_u32 << K {
            for k in 0..K {
                let n_drawn = (mask & ((1 << k) - 1)).count_ones() as usize;
                let frequency = model.frequency(k, n_drawn).expect("an offset");
                assert_eq!(frequency, frequencies[k][n_drawn.min(3)], "offset {k} after {n_drawn}");
                slots.push(slot_of(&Drawn(frequency), |drawn| drawn == (mask >> k & 1 == 1)));
            }
        }
        let words = AnsWriter::words(&slots);
        let mut symbols = AnsReader::new(&words);
        for mask in 0..1 << K {
            assert_eq!(model.mask(&mut symbols), mask, "mask {mask:06b}");
        }
        assert_eq!(symbols.finish(), Ok(()), "no symbol is left");
    }
}
