//! One chunk: lattice offsets, then the ANS words of its symbols.

mod ink;

use std::num::NonZeroU16;

use constriction::stream::Encode;
use constriction::stream::model::{EncoderModel, EntropyModel};
use constriction::stream::stack::AnsCoder;
use pocketsplat_core::bundle::crc32;
use pocketsplat_core::entropy::PRECISION_BITS;

use super::WriteError;
use super::quantise::RowSlice;
use super::table::{Place, TableSet};

/// The precision as `constriction` wants it.
const PRECISION: usize = PRECISION_BITS as usize;
/// Frequency of each value of a raw byte.
const RAW_BYTE_FREQUENCY: u16 = 1 << (PRECISION_BITS - 8);

/// A chunk ready for the file, and its record in the directory.
pub(super) struct EncodedChunk {
    pub(super) bytes: Vec<u8>,
    pub(super) crc: u32,
    pub(super) n_anchors: u16,
    pub(super) ink_min: [f32; 3],
    pub(super) ink_max: [f32; 3],
}

/// Codes a run of anchors; its symbols are in the order anchor by anchor, channels ascending.
pub(super) fn encode(anchors: RowSlice<'_>, tables: &TableSet, voxel_size: f32) -> Result<EncodedChunk, WriteError> {
    let mut bytes = lattice_bytes(anchors.lattice);
    for word in symbol_words(anchors.symbols, tables)? {
        bytes.extend(word.to_le_bytes());
    }
    let (ink_min, ink_max) = ink::ink_box(anchors, tables, voxel_size);
    let n_anchors = u16::try_from(anchors.lattice.len()).unwrap_or(u16::MAX);
    Ok(EncodedChunk { crc: crc32(&bytes), bytes, n_anchors, ink_min, ink_max })
}

/// Base, bits an axis, and the offsets packed least significant bit first, filled up to whole words.
fn lattice_bytes(lattice: &[[i32; 3]]) -> Vec<u8> {
    let along = |axis: usize| lattice.iter().map(move |cell| cell[axis]);
    let base: [i32; 3] = core::array::from_fn(|axis| along(axis).min().unwrap_or_default());
    let bits: [u32; 3] = core::array::from_fn(|axis| {
        let span = along(axis).max().unwrap_or_default().abs_diff(base[axis]);
        u32::BITS - span.leading_zeros()
    });
    let mut bytes: Vec<u8> = base.iter().flat_map(|b| b.to_le_bytes()).collect();
    bytes.extend(bits.map(|b| b as u8));
    bytes.push(0);
    let (mut pending, mut n_pending) = (0_u64, 0);
    for cell in lattice {
        for axis in 0..3 {
            pending |= u64::from(cell[axis].abs_diff(base[axis])) << n_pending;
            n_pending += bits[axis];
            while n_pending >= 16 {
                bytes.extend((pending as u16).to_le_bytes());
                pending >>= 16;
                n_pending -= 16;
            }
        }
    }
    if n_pending > 0 {
        bytes.extend((pending as u16).to_le_bytes());
    }
    bytes
}

/// The words of the stream in reading order.
fn symbol_words(symbols: &[i16], tables: &TableSet) -> Result<Vec<u16>, WriteError> {
    let n_channels = tables.channel_tables.len();
    let mut coder = AnsCoder::<u16, u32>::new();
    let mut push = |start: u16, frequency: u16| coder.encode_symbol((), FixedSlot { start, frequency });
    // A stack: what is read first is written last.
    for row in symbols.chunks_exact(n_channels).rev() {
        for (channel, &symbol) in row.iter().enumerate().rev() {
            let encoded = match tables.of_channel(channel).place(symbol) {
                Place::Entry(start, frequency) => push(start, frequency),
                Place::Escape(start, frequency) => {
                    let [high, low] = symbol.to_be_bytes().map(|byte| u16::from(byte) * RAW_BYTE_FREQUENCY);
                    push(low, RAW_BYTE_FREQUENCY)
                        .and_then(|()| push(high, RAW_BYTE_FREQUENCY))
                        .and_then(|()| push(start, frequency))
                }
            };
            // Every place has a frequency of at least 1, and memory takes any number of words.
            encoded.map_err(|_| WriteError::ReadBack(pocketsplat_core::DecodeError::Internal))?;
        }
    }
    let Ok(mut words) = coder.into_compressed();
    words.reverse();
    Ok(words)
}

/// One known slot, for the encoder: it codes "this slot".
#[derive(Clone, Copy)]
struct FixedSlot {
    start: u16,
    frequency: u16,
}

impl EntropyModel<PRECISION> for FixedSlot {
    type Symbol = ();
    type Probability = u16;
}

impl EncoderModel<PRECISION> for FixedSlot {
    fn left_cumulative_and_probability(&self, _symbol: impl std::borrow::Borrow<()>) -> Option<(u16, NonZeroU16)> {
        NonZeroU16::new(self.frequency).map(|frequency| (self.start, frequency))
    }
}
