//! A table about to be written.

use pocketsplat_format::bundle::FrequencyTable;
use pocketsplat_format::entropy::{FREQUENCY_TOTAL, Slot};

use super::histogram::Histogram;
use crate::bundle::frequencies::frequencies;

/// Frequency of each value of a raw byte.
const RAW_BYTE_FREQUENCY: u16 = FREQUENCY_TOTAL >> 8;

/// A table with its frequencies settled.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::bundle) struct TableDraft {
    pub(in crate::bundle) step: f32,
    pub(in crate::bundle) min_symbol: i16,
    /// Where each entry begins, where the escape begins and where it ends, as bytes; the escape has at least one slot.
    pub(super) bounds: Vec<[u8; 2]>,
}

impl TableDraft {
    /// Distributes the slots: every used entry and the escape get at least one.
    pub(super) fn new(step: f32, histogram: &Histogram) -> Self {
        let trimmed = histogram.trimmed();
        let counts: Vec<u64> = trimmed.counts.iter().copied().chain([trimmed.escaped]).collect();
        let ends = frequencies(&counts, Some(counts.len() - 1)).into_iter().scan(0, |sum, frequency| {
            *sum += frequency;
            Some(*sum as u16)
        });
        let bounds = std::iter::once(0).chain(ends).map(u16::to_le_bytes).collect();
        let min_symbol = i16::try_from(trimmed.first).unwrap_or(0);
        Self { step, min_symbol, bounds }
    }

    /// The table for `symbols`.
    pub(in crate::bundle) fn of(step: f32, symbols: impl Iterator<Item = i16>) -> Self {
        Self::new(step, &Histogram::count(symbols))
    }

    /// The table of a bundle.
    pub(super) fn of_table(table: &FrequencyTable<'_>) -> Self {
        let bounds = table.bounds().map(u16::to_le_bytes).collect();
        Self { step: table.step, min_symbol: table.min_symbol, bounds }
    }

    /// The table as the decoder has it.
    pub(in crate::bundle) fn view(&self) -> FrequencyTable<'_> {
        // The origin is 0: symbol 0 is the value 0, and channels of equal step can share a table.
        FrequencyTable::new(0.0, self.step, self.min_symbol, &self.bounds)
    }

    /// The slots that code `symbol`, in reading order: its entry's, or the escape's and those of two raw bytes.
    pub(in crate::bundle) fn slots(&self, symbol: i16) -> impl Iterator<Item = Slot<()>> {
        let slot = |start: u16, frequency: u16| Slot { symbol: (), start, frequency };
        let bound = |index: usize| u16::from_le_bytes(self.bounds[index]);
        let slot_of = |entry: usize| slot(bound(entry), bound(entry + 1) - bound(entry));
        let n_symbols = self.view().n_symbols();
        let entry = usize::try_from(i32::from(symbol) - i32::from(self.min_symbol)).ok();
        let own = entry.filter(|&entry| entry < n_symbols).map(slot_of).filter(|slot| slot.frequency > 0);
        let (first, raw) = match own {
            Some(own) => (own, None),
            None => (slot_of(n_symbols), Some(symbol.to_be_bytes())),
        };
        let raw = raw.into_iter().flatten();
        std::iter::once(first)
            .chain(raw.map(move |byte| slot(u16::from(byte) * RAW_BYTE_FREQUENCY, RAW_BYTE_FREQUENCY)))
    }
}
