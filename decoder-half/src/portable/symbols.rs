//! Symbols of asymmetric numeral systems (Duda 2013): runs of symbols of tables, and paths of a trie.

use core::ops::Range;

use bytemuck::{Pod, Zeroable};

/// The frequencies of a model add up to this; frequencies are multiples of its inverse.
pub const FREQUENCY_TOTAL: u16 = 1 << PRECISION_BITS;
/// Bits of a quantile.
pub const PRECISION_BITS: u32 = 12;
/// While words are left, the state of a stream never falls below this.
pub const STATE_MIN: u32 = 1 << 16;

/// Pieces of the range that have a short cut into a table.
const N_SHORT_CUTS: usize = 64;
/// Bits of a quantile within such a piece.
const PIECE_BITS: u32 = PRECISION_BITS - N_SHORT_CUTS.ilog2();
/// Entries that a search goes over at most. Of a piece with more, which entries without slots make, none has a short cut.
const MOST_IN_PIECE: usize = 1 << PIECE_BITS;

/// Words of a table in memory.
pub const TABLE_WORDS: usize = size_of::<SymbolTable>() / 4;

/// The context of a node of a trie by its last three ancestors, two bits each; the nearest is the lowest of the three bits, set if
/// it has both children. It is how many of them have both, 2 and 3 counted alike.
pub const NODE_CONTEXTS: u32 = 0b10_10_10_01_10_01_01_00;
/// Levels of a trie that are walked at once.
pub const LEVELS_AT_ONCE: usize = 32;

/// The frequencies of the nodes of a level, in each context: the slots below the first are "both children", those up to the second "only
/// child 0", the others "only child 1". Little-endian.
pub type LevelFrequencies = [[[u8; 2]; 2]; 3];

/// A table in the file.
#[derive(Clone, Debug)]
pub struct Entries {
    /// Value of symbol 0.
    pub origin: f32,
    /// Distance between neighbouring symbols' values.
    pub step: f32,
    /// The symbol of the first entry.
    pub first_symbol: i32,
    /// Where its bounds lie in the section, bytes: `[n_entries + 2]` where the entries begin, where the escape begins, and
    /// [`FREQUENCY_TOTAL`]; little-endian, from 0 without falling.
    pub bounds: Range<usize>,
    /// The entries that short cuts lead to; a piece of the range with another one has none.
    pub usual: Range<usize>,
}

/// Short cuts into the bounds of a table.
///
/// [`ChannelTables::new`] makes sure of every one: its bounds lie in the section, the last is [`FREQUENCY_TOTAL`], and no short cut is
/// beyond the pair of the last two. So every search ends within the bounds.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct SymbolTable {
    /// For each piece of the range the last entry that begins at or before its start; the escape where there is none.
    pub(crate) short_cuts: [u16; N_SHORT_CUTS],
    /// The symbol of the first entry.
    pub(crate) first_symbol: i32,
    pub(crate) origin: f32,
    step: f32,
    /// Where the bounds begin, bytes of the section.
    pub(crate) bounds: u32,
}

impl SymbolTable {
    /// Nothing where the bounds are not as they have to be.
    fn new(entries: &Entries, section: &[u8]) -> Option<Self> {
        let (bounds, _) = section.get(entries.bounds.clone())?.as_chunks();
        let [.., last] = bounds else { return None };
        let escape = bounds.len().checked_sub(2)?;
        if u16::from_le_bytes(*last) != FREQUENCY_TOTAL || escape > u16::MAX.into() {
            return None;
        }
        let entry_at = |quantile: u16| {
            let next = bounds.partition_point(|&bound| u16::from_le_bytes(bound) <= quantile);
            next.saturating_sub(1).min(escape)
        };
        let mut short_cuts = [escape as u16; N_SHORT_CUTS];
        for (piece, short_cut) in (0_u16..).zip(&mut short_cuts) {
            let start = piece << PIECE_BITS;
            let (first, last) = (entry_at(start), entry_at(start | ((1 << PIECE_BITS) - 1)));
            // Where the escape is in the piece, a search comes to its end.
            let last_symbol = last.min(escape.saturating_sub(1));
            let is_short = last.saturating_sub(first) <= MOST_IN_PIECE;
            if is_short && entries.usual.contains(&first) && entries.usual.contains(&last_symbol) {
                *short_cut = first as u16;
            }
        }
        let Entries { origin, step, first_symbol, .. } = *entries;
        Some(Self { short_cuts, first_symbol, origin, step, bounds: u32::try_from(entries.bounds.start).ok()? })
    }

