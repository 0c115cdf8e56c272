//! Decoded anchors in memory: symbols in as few bits as they all need, and what makes values of them.

use super::AnchorSite;
use super::bits::{BitReader, BitWriter};
use super::channels::Channel;
use crate::bundle::lattice::Lattice;
use crate::bundle::{AnchorModels, Bundle, Chunk, Coder};
use crate::context::{Group, N_GROUPS, Steps};
use crate::error::{DecodeError, Field};

/// Bits of the exponents of an anchor's steps.
const STEP_BITS: u8 = 16;

/// What a record holds, bit by bit: the code of the cell, the mask, the exponents of the steps, then the symbols.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RecordLayout {
    code_bits: u8,
    mask_bits: u8,
    step_bits: u8,
    /// Features, log-scales, coordinates of offsets: how many, and of how many bits.
    groups: [(u16, u8); N_GROUPS],
}

/// The memory that anchors are kept in.
pub struct RecordMemory<'s> {
    /// `[n_anchors, RecordLayout::n_words]`.
    pub records: &'s mut [u16],
    /// One bit a chunk.
    pub damaged: &'s mut [u32],
    /// `[n_tables]` origin and step.
    pub scales: &'s mut [[f32; 2]],
}

/// Anchors decoded once.
#[derive(Clone, Copy, Debug)]
pub struct AnchorRecords<'b, 's> {
    layout: RecordLayout,
    records: &'s [u16],
    damaged: &'s [u32],
    lattice: Lattice<'b>,
    /// The mask of an anchor that stores none.
    full_mask: u32,
    /// Whether features are passed over.
    without_features: bool,
    values: Values<'b, 's>,
}

/// How symbols become values.
#[derive(Clone, Copy, Debug)]
enum Values<'b, 's> {
    Static { table_of_channel: &'b [[u8; 2]], scales: &'s [[f32; 2]] },
    Context { base_steps: [f32; N_GROUPS] },
}

impl RecordLayout {
    /// * `symbol_bits`: of a feature, a log-scale, a coordinate of an offset. * `masked_offsets`: offsets that a mask has a bit
    ///   for, 0 without masks. * `context`: the steps are the anchor's own.
    pub const fn new(
        feature_dim: u16,
        n_log_scales: u16,
        n_offsets: u16,
        symbol_bits: [u8; N_GROUPS],
        lattice_bits: u8,
        masked_offsets: u16,
        context: bool,
    ) -> Self {
        let [feature, log_scale, offset] = symbol_bits;
        Self {
            code_bits: lattice_bits.saturating_mul(3),
            mask_bits: masked_offsets as u8,
            step_bits: if context { STEP_BITS } else { 0 },
            groups: [(feature_dim, feature), (n_log_scales, log_scale), (n_offsets.saturating_mul(3), offset)],
        }
    }

    /// Words of 16 bits of a record.
    pub const fn n_words(&self) -> usize {
        let [(n_features, feature), (n_log_scales, log_scale), (n_offsets, offset)] = self.groups;
        // At most 256 · 16 + 6 · 16 + 96 · 16 + 63 + 32 + 16.
        let bits = (n_features as usize)
            .wrapping_mul(feature as usize)
            .wrapping_add((n_log_scales as usize).wrapping_mul(log_scale as usize))
            .wrapping_add((n_offsets as usize).wrapping_mul(offset as usize))
            .wrapping_add(self.code_bits as usize)
            .wrapping_add(self.mask_bits as usize)
            .wrapping_add(self.step_bits as usize);
        bits.div_ceil(16)
    }

    /// Writes a record.
    fn write(&self, record: &mut [u16], symbols: &[f32], code: u64, mask: u32, steps: u16) {
        let mut writer = BitWriter::new(record);
        writer.push_wide(code, self.code_bits.into());
        writer.push_wide(mask.into(), self.mask_bits.into());
        writer.push(steps.into(), self.step_bits.into());
        let mut rest = symbols;
        for (n, bits) in self.groups {
            let (group, after) = rest.split_at_checked(n.into()).unwrap_or_default();
            for &symbol in group {
                // One that does not fit has its chunk refused.
                writer.push((symbol as i32).cast_unsigned(), bits.into());
            }
            rest = after;
        }
        writer.finish();
    }
}

impl RecordMemory<'_> {
    /// Decodes the first `n_chunks` chunks.
    ///
    /// * `row`: `[n_channels]` at least, for the symbols of the current anchor. * `scratch`: what the models of the symbols take.
    ///   * `skip_damage`: leaves damaged chunks out and remembers which.
    ///
    /// # Errors
    /// [`DecodeError::ChunkChecksum`] or [`DecodeError::ChunkStream`] for damage that is not left out.
    pub fn decode(
        &mut self,
        bundle: &Bundle<'_>,
        n_chunks: usize,
        layout: &RecordLayout,
        row: &mut [f32],
        scratch: &mut [u32],
        skip_damage: bool,
    ) -> Result<(), DecodeError> {
        let Self { records, damaged, .. } = self;
        let mut models = bundle.models(scratch, false)?;
        damaged.fill(0);
        let row = row.get_mut(..bundle.header().n_channels()).unwrap_or_default();
        // `max(1)`: a chunk size of zero would panic; there are always at least 8 channels.
        let mut slots = records.chunks_exact_mut(layout.n_words().max(1));
        for chunk in bundle.chunks().take(n_chunks) {
            match decode_chunk(&chunk, layout, &mut slots, row, &mut models) {
                Err(DecodeError::ChunkChecksum { .. } | DecodeError::ChunkStream { .. }) if skip_damage => {
                    let (word, bit) = place(chunk.index());
                    if let Some(word) = damaged.get_mut(word) {
                        *word |= bit;
                    }
                }
                result => result?,
            }
        }
        Ok(())
    }
}

