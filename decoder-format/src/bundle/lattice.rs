//! The lattice section: where the cells of anchors may lie, and the model of which do.

use crate::bytes::{Cursor, Fields};
use crate::entropy::{FREQUENCY_TOTAL, N_TRIE_CONTEXTS, TrieModel};
use crate::error::{DecodeError, Field, SectionKind, in_range};

/// Most bits of a cell's code along an axis: three of them fit a u64.
pub const MAX_LATTICE_BITS: u8 = 21;
/// Largest magnitude of a coordinate of the lowest cell: coordinates stay within ±2²⁴, where f32 still holds every integer.
pub const MAX_LATTICE_MIN: u32 = 1 << 23;

/// The cube of cells that a scene's anchors lie in, and the frequencies of the trie that lists them.
#[derive(Clone, Copy, Debug)]
pub struct Lattice<'a> {
    /// The cell of code 0.
    pub min: [i32; 3],
    /// Bits of a code along an axis.
    pub bits: u8,
    /// The frequencies, one level for each bit of a code.
    pub trie: TrieModel<'a>,
}

impl<'a> Lattice<'a> {
    pub(super) fn parse(section: &'a [u8]) -> Result<Self, DecodeError> {
        let mut cursor = Cursor::new(section, SectionKind::Lattice);
        let mut fields = Fields::new(cursor.record::<16>()?);
        let min = fields.i32s();
        let [bits, a, b, c] = fields.bytes();
        for cell in min {
            in_range(Field::LatticeMin, cell.unsigned_abs(), 0, MAX_LATTICE_MIN)?;
        }
        in_range(Field::LatticeBits, bits.into(), 0, MAX_LATTICE_BITS.into())?;
        in_range(Field::Reserved, (a | b | c).into(), 0, 0)?;
        let n_nodes = usize::from(bits).saturating_mul(3).saturating_mul(N_TRIE_CONTEXTS);
        let (nodes, _) = cursor.pairs(n_nodes.saturating_mul(2))?.as_chunks::<2>();
        cursor.end()?;
        let (levels, _) = nodes.as_chunks();
        let trie = TrieModel::new(levels);
        for node in (0..trie.n_levels()).flat_map(|level| (0..N_TRIE_CONTEXTS).map(move |c| trie.node(level, c))) {
            let node = node.ok_or(DecodeError::Internal)?;
            in_range(Field::TrieFrequency, node.end_zero.into(), 0, FREQUENCY_TOTAL.into())?;
            in_range(Field::TrieFrequency, node.end_both.into(), 0, node.end_zero.into())?;
        }
        Ok(Self { min, bits, trie })
    }

    /// The section's bytes: the reverse of `parse`.
    pub fn emit(&self) -> impl Iterator<Item = u8> + use<'a> {
        let min = self.min.into_iter().flat_map(i32::to_le_bytes);
        min.chain([self.bits, 0, 0, 0])
            .chain(self.trie.levels().as_flattened().as_flattened().as_flattened().iter().copied())
    }

    /// The cell of a code: its bits from the top are z, y, x of the highest bit, then of the next.
    ///
    /// ```
    /// # use pocketsplat_format::bundle::Lattice;
    /// # use pocketsplat_format::entropy::TrieModel;
    /// let lattice = Lattice { min: [-5, 0, 7], bits: 2, trie: TrieModel::new(&[]) };
    /// assert_eq!(lattice.cell(0b011_100), [-3, 2, 8]);
    /// ```
    // Not inlined: it is long, and a symbol takes as long as a call.
    #[inline(never)]
    #[must_use]
    pub fn cell(&self, code: u64) -> [i32; 3] {
        let [x, y, z] = self.min;
        // |min| ≤ 2²³ and a part of a code has at most 21 bits, so the sums stay below 2²⁴.
        let along = |min: i32, axis: u32| min.wrapping_add(every_third_bit(code >> axis) as i32);
        [along(x, 0), along(y, 1), along(z, 2)]
    }
}

/// Gathers bits 0, 3, 6, … 60: halves them in ever wider groups, which is the Morton decoding of everyone.
#[inline]
fn every_third_bit(code: u64) -> u32 {
    const GROUPS: [(u32, u64); 6] = [
        (0, 0x1249_2492_4924_9249),
        (2, 0x10C3_0C30_C30C_30C3),
        (4, 0x100F_00F0_0F00_F00F),
        (8, 0x001F_0000_FF00_00FF),
        (16, 0x001F_0000_0000_FFFF),
        (32, 0x0000_0000_001F_FFFF),
    ];
    GROUPS.iter().fold(code, |bits, &(shift, mask)| (bits | (bits >> shift)) & mask) as u32
}

#[cfg(test)]
mod tests {
    use super::Lattice;
    use crate::entropy::TrieModel;

    #[test]
    fn cells_are_the_bits_of_their_code() {
        let lattice = Lattice { min: [-8_388_608, 0, 77], bits: 21, trie: TrieModel::new(&[]) };
        let mut state = 1_u64;
        for _ in 0..1000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let code = state >> 1;
            let mut expected = [0_i32; 3];
            for bit in 0..63 {
                expected[bit % 3] |= ((code >> bit & 1) as i32) << (bit / 3);
            }
            let expected = [expected[0] - 8_388_608, expected[1], expected[2] + 77];
            assert_eq!(lattice.cell(code), expected, "code {code:#x}");
        }
    }
}
