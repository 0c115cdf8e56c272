//! Tables unpacked into scratch memory, with short cuts into them: what a symbol costs least with.

use bytemuck::{Pod, Zeroable};

use super::{FrequencyTable, Tables};
use crate::bundle::Header;
use crate::context::N_GROUPS;
use crate::entropy::{AnsReader, FREQUENCY_TOTAL, PRECISION_BITS};
use crate::error::DecodeError;

/// Pieces of the range that have a short cut.
const N_SHORT_CUTS: usize = 64;
/// Bits of a quantile within such a piece.
const PIECE_BITS: u32 = PRECISION_BITS - N_SHORT_CUTS.ilog2();
/// Bounds in memory. Powers of two make every index a sound one without a comparison.
const N_BOUNDS: usize = 64;
/// Most entries in memory: a bound more says where the last of them ends, and one ends every search.
const MAX_ENTRIES: usize = N_BOUNDS - 2;

/// The most frequent entries of a table, neighbours all of them; the others are looked up in the file.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(in crate::bundle) struct IndexedTable {
    pub(in crate::bundle) origin: f32,
    pub(in crate::bundle) step: f32,
    /// The symbol of the first entry.
    first_symbol: i32,
    n_entries: u32,
    /// For each piece of the range the last entry that begins at or before its start, or the first.
    short_cuts: [u8; N_SHORT_CUTS],
    /// Where the entries begin, where the last ends, and then [`FREQUENCY_TOTAL`].
    bounds: [u16; N_BOUNDS],
}

/// All tables of a bundle, unpacked.
#[derive(Clone, Copy, Debug)]
pub(in crate::bundle) struct IndexedTables<'a, 's> {
    tables: Tables<'a>,
    indexed: &'s [IndexedTable],
    /// Bits of the symbols of a feature, of a log-scale, of a coordinate of an offset.
    pub(in crate::bundle) symbol_bits: [u8; N_GROUPS],
    pub(in crate::bundle) feature_dim: u16,
}

impl IndexedTable {
    /// * `bits`: symbols of more are left in the file.
    fn new(table: &FrequencyTable<'_>, bits: u32) -> Self {
        let inner = table.bounds.split_last().map_or(&[][..], |(_, inner)| inner);
        // Entries from the one of the least symbol of so many bits to that of the largest.
        let beyond = 1_i32.wrapping_shl(bits.wrapping_sub(1));
        let entry_of = |symbol: i32| {
            let entry = symbol.wrapping_sub(table.min_symbol.into()).max(0) as usize;
            entry.min(table.n_symbols())
        };
        let skipped = entry_of(beyond.wrapping_neg());
        let inner = inner.get(skipped..=entry_of(beyond)).unwrap_or_default();
        let n_entries = inner.len().saturating_sub(1).min(MAX_ENTRIES);
        // The entries with the most slots.
        let slots = |bounds: &[[u8; 2]]| {
            let [first, last] = [bounds.first(), bounds.last()].map(|b| b.map_or(0, |&b| u16::from_le_bytes(b)));
            last.wrapping_sub(first)
        };
        let windows = (0..).zip(inner.windows(n_entries.saturating_add(1)));
        let (first, window) = windows.max_by_key(|(_, window)| slots(window)).unwrap_or_default();
        let mut bounds = [FREQUENCY_TOTAL; N_BOUNDS];
        for (bound, &stored) in bounds.iter_mut().zip(window) {
            *bound = u16::from_le_bytes(stored);
        }
        let mut short_cuts = [0; N_SHORT_CUTS];
        for (piece, short_cut) in (0_u16..).zip(&mut short_cuts) {
            let start = piece << PIECE_BITS;
            let next = bounds.partition_point(|&bound| bound <= start);
            *short_cut = next.saturating_sub(1) as u8;
        }
        let FrequencyTable { origin, step, min_symbol, .. } = *table;
        // `FrequencyTable::check` made sure that the symbol of every entry is an i16.
        let first_symbol = i32::from(min_symbol).wrapping_add(skipped as i32).wrapping_add(first);
        Self { origin, step, first_symbol, n_entries: n_entries as u32, short_cuts, bounds }
    }
}