    /// The symbol, start and frequency of the entry that has the quantile, found by walking from the short cut of its piece;
    /// `None` for the escape, and where there is no short cut.
    #[inline(always)]
    fn slot(&self, section: &[u8], quantile: u32) -> Option<(i32, u32, u32)> {
        let (bounds, _) = section.get(self.bounds as usize..)?.as_chunks();
        let bound = |index: u32| bounds.get(index as usize).map_or(u32::MAX, |&bound| u16::from_le_bytes(bound).into());
        let mut entry = u32::from(*self.short_cuts.get((quantile >> PIECE_BITS) as usize)?);
        let mut start = bound(entry);
        loop {
            let end = bound(entry.wrapping_add(1));
            if quantile < end {
                // The escape ends there, and so may the last entry before one that has no slots.
                let symbol = self.first_symbol.wrapping_add(entry as i32);
                return (end < FREQUENCY_TOTAL.into()).then_some((symbol, start, end.wrapping_sub(start)));
            }
            (entry, start) = (entry.wrapping_add(1), end);
        }
    }
}

/// The tables of a scene in memory, and which channel uses which.
#[derive(Clone, Copy, Debug)]
pub struct ChannelTables<'b, 's> {
    pub(crate) tables: &'s [SymbolTable],
    /// `[n_channels]` the table of each channel, little-endian; all are in `tables`.
    pub(crate) numbers: &'b [[u8; 2]],
    /// What the bounds lie in.
    pub(crate) section: &'b [u8],
}

impl<'b, 's> ChannelTables<'b, 's> {
    /// Makes short cuts into tables in `memory`.
    ///
    /// * `memory`: [`TABLE_WORDS`] a table. * `tables`: as many as there is memory for. * `numbers`: `[n_channels]` the table of each
    ///   channel, little-endian. * `section`: what the tables' bounds lie in.
    ///
    /// Nothing when there are fewer tables than that, a channel names one that there is not, or bounds are not as they have to be.
    #[must_use]
    pub fn new(
        memory: &'s mut [u32],
        tables: impl Iterator<Item = Entries>,
        numbers: &'b [[u8; 2]],
        section: &'b [u8],
    ) -> Option<Self> {
        let slots: &mut [SymbolTable] = bytemuck::try_cast_slice_mut(memory).ok()?;
        let mut n_tables = 0;
        for (slot, table) in slots.iter_mut().zip(tables) {
            *slot = SymbolTable::new(&table, section)?;
            n_tables += 1;
        }
        let exist = numbers.iter().all(|&number| usize::from(u16::from_le_bytes(number)) < n_tables);
        (exist && n_tables == slots.len()).then_some(Self { tables: slots, numbers, section })
    }

    /// Number of channels.
    #[must_use]
    pub fn n_channels(&self) -> usize {
        self.numbers.len()
    }

    /// Which table channel `channel` uses; 0 of one that there is not.
    #[must_use]
    pub fn number_of(&self, channel: usize) -> usize {
        self.numbers.get(channel).map_or(0, |&number| u16::from_le_bytes(number).into())
    }

    /// Origin and step of the values of channel `channel`: that of a symbol is `origin + symbol·step`, multiplied, rounded, then added.
    #[must_use]
    pub fn scale_of(&self, channel: usize) -> [f32; 2] {
        self.tables.get(self.number_of(channel)).map_or([0.0; 2], |table| [table.origin, table.step])
    }

    /// As [`read_values`], in safe Rust on every target; `value_of` makes values of symbol, origin and step.
    #[inline(always)]
    pub fn read_values_with<T>(
        &self,
        first: usize,
        values: &mut [T],
        stream: &mut Stream<'_>,
        value_of: impl Fn(i32, f32, f32) -> T,
    ) -> usize {
        // A copy stays in registers.
        let mut local = *stream;
        let mut n_done = 0;
        for (value, &number) in values.iter_mut().zip(self.numbers.get(first..).unwrap_or_default()) {
            let Some(table) = self.tables.get(usize::from(u16::from_le_bytes(number))) else { break };
            let Some((symbol, start, frequency)) = table.slot(self.section, local.quantile()) else { break };
            local.advance(start, frequency);
            *value = value_of(symbol, table.origin, table.step);
            n_done += 1;
        }
        *stream = local;
        n_done
    }
}

/// Fills `values` from channel `first` on; returns how many, which is fewer at an escape and at a symbol without a short cut: the stream
/// is before it.
///
/// # Budget
/// About 55 instructions a value; with the assembly of a Cortex-M 33, and 3 for each entry walked past.
#[inline(always)]
pub fn read_values(tables: &ChannelTables<'_, '_>, first: usize, values: &mut [f32], stream: &mut Stream<'_>) -> usize {
    tables.read_values_with(first, values, stream, |symbol, origin, step| origin + symbol as f32 * step)
}

