//! Tables with short cuts in scratch memory: what a symbol costs least with.

use pocketsplat_half::{ChannelTables, Entries};

use super::{FrequencyTable, TABLE_HEAD_LEN, Tables};
use crate::bundle::Header;
use crate::context::N_GROUPS;
use crate::entropy::AnsReader;
use crate::error::DecodeError;

/// All tables of a bundle, with short cuts into each.
#[derive(Clone, Copy, Debug)]
pub(in crate::bundle) struct IndexedTables<'a, 's> {
    tables: Tables<'a>,
    short_cuts: ChannelTables<'a, 's>,
    /// Bits of the symbols of a feature, of a log-scale, of a coordinate of an offset.
    symbol_bits: [u8; N_GROUPS],
    /// Where features end, and where log-scales do.
    group_ends: [usize; N_GROUPS - 1],
}

/// What short cuts are made of.
///
/// * `start`: where the table's bounds begin in the section. * `bits`: symbols of more have none. * `scaled`: if not, the value of a symbol
///   is the symbol.
fn entries(table: &FrequencyTable<'_>, start: usize, bits: u8, scaled: bool) -> Entries {
    // Entries from the one of the least symbol of so many bits to that of the largest.
    let beyond = 1_i32.wrapping_shl(u32::from(bits).wrapping_sub(1));
    let entry_of = |symbol: i32| {
        let entry = symbol.wrapping_sub(table.min_symbol.into()).max(0) as usize;
        entry.min(table.n_symbols())
    };
    let FrequencyTable { origin, step, min_symbol, bounds } = *table;
    let [origin, step] = if scaled { [origin, step] } else { [0.0, 1.0] };
    let end = start.saturating_add(bounds.as_flattened().len());
    // `FrequencyTable::check` made sure that the symbol of every entry is an i16.
    Entries {
        origin,
        step,
        first_symbol: min_symbol.into(),
        bounds: start..end,
        usual: entry_of(beyond.wrapping_neg())..entry_of(beyond),
    }
}

impl<'a, 's> IndexedTables<'a, 's> {
    /// Makes short cuts in `memory`, of [`TABLE_WORDS`](pocketsplat_half::TABLE_WORDS) each.
    ///
    /// * `scaled`: if not, the value of a symbol is the symbol.
    pub(in crate::bundle) fn new(
        tables: &Tables<'a>,
        header: &Header,
        memory: &'s mut [u32],
        scaled: bool,
    ) -> Result<Self, DecodeError> {
        let numbers = tables.channel_tables;
        let entries_of_all = (0_u16..).zip(0..tables.len()).map_while(|(number, index)| {
            // What all channels of a table have room for needs no comparison.
            let users = numbers.iter().enumerate().filter(|&(_, &user)| u16::from_le_bytes(user) == number);
            let bits = users.map(|(channel, _)| header.symbol_bits_of(channel)).min().unwrap_or(16);
            let start = (u32::from_le_bytes(*tables.offsets.get(index)?) as usize).saturating_add(TABLE_HEAD_LEN);
            Some(entries(&tables.get(index)?, start, bits, scaled))
        });
        let short_cuts =
            ChannelTables::new(memory, entries_of_all, numbers, tables.section).ok_or(DecodeError::Internal)?;
        let group_ends = [header.feature_dim.into(), header.n_scalars()];
        Ok(Self { tables: *tables, short_cuts, symbol_bits: header.symbol_bits, group_ends })
    }

    /// Fills `run` with the next symbols of `reader`, of the channels from `first` on. A symbol of more bits than its channel has
    /// has the stream refused.
    ///
    /// * `read`: fills as many as there are short cuts to, in order, and returns how many. * `value_of`: the value of a symbol, by origin and step.
    ///
    /// # Budget
    /// About 38 instructions a symbol on a Cortex-M4; 200 for one that has no short cut.
    #[inline(always)]
    pub(in crate::bundle) fn read_run<'b, T>(
        &self,
        mut first: usize,
        mut run: &mut [T],
        reader: &mut AnsReader<'b>,
        read: impl Fn(&ChannelTables<'_, '_>, usize, &mut [T], &mut AnsReader<'b>) -> usize,
        value_of: impl Fn(i32, [f32; 2]) -> T,
    ) {
        while !run.is_empty() {
            let n = read(&self.short_cuts, first, run, reader);
            let Some((value, rest)) = run.get_mut(n..).and_then(<[T]>::split_first_mut) else { return };
            let channel = first.wrapping_add(n);
            let [features_end, log_scales_end] = self.group_ends;
            let [feature, log_scale, offset] = self.symbol_bits;
            let bits = if channel < features_end {
                feature
            } else if channel < log_scales_end {
                log_scale
            } else {
                offset
            };
            let symbol = rare_symbol(&self.tables, self.short_cuts.number_of(channel), bits, reader);
            *value = value_of(symbol, self.short_cuts.scale_of(channel));
            (first, run) = (channel.wrapping_add(1), rest);
        }
    }
}