impl<'a, 's> IndexedTables<'a, 's> {
    /// Unpacks `tables` into `slots`, one each.
    ///
    /// * `scaled`: if not, the value of a symbol is the symbol.
    pub(in crate::bundle) fn new(
        tables: &Tables<'a>,
        header: &Header,
        slots: &'s mut [IndexedTable],
        scaled: bool,
    ) -> Result<Self, DecodeError> {
        // What all channels of a table have room for stays in memory, and needs no comparison there.
        slots.iter_mut().for_each(|slot| slot.n_entries = 16);
        for (channel, &number) in tables.channel_tables.iter().enumerate() {
            if let Some(slot) = slots.get_mut(usize::from(u16::from_le_bytes(number))) {
                slot.n_entries = slot.n_entries.min(header.symbol_bits_of(channel).into());
            }
        }
        for (index, slot) in slots.iter_mut().enumerate() {
            *slot = IndexedTable::new(&tables.get(index).ok_or(DecodeError::Internal)?, slot.n_entries);
            if !scaled {
                (slot.origin, slot.step) = (0.0, 1.0);
            }
        }
        let Header { symbol_bits, feature_dim, .. } = *header;
        Ok(Self { tables: *tables, indexed: slots, symbol_bits, feature_dim })
    }

    /// `[n_channels]` the table of each channel, as bytes of its number.
    pub(in crate::bundle) fn of_channels(&self) -> &'a [[u8; 2]] {
        self.tables.channel_tables
    }

    /// Decodes the next symbol of `reader` with table number `number`; returns it, an i16, with its table. A symbol of more than
    /// `bits` has the stream refused.
    ///
    /// # Budget
    /// About 55 instructions on a Cortex-M4; 200 for a symbol that has no entry in memory.
    #[inline(always)]
    pub(in crate::bundle) fn symbol(
        &self,
        number: [u8; 2],
        bits: u8,
        reader: &mut AnsReader<'_>,
    ) -> Option<(i32, &'s IndexedTable)> {
        let number = usize::from(u16::from_le_bytes(number));
        let table = self.indexed.get(number)?;
        if let Some((symbol, start, frequency)) = table.slot(reader.quantile()) {
            reader.advance(start, frequency);
            return Some((symbol, table));
        }
        let (after, symbol) = rare_symbol(&self.tables, number, bits, *reader);
        *reader = after;
        Some((symbol, table))
    }
}

/// The next symbol of `reader`, looked up in the file; by value, so that the reader of a loop stays in registers.
#[cold]
fn rare_symbol<'a>(tables: &Tables<'_>, number: usize, bits: u8, mut reader: AnsReader<'a>) -> (AnsReader<'a>, i32) {
    let symbol = i32::from(tables.get(number).map_or(0, |table| table.symbol(&mut reader)));
    reader.refuse_beyond(bits, symbol ^ (symbol >> 31));
    (reader, symbol)
}

