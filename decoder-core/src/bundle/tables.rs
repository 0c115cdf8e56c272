//! The tables section: per channel a quantisation step and the frequencies of its symbols.

mod index;

pub(super) use index::{IndexedTable, IndexedTables};

use super::cursor::{Cursor, saturate};
use super::header::in_range;
use crate::entropy::{AnsReader, FREQUENCY_TOTAL, Slot, SymbolModel, UniformByte};
use crate::error::{DecodeError, Field, SectionKind};

/// Largest magnitude of a dequantised value: e^±88 and more is clamped anyway, and no product of two overflows.
const MAX_VALUE: f32 = 1e18;

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
/// `ends[i]` is the sum of the frequencies of symbols `0..=i`; what is left up to [`FREQUENCY_TOTAL`] is the escape's.
#[derive(Clone, Copy, Debug)]
pub struct Table<'a> {
    /// Value of symbol 0.
    pub origin: f32,
    /// Distance between neighbouring symbols' values.
    pub step: f32,
    /// The symbol that the first entry stands for.
    pub min_symbol: i16,
    ends: &'a [[u8; 2]],
}

impl<'a> Tables<'a> {
    pub(super) fn parse(section: &'a [u8], n_channels: usize) -> Result<Self, DecodeError> {
        let mut cursor = Cursor::new(section, SectionKind::Tables);
        let n_tables = cursor.u16()?;
        let found_channels = cursor.u16()?;
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
            Table::parse(&mut cursor)?.check(SectionKind::Tables, table)?;
        }
        cursor.end()?;
        Ok(Self { channel_tables, offsets, section })
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
    pub fn get(&self, table: usize) -> Option<Table<'a>> {
        let bytes = self.section.get(self.offset_of(table)?..)?;
        Table::parse(&mut Cursor::new(bytes, SectionKind::Tables)).ok()
    }

    /// The tables of all channels in order.
    pub fn of_channels(&self) -> impl Iterator<Item = Table<'a>> + use<'a> {
        let tables = *self;
        (0..tables.n_channels()).filter_map(move |channel| tables.get(tables.table_of(channel)?))
    }

    /// Where table number `table` begins in the section.
    fn offset_of(&self, table: usize) -> Option<usize> {
        self.offsets.get(table).map(|&offset| u32::from_le_bytes(offset) as usize)
    }
}

impl<'a> Table<'a> {
    /// Length of a table before its ends, bytes.
    const FIXED_LEN: usize = 12;

    /// Reads a table; the section of `cursor` goes into errors.
    pub(super) fn parse(cursor: &mut Cursor<'a>) -> Result<Self, DecodeError> {
        let [origin, step] = cursor.f32s()?;
        let min_symbol = cursor.i16()?;
        let n_symbols = cursor.u16()?;
        Ok(Self { origin, step, min_symbol, ends: cursor.pairs(n_symbols.into())? })
    }

    /// Number of symbols that have an entry of their own.
    #[must_use]
    pub fn n_symbols(&self) -> usize {
        self.ends.len()
    }

    /// Sums of frequencies up to and with each entry.
    pub fn ends(&self) -> impl ExactSizeIterator<Item = u16> + use<'a> {
        self.ends.iter().map(|&end| u16::from_le_bytes(end))
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
        reader.symbol(self).unwrap_or_else(|| escaped(reader))
    }

    pub(super) fn check(&self, section: SectionKind, table: u32) -> Result<(), DecodeError> {
        if !(self.step.is_finite() && self.step > 0.0 && self.step * 32768.0 + self.origin.abs() < MAX_VALUE) {
            return Err(DecodeError::BadFloat { field: Field::TableScale, index: table });
        }
        // The last entry's symbol must still be an i16.
        let most = i32::from(i16::MAX).abs_diff(i32::from(self.min_symbol)).saturating_add(1);
        in_range(Field::TableSymbols, saturate(self.ends.len()), 0, most)?;
        let mut before = 0;
        for (entry, end) in (0..).zip(self.ends()) {
            // The escape keeps at least one slot, so that every i16 can be coded.
            if end < before || end >= FREQUENCY_TOTAL {
                return Err(DecodeError::NotIncreasing { section, table: table as u16, entry });
            }
            before = end;
        }
        Ok(())
    }
}

/// The symbol after an escape: two raw bytes, high then low.
#[cold]
fn escaped(reader: &mut AnsReader<'_>) -> i16 {
    let high = reader.symbol(&UniformByte);
    let low = reader.symbol(&UniformByte);
    i16::from_be_bytes([high, low])
}

impl SymbolModel for Table<'_> {
    /// `None` is the escape: the symbol follows as two raw bytes, high then low.
    type Symbol = Option<i16>;

    /// Finds the first entry whose end lies beyond the quantile, by bisection.
    #[inline]
    fn slot(&self, quantile: u16) -> Slot<Option<i16>> {
        let index = self.ends.partition_point(|&end| u16::from_le_bytes(end) <= quantile);
        let start = match index.checked_sub(1).and_then(|before| self.ends.get(before)) {
            Some(&end) => u16::from_le_bytes(end),
            None => 0,
        };
        let (end, symbol) = match self.ends.get(index) {
            // `check` made sure that min_symbol + index is an i16.
            Some(&end) => (u16::from_le_bytes(end), Some(self.min_symbol.wrapping_add(index as i16))),
            None => (FREQUENCY_TOTAL, None),
        };
        Slot { symbol, start, frequency: end.wrapping_sub(start) }
    }
}