/// The rest of a stream.
#[derive(Clone, Copy, Debug)]
pub struct Stream<'a> {
    /// What the next symbols are in.
    pub state: u32,
    /// Words that the state has not taken yet, little-endian.
    pub words: &'a [[u8; 2]],
}

impl Stream<'_> {
    /// What the next symbol's slot contains, below [`FREQUENCY_TOTAL`].
    #[inline(always)]
    #[must_use]
    pub fn quantile(&self) -> u32 {
        self.state & ((1 << PRECISION_BITS) - 1)
    }

    /// Leaves the next symbol behind, whose slot contains the quantile.
    #[inline(always)]
    pub fn advance(&mut self, start: u32, frequency: u32) {
        // Below 2²⁰ · 2¹² + 2¹²; wrapping costs nothing and says that no value can panic here.
        let offset = self.quantile().wrapping_sub(start);
        self.state = (self.state >> PRECISION_BITS).wrapping_mul(frequency).wrapping_add(offset);
        self.refill();
    }

    /// Takes a word if the state has room for it and there is one.
    #[inline(always)]
    pub fn refill(&mut self) {
        if self.state < STATE_MIN
            && let Some((&word, rest)) = self.words.split_first()
        {
            self.state = (self.state << 16) | u32::from(u16::from_le_bytes(word));
            self.words = rest;
        }
    }
}