impl IndexedTable {
    /// Symbol, start and frequency of the entry that has the quantile, found by walking from the short cut of its piece;
    /// `None` when no entry in memory has it.
    #[inline(always)]
    fn slot(&self, quantile: u32) -> Option<(i32, u32, u32)> {
        const LAST: u32 = N_BOUNDS as u32 - 1;
        let bound = |index: u32| self.bounds.get((index & LAST) as usize).map_or(0, |&bound| u32::from(bound));
        let mut entry = self.short_cuts.get((quantile >> PIECE_BITS) as usize).map_or(0, |&entry| u32::from(entry));
        let mut start = bound(entry);
        if quantile < start {
            return None;
        }
        loop {
            let next = entry.wrapping_add(1);
            let end = bound(next);
            // The last bound is beyond every quantile.
            if quantile < end {
                let symbol = self.first_symbol.wrapping_add(entry as i32);
                return (entry < self.n_entries).then_some((symbol, start, end.wrapping_sub(start)));
            }
            (entry, start) = (next, end);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{vec, vec::Vec};

    use super::IndexedTable;
    use crate::bundle::FrequencyTable;
    use crate::entropy::{FREQUENCY_TOTAL, Slot, SymbolModel};

    /// Tables of all kinds: wide, narrow, long with empty entries, empty.
    fn tables() -> Vec<Vec<[u8; 2]>> {
        let bell = |n: u32| {
            let weight = move |i: u32| u64::from(i * (n - 1 - i) + 1);
            let total: u64 = (0..n).map(weight).sum::<u64>() + 1;
            (0..n).scan(0, move |sum, i| {
                *sum += weight(i);
                Some((*sum * u64::from(FREQUENCY_TOTAL - 1) / total) as u16)
            })
        };
        let empty_run = (0..1000).map(|i| if i < 990 { 70 } else { 70 + i - 990 });
        [vec![], vec![4095], bell(5).collect(), bell(62).collect(), bell(1000).collect(), empty_run.collect()]
            .map(|ends: Vec<u16>| [vec![0], ends, vec![FREQUENCY_TOTAL]].concat())
            .map(|bounds| bounds.into_iter().map(u16::to_le_bytes).collect())
            .into()
    }

    #[test]
    fn short_cuts_lead_where_bisection_leads_or_nowhere() {
        for bounds in tables() {
            let table = FrequencyTable { origin: 0.0, step: 1.0, min_symbol: -7, bounds: &bounds };
            let indexed = IndexedTable::new(&table, 16);
            let mut n_found = 0;
            for quantile in 0..FREQUENCY_TOTAL {
                let expected = table.slot(quantile);
                match indexed.slot(quantile.into()) {
                    Some((symbol, start, frequency)) => {
                        n_found += 1;
                        let [start, frequency] = [start, frequency].map(|n| n as u16);
                        let found = Slot { symbol: Some(symbol as i16), start, frequency };
                        assert_eq!(found, expected, "{} bounds, quantile {quantile}", bounds.len());
                    }
                    None => assert!(expected.symbol.is_none() || bounds.len() > 64, "{} bounds", bounds.len()),
                }
            }
            // The fullest entries are those of the window that was taken.
            let bound = |index: usize| u16::from_le_bytes(bounds[index]);
            let most = (62..bounds.len() - 1).map(|last| bound(last) - bound(last - 62)).max();
            assert_eq!(n_found, most.unwrap_or(bound(bounds.len() - 2)), "{} bounds", bounds.len());
        }
    }

    #[test]
    fn symbols_beyond_the_bits_of_a_channel_stay_in_the_file() {
        for (bounds, bits) in tables().into_iter().flat_map(|bounds| (1..=16).map(move |bits| (bounds.clone(), bits))) {
            let table = FrequencyTable { origin: 0.0, step: 1.0, min_symbol: -7, bounds: &bounds };
            let indexed = IndexedTable::new(&table, bits);
            for quantile in 0..FREQUENCY_TOTAL {
                let expected = table.slot(quantile);
                let Some((symbol, start, frequency)) = indexed.slot(quantile.into()) else {
                    // Or the table is too long for the memory.
                    let within = |symbol| (-1 << (bits - 1)..1 << (bits - 1)).contains(&i32::from(symbol));
                    assert!(!expected.symbol.is_some_and(within) || bounds.len() > 64, "{bits} bits, {quantile}");
                    continue;
                };
                assert!((-1 << (bits - 1)..1 << (bits - 1)).contains(&symbol), "{symbol} in {bits} bits");
                let [start, frequency] = [start, frequency].map(|n| n as u16);
                assert_eq!(Slot { symbol: Some(symbol as i16), start, frequency }, expected, "{bits} bits, {quantile}");
            }
        }
    }
}
