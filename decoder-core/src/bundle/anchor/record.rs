//! Decoded anchors in memory: symbols as they are coded, and what makes values of them.

use super::AnchorSite;
use super::channels::Channel;
use crate::bundle::lattice::Lattice;
use crate::bundle::{AnchorModels, Bundle, Chunk, Coder};
use crate::context::{Group, N_GROUPS, Steps};
use crate::error::{DecodeError, Field};

/// What a record holds, in numbers of 16 bits: symbols, then the code of the cell, the mask, the exponents of the steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct RecordLayout {
    pub(crate) n_channels: usize,
    n_code: usize,
    n_mask: usize,
    n_steps: usize,
}

/// The memory that anchors are kept in.
pub(crate) struct RecordMemory<'s> {
    /// `[n_anchors, RecordLayout::len]`.
    pub(crate) records: &'s mut [i16],
    /// One bit a chunk.
    pub(crate) damaged: &'s mut [u32],
    /// `[n_tables]` origin and step.
    pub(crate) scales: &'s mut [[f32; 2]],
}

/// Anchors decoded once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AnchorRecords<'b, 's> {
    layout: RecordLayout,
    records: &'s [i16],
    damaged: &'s [u32],
    lattice: Lattice<'b>,
    /// The mask of an anchor that stores none.
    full_mask: u32,
    scalars: Scalars,
    values: Values<'b, 's>,
}

/// How many channels come before the offsets'.
#[derive(Clone, Copy, Debug)]
struct Scalars {
    n_features: usize,
    n_all: usize,
}

/// How symbols become values.
#[derive(Clone, Copy, Debug)]
enum Values<'b, 's> {
    Static { table_of_channel: &'b [[u8; 2]], scales: &'s [[f32; 2]] },
    Context { base_steps: [f32; N_GROUPS] },
}

impl RecordLayout {
    /// * `masked_offsets`: offsets that a mask has a bit for, 0 without masks. * `context`: the steps are the anchor's own.
    pub(crate) const fn new(n_channels: usize, lattice_bits: u8, masked_offsets: u16, context: bool) -> Self {
        Self {
            n_channels,
            n_code: (lattice_bits as usize).wrapping_mul(3).div_ceil(16),
            n_mask: masked_offsets.div_ceil(16) as usize,
            n_steps: context as usize,
        }
    }

    /// Numbers of a record.
    pub(crate) const fn len(&self) -> usize {
        self.n_channels.saturating_add(self.n_code).saturating_add(self.n_mask).saturating_add(self.n_steps)
    }

    /// Symbols, code, mask, exponents.
    fn split<'r>(&self, record: &'r [i16]) -> Option<[&'r [i16]; 4]> {
        let (symbols, rest) = record.split_at_checked(self.n_channels)?;
        let (code, rest) = rest.split_at_checked(self.n_code)?;
        let (mask, steps) = rest.split_at_checked(self.n_mask)?;
        Some([symbols, code, mask, steps])
    }

    /// Writes all but the symbols.
    fn write(&self, record: &mut [i16], code: u64, mask: u32, steps: u16) {
        let Some((_, rest)) = record.split_at_mut_checked(self.n_channels) else { return };
        let Some((code_slots, rest)) = rest.split_at_mut_checked(self.n_code) else { return };
        let Some((mask_slots, steps_slots)) = rest.split_at_mut_checked(self.n_mask) else { return };
        write_halves(code_slots, code);
        write_halves(mask_slots, mask.into());
        write_halves(steps_slots, steps.into());
    }
}

impl Bundle<'_> {
    /// The records of this bundle's anchors.
    pub(crate) fn record_layout(&self) -> RecordLayout {
        let header = self.header();
        let masked_offsets = if self.masks().is_some() { header.n_offsets } else { 0 };
        RecordLayout::new(header.n_channels(), self.lattice().bits, masked_offsets, self.context().is_some())
    }
}

impl<'b, 's> AnchorRecords<'b, 's> {
    /// Decodes the first `n_chunks` chunks into `memory`.
    ///
    /// * `skip_damage`: leaves damaged chunks out and remembers which.
    ///
    /// # Errors
    /// [`DecodeError::ChunkChecksum`] or [`DecodeError::ChunkStream`] for damage that is not left out.
    pub(crate) fn decode(
        bundle: &Bundle<'b>,
        n_chunks: u32,
        memory: RecordMemory<'s>,
        models: &mut AnchorModels<'b, '_>,
        skip_damage: bool,
    ) -> Result<Self, DecodeError> {
        let RecordMemory { records, damaged, scales } = memory;
        let layout = bundle.record_layout();
        damaged.fill(0);
        // `max(1)`: a chunk size of zero would panic; there are always at least 6 channels.
        let mut slots = records.chunks_exact_mut(layout.len().max(1));
        for chunk in bundle.chunks().take(n_chunks as usize) {
            match decode_chunk(&chunk, &layout, &mut slots, models) {
                Err(DecodeError::ChunkChecksum { .. } | DecodeError::ChunkStream { .. }) if skip_damage => {
                    let (word, bit) = place(chunk.index());
                    if let Some(word) = damaged.get_mut(word) {
                        *word |= bit;
                    }
                }
                result => result?,
            }
        }
        let values = match bundle.coder() {
            Coder::Context(context) => Values::Context { base_steps: context.base_steps() },
            Coder::Static(tables) => {
                for (index, scale) in scales.iter_mut().enumerate() {
                    let table = tables.get(index).ok_or(DecodeError::Internal)?;
                    *scale = [table.origin, table.step];
                }
                Values::Static { table_of_channel: tables.of_channel_numbers(), scales }
            }
        };
        let header = bundle.header();
        let n_features = usize::from(header.feature_dim);
        Ok(Self {
            layout,
            records,
            damaged,
            lattice: *bundle.lattice(),
            // There are 1 to 32 offsets.
            full_mask: u32::MAX.wrapping_shr(u32::BITS.wrapping_sub(header.n_offsets.into())),
            scalars: Scalars { n_features, n_all: n_features.saturating_add(6) },
            values,
        })
    }

