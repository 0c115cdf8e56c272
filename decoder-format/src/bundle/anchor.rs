//! The anchors of a chunk, one after the other: where each stands, which offsets it draws, and its channels.

mod bits;
mod channels;
mod record;

use pocketsplat_half::TABLE_WORDS;

use channels::{Channel, ChannelModels, ContextModels};
pub use record::{AnchorRecords, RecordLayout, RecordMemory};

use super::lattice::Lattice;
use super::tables::IndexedTables;
use super::{Bundle, Coder, MAX_FEATURE_DIM, n_log_scales};
use crate::context::{Context, MAX_CONTEXT_INPUTS, N_POSITION_INPUTS, Trail};
use crate::entropy::{AnsReader, MaskModel, TrieReader};
use crate::error::{DecodeError, Field, saturate};
use crate::stopwatch::Stopwatch;

/// Where an anchor stands and which of its offsets are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AnchorSite {
    /// Lattice coordinates; the position is `lattice · voxel_size`.
    pub lattice: [i32; 3],
    /// Bit k is set when offset k is drawn; the channels of the others are not in the file and read as 0.
    pub mask: u32,
}

/// The models of everything an anchor consists of, with the memory they work in; made by [`Bundle::anchor_models`].
#[derive(Debug)]
pub struct AnchorModels<'b, 's> {
    lattice: Lattice<'b>,
    masks: Option<MaskModel<'b>>,
    /// F features and the log-scales.
    n_scalars: u16,
    n_offsets: u16,
    channels: ChannelModels<'b, 's>,
}

/// Decodes the anchors of one chunk in their order, one at a time.
#[derive(Debug)]
#[must_use = "only `finish` tells whether the anchors were sound"]
pub struct AnchorReader<'b, 's, 'm> {
    at: SuspendedReader<'b>,
    models: &'m mut AnchorModels<'b, 's>,
}

/// Where in a chunk an [`AnchorReader`] is, between two anchors; it borrows no models.
#[derive(Clone, Copy, Debug)]
#[must_use = "only `AnchorReader::finish` tells whether the anchors were sound"]
pub struct SuspendedReader<'b> {
    chunk: u32,
    codes: TrieReader<'b>,
    symbols: AnsReader<'b>,
    code: u64,
    /// No channels were read yet.
    is_first: bool,
    site: AnchorSite,
}

impl<'b> Bundle<'b> {
    /// Words of memory that [`anchor_models`](Self::anchor_models) takes.
    #[must_use]
    pub fn anchor_scratch_words(&self) -> usize {
        // At most 360 tables, 272 inputs, 256 hidden units, twice 262 numbers kept.
        match self.coder() {
            Coder::Static(tables) => model_words(tables.len() as u16, 0, 0, 0),
            Coder::Context(context) => {
                let [inputs, hidden, kept] = context_lens(context);
                model_words(0, inputs as u16, hidden as u16, kept as u16)
            }
        }
    }

    /// Prepares the models of the anchors in `scratch`, whose content does not matter.
    ///
    /// * `scratch`: [`anchor_scratch_words`](Self::anchor_scratch_words).
    ///
    /// # Errors
    /// [`DecodeError::BufferTooShort`].
    ///
    /// # Budget
    /// With tables a look at each entry and 64 bisections, each; with a context nothing.
    pub fn anchor_models<'s>(&self, scratch: &'s mut [u32]) -> Result<AnchorModels<'b, 's>, DecodeError> {
        self.models(scratch, true)
    }

    /// The same.
    ///
    /// * `scaled`: if not, the value of a symbol is the symbol, so that a decoder needs no other reader for those.
    fn models<'s>(&self, scratch: &'s mut [u32], scaled: bool) -> Result<AnchorModels<'b, 's>, DecodeError> {
        let [needed, available] = [self.anchor_scratch_words(), scratch.len()];
        let too_short = DecodeError::BufferTooShort {
            field: Field::ModelBuffer,
            needed: saturate(needed),
            available: saturate(available),
        };
        let scratch = scratch.get_mut(..needed).ok_or(too_short)?;
        let channels = match self.coder() {
            Coder::Static(tables) => ChannelModels::Static(IndexedTables::new(tables, self.header(), scratch, scaled)?),
            // What bundles were refused for is not linked, here and below.
            Coder::Context(_) if !cfg!(feature = "context") => return Err(DecodeError::Internal),
            Coder::Context(context) => {
                let halves: &'s mut [i16] = bytemuck::try_cast_slice_mut(scratch).map_err(|_| DecodeError::Internal)?;
                let n_numbers = context_lens(context).into_iter().fold(0, usize::saturating_add);
                ChannelModels::Context(ContextModels {
                    context: *context,
                    numbers: halves.get_mut(..n_numbers).ok_or(DecodeError::Internal)?,
                    scaled,
                    symbol_bits: self.header().symbol_bits,
                    step_bits: 0,
                    trail: Trail::default(),
                })
            }
        };
        Ok(AnchorModels {
            lattice: *self.lattice(),
            masks: self.masks().copied(),
            n_scalars: self.header().n_scalars() as u16,
            n_offsets: self.header().n_offsets,
            channels,
        })
    }
}

const _: () = assert!(
    N_POSITION_INPUTS + MAX_FEATURE_DIM as usize + n_log_scales(true) as usize <= MAX_CONTEXT_INPUTS,
    "what a parent gives overflows no sum"
);

/// Words that so many tables take, or a context of such widths; whichever are more.
pub const fn model_words(n_tables: u16, inputs: u16, hidden: u16, kept: u16) -> usize {
    let tables = (n_tables as usize).saturating_mul(TABLE_WORDS);
    let context = (inputs as usize).saturating_add(hidden as usize).saturating_add(kept as usize).div_ceil(2);
    if tables > context { tables } else { context }
}

