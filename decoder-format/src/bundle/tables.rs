//! The tables section: per channel a quantisation step and the frequencies of its symbols.

mod index;

pub(super) use index::IndexedTables;

use crate::bytes::{Cursor, Fields};
use crate::entropy::{AnsReader, FREQUENCY_TOTAL, Slot, SymbolModel};
use crate::error::{DecodeError, Field, SectionKind, in_range, saturate};

/// Largest magnitude of a dequantised value: e^±88 and more is clamped anyway, and no product of two overflows.
const MAX_VALUE: f32 = 1e18;

/// Length of a table before its bounds, bytes.
const TABLE_HEAD_LEN: usize = 12;

/// Largest number of tables: one for each channel there can be.
const MAX_TABLES: u32 = 360;

/// The tables of a bundle and which channel uses which.
#[derive(Clone, Copy, Debug)]
pub struct Tables<'a> {
    /// `[n_channels]` table of each channel.
    channel_tables: &'a [[u8; 2]],
    /// `[n_tables]` where each table begins in `section`.
    offsets: &'a [[u8; 4]],
    section: &'a [u8],
}

/// The quantisation and the frequencies of a channel's symbols.
///
/// Entry i owns the slots from `bounds[i]` to `bounds[i + 1]`, and the last piece, up to [`FREQUENCY_TOTAL`], is the
/// escape's.
#[derive(Clone, Copy, Debug)]
pub struct FrequencyTable<'a> {
    /// Value of symbol 0.
    pub origin: f32,
    /// Distance between neighbouring symbols' values.
    pub step: f32,
    /// The symbol that the first entry stands for.
    pub min_symbol: i16,
    /// `[n_symbols + 2]`, from 0 to [`FREQUENCY_TOTAL`].
    bounds: &'a [[u8; 2]],
}

impl<'a> Tables<'a> {
    pub(super) fn parse(section: &'a [u8], n_channels: usize) -> Result<Self, DecodeError> {
        let mut cursor = Cursor::new(section, SectionKind::Tables);
        let [n_tables, found_channels] = Fields::new(cursor.record::<4>()?).u16s();
        in_range(Field::NTables, n_tables.into(), 1, MAX_TABLES)?;
        in_range(Field::NChannels, found_channels.into(), saturate(n_channels), saturate(n_channels))?;
        let channel_tables = cursor.pairs(n_channels)?;
        for (channel, &table) in (0..).zip(channel_tables) {
            let table = u16::from_le_bytes(table);
            if table >= n_tables {
                return Err(DecodeError::NoSuchTable { channel, table: table.into(), n_tables: n_tables.into() });
            }
        }
        let (offsets, _) = cursor.bytes(usize::from(n_tables).saturating_mul(4))?.as_chunks();
        for (table, &offset) in (0..).zip(offsets) {
            let offset = u32::from_le_bytes(offset);
            let expected = saturate(cursor.position());
            in_range(Field::TableOffset, offset, expected, expected)?;
            FrequencyTable::parse(&mut cursor)?.check(SectionKind::Tables, table)?;
        }
        cursor.end()?;
        Ok(Self { channel_tables, offsets, section })
    }

    /// The bytes of a section: the reverse of `parse`.
    ///
    /// * `channel_tables`: `[n_channels]` the number in `tables` of each channel's table.
    pub fn emit<'t>(tables: &'t [FrequencyTable<'t>], channel_tables: &'t [u16]) -> impl Iterator<Item = u8> + use<'t> {
        let index_len = tables.len().saturating_mul(4).saturating_add(channel_tables.len().saturating_mul(2));
        let offsets = tables.iter().scan(index_len.saturating_add(4), |end, table| {
            let offset = saturate(*end);
            *end = end.saturating_add(table.buffer_len());
            Some(offset)
        });
        // Both are at most 360.
        let counts = [tables.len() as u16, channel_tables.len() as u16];
        let numbers = counts.into_iter().chain(channel_tables.iter().copied()).flat_map(u16::to_le_bytes);
        numbers.chain(offsets.flat_map(u32::to_le_bytes)).chain(tables.iter().flat_map(FrequencyTable::emit))
    }

    /// Number of tables.
    #[must_use]
    pub fn len(&self) -> usize {
        self.offsets.len()
    }

    /// Whether there is no table; a parsed bundle has at least one.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.offsets.is_empty()
    }

    /// Number of channels.
    #[must_use]
    pub fn n_channels(&self) -> usize {
        self.channel_tables.len()
    }

    /// Which table channel `channel` uses.
    #[inline]
    #[must_use]
    pub fn table_of(&self, channel: usize) -> Option<usize> {
        self.channel_tables.get(channel).map(|&table| usize::from(u16::from_le_bytes(table)))
    }

    /// Table number `table`.
    #[must_use]
    pub fn get(&self, table: usize) -> Option<FrequencyTable<'a>> {
        let offset = u32::from_le_bytes(*self.offsets.get(table)?);
        let bytes = self.section.get(offset as usize..)?;
        FrequencyTable::parse(&mut Cursor::new(bytes, SectionKind::Tables)).ok()
    }

    /// `[n_channels]` the table of each channel, as bytes of its number.
    pub(super) fn of_channel_numbers(&self) -> &'a [[u8; 2]] {
        self.channel_tables
    }

    /// The tables of all channels in order.
    pub fn of_channels(&self) -> impl Iterator<Item = FrequencyTable<'a>> + use<'a> {
        let tables = *self;
        (0..tables.n_channels()).filter_map(move |channel| tables.get(tables.table_of(channel)?))
    }
}