/// The next symbol of `reader`, looked up in the file.
#[cold]
#[inline(never)]
fn rare_symbol(tables: &Tables<'_>, number: usize, bits: u8, reader: &mut AnsReader<'_>) -> i32 {
    let symbol = i32::from(tables.get(number).map_or(0, |table| table.symbol(reader)));
    reader.refuse_beyond(bits, symbol ^ (symbol >> 31));
    symbol
}

#[cfg(test)]
mod tests {
    use std::{vec, vec::Vec};

    use pocketsplat_half::{ChannelTables, Stream, TABLE_WORDS};

    use super::entries;
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
        [vec![], vec![4095], bell(5).collect(), bell(64).collect(), bell(1000).collect(), empty_run.collect()]
            .map(|ends: Vec<u16>| [vec![0], ends, vec![FREQUENCY_TOTAL]].concat())
            .map(|bounds| bounds.into_iter().map(u16::to_le_bytes).collect())
            .into()
    }

    /// The symbol of each quantile that has a short cut, after a comparison of its slot with that of the bisection.
    fn symbols_with_short_cut(bounds: &[[u8; 2]], bits: u8) -> Vec<Option<i32>> {
        let table = FrequencyTable { origin: 0.0, step: 1.0, min_symbol: -7, bounds };
        let mut memory = [0; TABLE_WORDS];
        let made = [entries(&table, 0, bits, true)].into_iter();
        let short_cuts = ChannelTables::new(&mut memory, made, &[[0; 2]], bounds.as_flattened()).expect("one table");
        let symbol_of = |quantile: u16| {
            let mut stream = Stream { state: 1 << 28 | u32::from(quantile), words: &[] };
            let mut symbol = [i32::MAX];
            let n = short_cuts.read_values_with(0, &mut symbol, &mut stream, |symbol, _, _| symbol);
            (n == 1).then(|| {
                let Slot { symbol: expected, start, frequency } = table.slot(quantile);
                let state = (1 << 16) * u32::from(frequency) + u32::from(quantile - start);
                assert_eq!(
                    (expected.map(i32::from), state),
                    (Some(symbol[0]), stream.state),
                    "{bits} bits, {quantile}"
                );
                symbol[0]
            })
        };
        (0..FREQUENCY_TOTAL).map(symbol_of).collect()
    }

    #[test]
    fn short_cuts_lead_where_bisection_leads_or_nowhere() {
        for bounds in tables() {
            let found = symbols_with_short_cut(&bounds, 16);
            // All but the escape, what ends where it would begin, and what shares 64 quantiles with more than as many entries.
            let bound = |index: usize| u16::from_le_bytes(bounds[index]);
            let n_coded = (0..bounds.len()).map(bound).filter(|&bound| bound < FREQUENCY_TOTAL).max().unwrap_or(0);
            let entry_at = |quantile: u16| (0..bounds.len()).rfind(|&index| bound(index) <= quantile).unwrap_or(0);
            let is_short = |piece: u16| entry_at(piece | 63) - entry_at(piece) <= 64;
            let expected = (0..n_coded).filter(|quantile| is_short(quantile & !63)).count();
            assert_eq!(found.iter().flatten().count(), expected, "{} bounds", bounds.len());
        }
    }

    #[test]
    fn symbols_beyond_the_bits_of_a_channel_stay_in_the_file() {
        for (bounds, bits) in tables().into_iter().flat_map(|bounds| (1..=16).map(move |bits| (bounds.clone(), bits))) {
            let found = symbols_with_short_cut(&bounds, bits);
            let within = -1 << (bits - 1)..1 << (bits - 1);
            assert!(found.into_iter().flatten().all(|symbol| within.contains(&symbol)), "{bits} bits");
        }
    }
}