/// Numbers of the context's inputs, its hidden units, and those that it keeps.
fn context_lens(context: &Context<'_>) -> [usize; 3] {
    [context.n_inputs(), context.n_hidden(), context.n_kept()]
}

impl<'b, 's> AnchorModels<'b, 's> {
    /// The same models for another reader, which reads other anchors at the same time: tables are read by both, a context works in `scratch`.
    ///
    /// * `scratch`: what [`model_words`] says of no table, and of the context if there is one; of any content.
    ///
    /// # Errors
    /// [`DecodeError::BufferTooShort`]; [`DecodeError::Internal`] of a context where the crate is built without.
    ///
    /// # Budget
    /// Constant; no table is copied.
    pub fn shared(&self, scratch: &'s mut [u32]) -> Result<Self, DecodeError> {
        let channels = match &self.channels {
            ChannelModels::Static(tables) => ChannelModels::Static(*tables),
            ChannelModels::Context(_) if !cfg!(feature = "context") => return Err(DecodeError::Internal),
            ChannelModels::Context(models) => {
                let halves: &'s mut [i16] = bytemuck::try_cast_slice_mut(scratch).map_err(|_| DecodeError::Internal)?;
                let [needed, available] = [models.numbers.len(), halves.len()].map(|n| saturate(n.div_ceil(2)));
                let too_short = DecodeError::BufferTooShort { field: Field::ModelBuffer, needed, available };
                let numbers = halves.get_mut(..models.numbers.len()).ok_or(too_short)?;
                ChannelModels::Context(ContextModels { numbers, ..*models })
            }
        };
        Ok(Self { channels, ..*self })
    }

    /// Channels of an anchor.
    #[must_use]
    pub fn n_channels(&self) -> usize {
        usize::from(self.n_scalars).saturating_add(usize::from(self.n_offsets).saturating_mul(3))
    }
}

impl<'b, 's, 'm> AnchorReader<'b, 's, 'm> {
    pub(super) fn new(chunk: u32, words: &'b [[u8; 2]], models: &'m mut AnchorModels<'b, 's>) -> Self {
        let at = SuspendedReader {
            chunk,
            codes: models.lattice.trie.codes(),
            symbols: AnsReader::new(words),
            code: 0,
            is_first: true,
            site: AnchorSite::default(),
        };
        Self { at, models }
    }

    /// Lets go of the models between two anchors.
    pub fn suspend(self) -> SuspendedReader<'b> {
        self.at
    }

    /// Where the next anchor stands; one call an anchor, before its channels.
    // Not inlined: it has several callers, and an anchor's channels take a hundred times as long as a call.
    #[inline(never)]
    pub fn site(&mut self) -> AnchorSite {
        let SuspendedReader { codes, symbols, code, site, .. } = &mut self.at;
        *code = codes.next(symbols);
        let lattice = self.models.lattice.cell(*code);
        let mask = match &self.models.masks {
            Some(masks) => masks.mask(symbols),
            // There are 1 to 32 offsets.
            None => u32::MAX.wrapping_shr(u32::BITS.wrapping_sub(self.models.n_offsets.into())),
        };
        *site = AnchorSite { lattice, mask };
        *site
    }

    /// The anchor's symbols, one a channel; one call of this or of [`values`](Self::values) an anchor.
    pub fn symbols(&mut self, row: &mut [i16]) {
        self.read(row, &mut ());
    }

    /// The anchor's values, one a channel; one call of this or of [`symbols`](Self::symbols) an anchor.
    pub fn values(&mut self, row: &mut [f32]) {
        self.values_watched(row, &mut ());
    }

    /// As [`values`](Self::values); `watch` is in the stage of decoding before and after.
    pub fn values_watched(&mut self, row: &mut [f32], watch: &mut impl Stopwatch) {
        self.read(row, watch);
    }

    fn read(&mut self, row: &mut [impl Channel], watch: &mut impl Stopwatch) {
        let SuspendedReader { symbols, is_first, site, .. } = &mut self.at;
        let n_scalars = self.models.n_scalars.into();
        *symbols = self.models.channels.read(*site, n_scalars, core::mem::take(is_first), *symbols, row, watch);
    }

    /// The code of the cell that [`site`](Self::site) came to.
    pub(crate) fn code(&self) -> u64 {
        self.at.code
    }

    /// The exponents of the quantisation steps of the anchor whose channels were read last, as [`Steps::to_bits`] has
    /// them; 0 with tables.
    ///
    /// [`Steps::to_bits`]: crate::context::Steps::to_bits
    pub(crate) fn step_bits(&self) -> u16 {
        self.models.channels.step_bits()
    }

    /// Ends the chunk after its last anchor.
    ///
    /// # Errors
    /// [`DecodeError::ChunkStream`] when anchors are missing or too many, their symbols do not end where the bytes end, or one is
    /// beyond the header's bits.
    pub fn finish(self) -> Result<(), DecodeError> {
        let SuspendedReader { chunk, codes, symbols, .. } = self.at;
        match symbols.finish() {
            Ok(()) if codes.is_complete() => Ok(()),
            Ok(()) => Err(DecodeError::ChunkStream { chunk, left_bytes: 0 }),
            Err(left) => Err(DecodeError::ChunkStream { chunk, left_bytes: saturate(left) }),
        }
    }
}

impl<'b> SuspendedReader<'b> {
    /// Goes on where the reader was.
    ///
    /// * `models`: those it had, which read nothing else since; with others the anchors have no meaning.
    pub fn resume<'m, 's>(self, models: &'m mut AnchorModels<'b, 's>) -> AnchorReader<'b, 's, 'm> {
        AnchorReader { at: self, models }
    }
}