/// Goes down a trie from a node, by at most [`LEVELS_AT_ONCE`] levels, a symbol each; through child 0 where there are both.
///
/// Returns the branches taken, and which nodes have both children, the last lowest in each; above them the latter has the lowest
/// bits of `both`, which are those of the nodes before.
///
/// # Budget
/// 43 instructions a level; about 21 with the assembly of a Cortex-M.
#[inline(always)]
#[must_use]
pub fn descend(levels: &[LevelFrequencies], both: u32, stream: &mut Stream<'_>) -> [u32; 2] {
    // A copy of its own stays in registers.
    let mut local = *stream;
    let (mut code, mut both) = (0_u32, both);
    for contexts in levels.iter().take(LEVELS_AT_ONCE) {
        let context = NODE_CONTEXTS >> ((both & 7) << 1) & 3;
        let node = contexts.get(context as usize).copied().unwrap_or_default();
        let [end_both, end_zero] = node.map(|end| u32::from(u16::from_le_bytes(end)));
        let quantile = local.quantile();
        let (start, end, is_both, is_one) = if quantile < end_both {
            (0, end_both, 1, 0)
        } else if quantile < end_zero {
            (end_both, end_zero, 0, 0)
        } else {
            (end_zero, FREQUENCY_TOTAL.into(), 0, 1)
        };
        local.advance(start, end.wrapping_sub(start));
        code = (code << 1) | is_one;
        both = (both << 1) | is_both;
    }
    *stream = local;
    [code, both]
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::{ChannelTables, Entries, FREQUENCY_TOTAL, PIECE_BITS, Stream, TABLE_WORDS, descend, read_values};

    /// The symbol that a quantile stands for, and how far into its slot it lies, by a look at every entry but the escape.
    fn expected(first_symbol: i32, bounds: &[u16], quantile: u32) -> Option<(i32, u32, u32)> {
        let pairs = bounds.windows(2).take(bounds.len() - 2).zip(first_symbol..);
        let mut found = pairs.filter(|(pair, _)| (u32::from(pair[0])..u32::from(pair[1])).contains(&quantile));
        found.next().map(|(pair, symbol)| (symbol, u32::from(pair[1] - pair[0]), quantile - u32::from(pair[0])))
    }

    fn entries(first_symbol: i32, start: usize, n_bounds: usize) -> Entries {
        let bounds = start..start + 2 * n_bounds;
        Entries { origin: 0.5, step: 0.25, first_symbol, bounds, usual: 0..n_bounds.saturating_sub(2) }
    }

    #[test]
    fn every_quantile_leads_to_its_entry_or_nowhere() {
        let even = |n: u16, step: u16| (0..=n).map(move |i| i * step).collect::<Vec<_>>();
        let lists = [
            even(1, 4095),
            even(64, 63),
            even(80, 50),
            even(2000, 2),
            even(1, 4096),
            std::vec![0],
            std::vec![0, 901, 901, 1000, 4095],
        ];
        for (first_symbol, mut bounds) in (-40..).zip(lists) {
            bounds.push(FREQUENCY_TOTAL);
            // At any address.
            let section: Vec<u8> =
                [9, 9, 9].into_iter().chain(bounds.iter().flat_map(|bound| bound.to_le_bytes())).collect();
            for usual in [0..bounds.len() - 2, 1..bounds.len() - 2, 0..(bounds.len() - 2) / 2] {
                let entries = Entries { usual: usual.clone(), ..entries(first_symbol, 3, bounds.len()) };
                let mut memory = [0; TABLE_WORDS];
                let numbers = [[0; 2]];
                let tables =
                    ChannelTables::new(&mut memory, [entries].into_iter(), &numbers, &section).expect("one table");
                for quantile in 0..u32::from(FREQUENCY_TOTAL) {
                    let before = 1 << 28 | quantile;
                    let mut stream = Stream { state: before, words: &[] };
                    let mut values = [f32::NAN];
                    let n = read_values(&tables, 0, &mut values, &mut stream);
                    let found = expected(first_symbol, &bounds, quantile);
                    // A piece with an entry that is not usual is left out, and so is what ends where everything does.
                    let piece = quantile >> PIECE_BITS << PIECE_BITS;
                    let in_piece = (piece..piece + (1 << PIECE_BITS)).filter_map(|q| expected(0, &bounds, q));
                    let is_usual = in_piece.clone().count() > 0
                        && in_piece.into_iter().all(|(entry, ..)| usual.contains(&(entry as usize)));
                    let ends = |(_, frequency, offset): &(i32, u32, u32)| quantile - offset + frequency;
                    match found.filter(|slot| is_usual && ends(slot) < FREQUENCY_TOTAL.into()) {
                        Some((symbol, frequency, offset)) => {
                            assert_eq!((n, values[0]), (1, 0.5 + symbol as f32 * 0.25), "{bounds:?}, {quantile}");
                            assert_eq!(stream.state, (1 << 16) * frequency + offset, "{bounds:?}, {quantile}");
                        }
                        None => assert_eq!((n, stream.state), (0, before), "{usual:?} of {bounds:?}, {quantile}"),
                    }
                }
            }
        }
    }

    /// Each of thousands of entries without slots would be a step.
    #[test]
    fn a_piece_of_many_entries_has_no_short_cut() {
        for (n_empty, is_short) in [(62, true), (1500, false), (60_000, false)] {
            let bounds = [0, 70].into_iter().chain(core::iter::repeat_n(71, n_empty)).chain([4000, FREQUENCY_TOTAL]);
            let section: Vec<u8> = bounds.flat_map(u16::to_le_bytes).collect();
            let mut memory = [0; TABLE_WORDS];
            let entries = [entries(0, 0, section.len() / 2)].into_iter();
            let tables = ChannelTables::new(&mut memory, entries, &[[0, 0]], &section).expect("one table");
            let found = [10, 64, 80, 128].map(|quantile| {
                let mut stream = Stream { state: 1 << 28 | quantile, words: &[] };
                read_values(&tables, 0, &mut [0.0], &mut stream) == 1
            });
            assert_eq!(found, [true, is_short, is_short, true], "{n_empty} entries without slots in the second piece");
        }
    }

    #[test]
    fn tables_that_are_missing_or_end_early_are_refused() {
        let section = [0, 0, 255, 15, 0, 16, 0, 0];
        let mut memory = [0; 2 * TABLE_WORDS];
        let table = || entries(0, 0, 3);
        let is_made = |memory: &mut [u32], tables: &[Entries], numbers: &[[u8; 2]]| {
            ChannelTables::new(memory, tables.iter().cloned(), numbers, &section).is_some()
        };
        assert!(!is_made(&mut memory, &[table()], &[[0, 0]]), "one of two tables");
        assert!(!is_made(&mut memory, &[table(), table()], &[[2, 0]]), "no table 2");
        assert!(is_made(&mut memory, &[table(), table()], &[[1, 0]]), "table 1");
        assert!(!is_made(&mut memory[1..], &[table(), table()], &[]), "half a table");
        for wrong in [entries(0, 0, 2), entries(0, 2, 3), entries(0, 0, 1), entries(0, 0, 0), entries(0, 6, 3)] {
            assert!(!is_made(&mut memory, &[table(), wrong.clone()], &[[1, 0]]), "{wrong:?}");
        }
    }

    #[test]
    fn a_path_stops_after_its_levels() {
        let levels = [[[4096_u16.to_le_bytes(); 2]; 3]; 40];
        let mut stream = Stream { state: 1 << 31, words: &[] };
        assert_eq!(descend(&levels[..2], 1, &mut stream), [0, 0b111], "both children of each node");
        assert_eq!(descend(&levels, 0, &mut stream), [0, u32::MAX], "32 levels at most");
        assert_eq!(stream.state, 1 << 31, "what is certain takes no bit");
    }
}
