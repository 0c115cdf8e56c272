//! Tables unpacked into scratch memory, with short cuts into them: what a symbol costs least with.

use bytemuck::{Pod, Zeroable};

use super::{Table, Tables, escaped};
use crate::entropy::{AnsReader, FREQUENCY_TOTAL, PRECISION_BITS, Slot, SymbolModel};
use crate::error::DecodeError;

/// Pieces of the range that have a short cut.
const N_SHORT_CUTS: usize = 32;
/// Bits of a quantile within such a piece.
const PIECE_BITS: u32 = PRECISION_BITS - N_SHORT_CUTS.ilog2();
/// Entries looked at one by one before the rest is bisected; hostile tables have thousands of empty ones in a row.
const MAX_STEPS: usize = 16;

/// A table as the decoder reads it.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(in crate::bundle) struct IndexedTable {
    origin: f32,
    step: f32,
    /// Where its ends begin, in pairs of bytes from the section's start.
    first: u32,
    n_symbols: u16,
    min_symbol: i16,
    /// For each piece of the range an entry at or before the first that ends beyond the piece's start.
    short_cuts: [u8; N_SHORT_CUTS],
}

/// All tables of a bundle, unpacked.
#[derive(Clone, Copy, Debug)]
pub(in crate::bundle) struct IndexedTables<'a, 's> {
    channel_tables: &'a [[u8; 2]],
    section: &'a [[u8; 2]],
    tables: &'s [IndexedTable],
}

/// The frequencies of one table.
struct IndexedModel<'a, 's> {
    table: &'s IndexedTable,
    ends: &'a [[u8; 2]],
}

impl IndexedTable {
    fn new(table: &Table<'_>, first: u32) -> Self {
        let mut short_cuts = [0; N_SHORT_CUTS];
        for (piece, short_cut) in (0_u16..).zip(&mut short_cuts) {
            let start = piece << PIECE_BITS;
            let entry = table.ends.partition_point(|&end| u16::from_le_bytes(end) <= start);
            // A table is longer than that when its steps are fine; the search then starts early and walks.
            *short_cut = u8::try_from(entry).unwrap_or(u8::MAX);
        }
        let Table { origin, step, min_symbol, ends } = *table;
        Self { origin, step, first, n_symbols: ends.len() as u16, min_symbol, short_cuts }
    }
}

impl<'a, 's> IndexedTables<'a, 's> {
    /// Unpacks `tables` into `slots`, one each.
    pub(in crate::bundle) fn new(tables: &Tables<'a>, slots: &'s mut [IndexedTable]) -> Result<Self, DecodeError> {
        for (index, slot) in slots.iter_mut().enumerate() {
            let (Some(offset), Some(table)) = (tables.offset_of(index), tables.get(index)) else {
                return Err(DecodeError::Internal);
            };
            // Every part of the section has an even length, so ends begin at even offsets.
            *slot = IndexedTable::new(&table, (offset.saturating_add(Table::FIXED_LEN) >> 1) as u32);
        }
        let (section, _) = tables.section.as_chunks();
        Ok(Self { channel_tables: tables.channel_tables, section, tables: slots })
    }

    /// Decodes the next symbol of channel `channel`, with the origin and the step of its values.
    #[inline]
    pub(in crate::bundle) fn symbol(&self, channel: usize, reader: &mut AnsReader<'_>) -> (i16, f32, f32) {
        let number = self.channel_tables.get(channel).map_or(0, |&table| usize::from(u16::from_le_bytes(table)));
        let Some(table) = self.tables.get(number) else { return (0, 0.0, 0.0) };
        let first = table.first as usize;
        let ends = self.section.get(first..first.wrapping_add(table.n_symbols.into())).unwrap_or_default();
        let symbol = reader.symbol(&IndexedModel { table, ends }).unwrap_or_else(|| escaped(reader));
        (symbol, table.origin, table.step)
    }
}

impl SymbolModel for IndexedModel<'_, '_> {
    type Symbol = Option<i16>;

    /// Walks from the short cut of the quantile's piece.
    #[inline]
    fn slot(&self, quantile: u16) -> Slot<Option<i16>> {
        let piece = usize::from(quantile >> PIECE_BITS);
        let mut index = self.table.short_cuts.get(piece).map_or(0, |&entry| usize::from(entry));
        let mut start = match index.checked_sub(1).and_then(|before| self.ends.get(before)) {
            Some(&end) => u16::from_le_bytes(end),
            None => 0,
        };
        let rest = self.ends.get(index..).unwrap_or_default();
        for &end in rest.iter().take(MAX_STEPS) {
            let end = u16::from_le_bytes(end);
            if quantile < end {
                // `Table::check` made sure that min_symbol + index is an i16.
                let symbol = self.table.min_symbol.wrapping_add(index as i16);
                return Slot { symbol: Some(symbol), start, frequency: end.wrapping_sub(start) };
            }
            start = end;
            index = index.wrapping_add(1);
        }
        if rest.len() > MAX_STEPS {
            let table = Table { origin: 0.0, step: 0.0, min_symbol: self.table.min_symbol, ends: self.ends };
            return table.slot(quantile);
        }
        Slot { symbol: None, start, frequency: FREQUENCY_TOTAL.wrapping_sub(start) }
    }
}

#[cfg(test)]
mod tests {
    use std::{vec, vec::Vec};

    use super::{IndexedModel, IndexedTable};
    use crate::bundle::Table;
    use crate::entropy::{FREQUENCY_TOTAL, SymbolModel};

    /// Tables of all kinds: wide, narrow, long with empty entries, empty.
    fn tables() -> Vec<Vec<[u8; 2]>> {
        let bell = |n: u32| {
            let weight = move |i: u32| (i * (n - 1 - i) + 1) as u64;
            let total: u64 = (0..n).map(weight).sum::<u64>() + 1;
            (0..n).scan(0, move |sum, i| {
                *sum += weight(i);
                Some((*sum * u64::from(FREQUENCY_TOTAL - 1) / total) as u16)
            })
        };
        let empty_run = (0..1000).map(|i| if i < 990 { 70 } else { 70 + i - 990 });
        [vec![], vec![4095], bell(5).collect(), bell(60).collect(), bell(1000).collect(), empty_run.collect()]
            .map(|ends: Vec<u16>| ends.into_iter().map(u16::to_le_bytes).collect())
            .into()
    }

    #[test]
    fn short_cuts_lead_where_bisection_leads() {
        for ends in tables() {
            let table = Table { origin: 0.0, step: 1.0, min_symbol: -7, ends: &ends };
            let indexed = IndexedTable::new(&table, 0);
            let model = IndexedModel { table: &indexed, ends: &ends };
            for quantile in 0..FREQUENCY_TOTAL {
                assert_eq!(model.slot(quantile), table.slot(quantile), "{} entries, quantile {quantile}", ends.len());
            }
        }
    }
}