    /// Whether a chunk was left out because of damage.
    pub(crate) fn is_damaged(&self, chunk: u32) -> bool {
        let (word, bit) = place(chunk);
        self.damaged.get(word).is_some_and(|word| word & bit != 0)
    }

    /// Where anchor `index` of the file stands; fills `row` with its values, those of undrawn offsets with 0.
    ///
    /// # Budget
    /// A conversion and a multiplication a channel, about 10 instructions on a Cortex-M4.
    pub(crate) fn read(&self, index: u32, row: &mut [f32]) -> Option<AnchorSite> {
        let start = (index as usize).checked_mul(self.layout.len())?;
        let record = self.records.get(start..)?.get(..self.layout.len())?;
        let [symbols, code, mask, steps] = self.layout.split(record)?;
        let mask = if mask.is_empty() { self.full_mask } else { read_halves(mask) as u32 };
        let (scalar_symbols, offset_symbols) = symbols.split_at_checked(self.scalars.n_all)?;
        let (scalars, offsets) = row.split_at_mut_checked(self.scalars.n_all)?;
        let (offsets, offset_symbols) = (offsets.as_chunks_mut::<3>().0, offset_symbols.as_chunks::<3>().0);
        match self.values {
            Values::Static { table_of_channel, scales } => {
                let (scalar_tables, offset_tables) = table_of_channel.split_at_checked(self.scalars.n_all)?;
                let value = |symbol: i16, table: [u8; 2]| {
                    let [origin, step] =
                        scales.get(usize::from(u16::from_le_bytes(table))).copied().unwrap_or_default();
                    f32::from_symbol(symbol.into(), origin, step)
                };
                for ((slot, &symbol), &table) in scalars.iter_mut().zip(scalar_symbols).zip(scalar_tables) {
                    *slot = value(symbol, table);
                }
                let offset_tables = offset_tables.as_chunks::<3>().0;
                let mut left = mask;
                for ((slots, symbols), tables) in offsets.iter_mut().zip(offset_symbols).zip(offset_tables) {
                    let ([x, y, z], [table_x, table_y, table_z]) = (*symbols, *tables);
                    let drawn = left & 1 == 1;
                    *slots = if drawn { [value(x, table_x), value(y, table_y), value(z, table_z)] } else { [0.0; 3] };
                    left >>= 1;
                }
            }
            Values::Context { base_steps } => {
                let steps = Steps::from_bits(base_steps, read_halves(steps) as u16);
                let step_of = |group| steps.value(group);
                let (feature, log_scale, offset) =
                    (step_of(Group::Feature), step_of(Group::LogScale), step_of(Group::Offset));
                for (channel, (slot, &symbol)) in scalars.iter_mut().zip(scalar_symbols).enumerate() {
                    let step = if channel < self.scalars.n_features { feature } else { log_scale };
                    *slot = f32::from_scaled(symbol.into(), step);
                }
                // Symbols of undrawn offsets are 0.
                for (slot, &symbol) in offsets.as_flattened_mut().iter_mut().zip(offset_symbols.as_flattened()) {
                    *slot = f32::from_scaled(symbol.into(), offset);
                }
            }
        }
        Some(AnchorSite { lattice: self.lattice.cell(read_halves(code)), mask })
    }
}

/// Decodes a chunk into the next records; as many are passed over when it is damaged.
fn decode_chunk<'b, 'r>(
    chunk: &Chunk<'b>,
    layout: &RecordLayout,
    records: &mut impl Iterator<Item = &'r mut [i16]>,
    models: &mut AnchorModels<'b, '_>,
) -> Result<(), DecodeError> {
    let sound = chunk.check();
    let mut anchors = chunk.anchors(models);
    for n_done in 0..chunk.n_anchors() {
        let record = records.next().ok_or(DecodeError::BufferTooShort {
            field: Field::ChannelBuffer,
            needed: chunk.n_anchors().into(),
            available: n_done.into(),
        })?;
        let site = anchors.site();
        anchors.symbols(record.get_mut(..layout.n_channels).unwrap_or_default());
        layout.write(record, anchors.code(), site.mask, anchors.step_bits());
    }
    sound.and(anchors.finish())
}

/// Word and bit of a chunk.
const fn place(chunk: u32) -> (usize, u32) {
    ((chunk / u32::BITS) as usize, 1_u32.wrapping_shl(chunk))
}

/// Spreads a number over as many pieces of 16 bits as there are slots, the lowest first.
fn write_halves(slots: &mut [i16], mut number: u64) {
    for slot in slots {
        *slot = number as i16;
        number >>= 16;
    }
}

/// The number that [`write_halves`] spread.
fn read_halves(slots: &[i16]) -> u64 {
    slots.iter().rev().fold(0, |number, &half| (number << 16) | u64::from(half.cast_unsigned()))
}