impl<'b, 's> AnchorRecords<'b, 's> {
    /// The anchors in `memory`, which were [decoded](RecordMemory::decode) into it.
    pub fn new(bundle: &Bundle<'b>, layout: RecordLayout, memory: RecordMemory<'s>) -> Result<Self, DecodeError> {
        let RecordMemory { records, damaged, scales } = memory;
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
        Ok(Self {
            layout,
            records,
            damaged,
            lattice: *bundle.lattice(),
            // There are 1 to 32 offsets.
            full_mask: u32::MAX.wrapping_shr(u32::BITS.wrapping_sub(bundle.header().n_offsets.into())),
            without_features: false,
            values,
        })
    }

    /// The same, whose [`read`](Self::read) leaves the features of a row as they are.
    #[must_use]
    pub fn without_features(self) -> Self {
        Self { without_features: true, ..self }
    }

    /// Whether a chunk was left out because of damage.
    pub fn is_damaged(&self, chunk: u32) -> bool {
        let (word, bit) = place(chunk);
        self.damaged.get(word).is_some_and(|word| word & bit != 0)
    }

    /// Where anchor `index` of the file stands; fills `row` with its values, those of undrawn offsets with 0.
    ///
    /// # Budget
    /// A few shifts, a conversion and a multiplication a channel.
    // On its own it gets the registers that it needs.
    #[inline(never)]
    pub fn read(&self, index: u32, row: &mut [f32]) -> Option<AnchorSite> {
        let start = (index as usize).checked_mul(self.layout.n_words())?;
        let record = self.records.get(start..)?.get(..self.layout.n_words())?;
        let RecordLayout { code_bits, mask_bits, step_bits, mut groups } = self.layout;
        let mut reader = BitReader::new(record);
        let code = reader.wide(code_bits.into());
        let mask = if mask_bits == 0 { self.full_mask } else { reader.wide(mask_bits.into()) as u32 };
        let step_bits = reader.unsigned(step_bits.into());
        let mut n_skipped = 0;
        if cfg!(feature = "baked") && self.without_features {
            let [(n_features, bits), ..] = &mut groups;
            reader.skip(u32::from(*n_features).wrapping_mul((*bits).into()));
            n_skipped = usize::from(core::mem::take(n_features));
        }
        let mut slots = row.get_mut(n_skipped..).unwrap_or_default().iter_mut();
        match self.values {
            Values::Static { table_of_channel, scales } => {
                let mut tables = table_of_channel.get(n_skipped..).unwrap_or_default().iter();
                for (n, bits) in groups {
                    for (slot, &table) in slots.by_ref().zip(&mut tables).take(n.into()) {
                        let [origin, step] =
                            scales.get(usize::from(u16::from_le_bytes(table))).copied().unwrap_or_default();
                        *slot = f32::from_symbol(reader.signed(bits.into()), origin, step);
                    }
                }
                let [(n_features, _), (n_log_scales, _), _] = self.layout.groups;
                let offsets = row.get_mut(usize::from(n_features).saturating_add(n_log_scales.into())..);
                for (k, offset) in (0..).zip(offsets.unwrap_or_default().as_chunks_mut::<3>().0) {
                    if mask.wrapping_shr(k) & 1 == 0 {
                        *offset = [0.0; 3];
                    }
                }
            }
            Values::Context { base_steps } => {
                let steps = Steps::from_bits(base_steps, step_bits as u16);
                for ((n, bits), group) in groups.into_iter().zip(Group::ALL) {
                    let step = steps.value(group);
                    for slot in slots.by_ref().take(n.into()) {
                        *slot = f32::from_scaled(reader.signed(bits.into()), step);
                    }
                }
            }
        }
        Some(AnchorSite { lattice: self.lattice.cell(code), mask })
    }
}

/// Decodes a chunk into the next records; as many are passed over when it is damaged.
fn decode_chunk<'b, 'r>(
    chunk: &Chunk<'b>,
    layout: &RecordLayout,
    records: &mut impl Iterator<Item = &'r mut [u16]>,
    row: &mut [f32],
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
        anchors.values(row);
        layout.write(record, row, anchors.code(), site.mask, anchors.step_bits());
    }
    sound.and(anchors.finish())
}

/// Word and bit of a chunk.
const fn place(chunk: u32) -> (usize, u32) {
    ((chunk / u32::BITS) as usize, 1_u32.wrapping_shl(chunk))
}