impl<'a> FrequencyTable<'a> {
    /// A table about to be written.
    ///
    /// * `bounds`: `[n_symbols + 2]` little-endian, from 0 to [`FREQUENCY_TOTAL`] without falling; the last entry is the escape.
    #[must_use]
    pub const fn new(origin: f32, step: f32, min_symbol: i16, bounds: &'a [[u8; 2]]) -> Self {
        Self { origin, step, min_symbol, bounds }
    }

    /// Reads a table; the section of `cursor` goes into errors.
    pub(super) fn parse(cursor: &mut Cursor<'a>) -> Result<Self, DecodeError> {
        let mut fields = Fields::new(cursor.record::<TABLE_HEAD_LEN>()?);
        let [origin, step] = fields.f32s();
        let [min_symbol, n_symbols] = fields.u16s();
        let bounds = cursor.pairs(usize::from(n_symbols).saturating_add(2))?;
        Ok(Self { origin, step, min_symbol: min_symbol.cast_signed(), bounds })
    }

    /// The table's bytes: the reverse of `parse`.
    pub fn emit(&self) -> impl Iterator<Item = u8> + use<'a> {
        let scale = [self.origin, self.step].into_iter().flat_map(f32::to_le_bytes);
        // A table has at most 2¹⁶ − 2 entries of its own.
        let counts = self.min_symbol.to_le_bytes().into_iter().chain((self.n_symbols() as u16).to_le_bytes());
        scale.chain(counts).chain(self.bounds.as_flattened().iter().copied())
    }

    /// How many bytes [`emit`](Self::emit) makes.
    #[must_use]
    pub fn buffer_len(&self) -> usize {
        self.bounds.len().saturating_mul(2).saturating_add(TABLE_HEAD_LEN)
    }

    /// Number of symbols that have an entry of their own.
    #[must_use]
    pub fn n_symbols(&self) -> usize {
        self.bounds.len().saturating_sub(2)
    }

    /// `[n_symbols + 2]` where the entries begin, then where the escape begins and where it ends.
    pub fn bounds(&self) -> impl ExactSizeIterator<Item = u16> + use<'a> {
        self.bounds.iter().map(|&bound| u16::from_le_bytes(bound))
    }

    /// The value that a symbol stands for: `origin + symbol·step`, multiplied, rounded, then added.
    ///
    /// # Budget
    /// One conversion, one multiplication, one addition.
    #[inline]
    #[must_use]
    pub fn value(&self, symbol: i16) -> f32 {
        self.origin + f32::from(symbol) * self.step
    }

    /// Decodes the next symbol of `reader`, an escaped one included.
    #[inline]
    pub fn symbol(&self, reader: &mut AnsReader<'_>) -> i16 {
        reader.symbol(self).unwrap_or_else(|| reader.escaped())
    }

    pub(super) fn check(&self, section: SectionKind, table: u32) -> Result<(), DecodeError> {
        if !(self.step.is_finite() && self.step > 0.0 && self.step * 32768.0 + self.origin.abs() < MAX_VALUE) {
            return Err(DecodeError::BadFloat { field: Field::TableScale, index: table });
        }
        // The last entry's symbol must still be an i16.
        let most = i32::from(i16::MAX).abs_diff(i32::from(self.min_symbol)).saturating_add(1);
        in_range(Field::TableSymbols, saturate(self.n_symbols()), 0, most)?;
        let mut before = 0;
        for (entry, bound) in (0..).zip(self.bounds()) {
            // The escape keeps at least one slot, so that every i16 can be coded.
            let sound = match self.n_symbols().checked_sub(entry) {
                _ if entry == 0 => bound == 0,
                Some(_) => before <= bound && bound < FREQUENCY_TOTAL,
                None => bound == FREQUENCY_TOTAL,
            };
            if !sound {
                return Err(DecodeError::BadBound { section, table: table as u16, entry: saturate(entry) });
            }
            before = bound;
        }
        Ok(())
    }
}

impl SymbolModel for FrequencyTable<'_> {
    /// `None` is the escape: the symbol follows as two raw bytes, high then low.
    type Symbol = Option<i16>;

    /// Finds the last bound that is not beyond the quantile, by bisection.
    #[inline]
    fn slot(&self, quantile: u16) -> Slot<Option<i16>> {
        // The first bound is 0 and the last beyond every quantile.
        let next = self.bounds.partition_point(|&bound| u16::from_le_bytes(bound) <= quantile);
        let entry = next.wrapping_sub(1);
        let bound = |index: usize| self.bounds.get(index).map_or(0, |&bound| u16::from_le_bytes(bound));
        let start = bound(entry);
        // `check` made sure that min_symbol + entry is an i16.
        let symbol = (entry < self.n_symbols()).then_some(self.min_symbol.wrapping_add(entry as i16));
        Slot { symbol, start, frequency: bound(next).wrapping_sub(start) }
    }
}
