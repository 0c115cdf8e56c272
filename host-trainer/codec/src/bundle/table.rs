//! The static frequency tables: one for each group of channels that is cheaper together than apart.

mod draft;
mod histogram;

pub(super) use draft::TableDraft;
use histogram::Histogram;
use pocketsplat_format::bundle::{FrequencyTable, Tables};

use super::channels::ChannelName;
use super::quantise::SymbolRows;
use pocketsplat_kernels::scene::ModelShape;

/// The tables of a bundle and which channel uses which.
pub(super) struct TableSet {
    pub(super) tables: Vec<TableDraft>,
    /// `[n_channels]`.
    pub(super) channel_tables: Vec<usize>,
}

/// Channels that share a table.
struct ChannelGroup {
    step: f32,
    channels: Vec<usize>,
    histogram: Histogram,
    /// Bits of its table and its symbols.
    bits: f64,
}

impl TableSet {
    /// Counts the symbols of every channel and merges channels of equal step as long as the file gets shorter.
    ///
    /// Greedy: each round merges the pair that saves most. `O(n_channels²)` trial merges.
    ///
    /// * `steps`: of features, log-scales, offsets.
    pub(super) fn build(rows: &SymbolRows, shape: &ModelShape, steps: [f32; 3]) -> Self {
        let mut groups: Vec<ChannelGroup> = (0..rows.n_channels)
            .map(|channel| {
                let name = ChannelName::of(shape, channel);
                let coded = (0..rows.drawn.len()).filter(|&anchor| name.is_coded(rows.drawn[anchor]));
                let histogram = Histogram::count(coded.map(|anchor| rows.symbols_of(anchor)[channel]));
                let step = steps[name.group()];
                ChannelGroup { step, channels: vec![channel], bits: histogram.trimmed().bits, histogram }
            })
            .collect();
        merge_while_it_saves(&mut groups);
        groups.sort_by_key(|group| group.channels.iter().min().copied());
        let mut channel_tables = vec![0; rows.n_channels];
        for (table, group) in groups.iter().enumerate() {
            for &channel in &group.channels {
                channel_tables[channel] = table;
            }
        }
        let tables = groups.iter().map(|group| TableDraft::new(group.step, &group.histogram)).collect();
        Self { tables, channel_tables }
    }

    /// The tables of a bundle.
    pub(super) fn of(tables: &Tables<'_>) -> Self {
        let drafts = (0..tables.len()).filter_map(|table| tables.get(table)).map(|table| TableDraft::of_table(&table));
        let of_channel = (0..tables.n_channels()).filter_map(|channel| tables.table_of(channel));
        Self { tables: drafts.collect(), channel_tables: of_channel.collect() }
    }

    /// The table of channel `channel`.
    pub(super) fn of_channel(&self, channel: usize) -> &TableDraft {
        &self.tables[self.channel_tables[channel]]
    }

    /// The section's bytes.
    pub(super) fn section(&self) -> Vec<u8> {
        let tables: Vec<FrequencyTable<'_>> = self.tables.iter().map(TableDraft::view).collect();
        let channel_tables: Vec<u16> = self.channel_tables.iter().map(|&table| table as u16).collect();
        Tables::emit(&tables, &channel_tables).collect()
    }
}

fn merge_while_it_saves(groups: &mut Vec<ChannelGroup>) {
    let saving = |a: &ChannelGroup, b: &ChannelGroup| {
        if a.step != b.step {
            return f64::NEG_INFINITY;
        }
        a.bits + b.bits - a.histogram.merged(&b.histogram).trimmed().bits
    };
    let mut savings: Vec<Vec<f64>> =
        (0..groups.len()).map(|i| (0..i).map(|j| saving(&groups[i], &groups[j])).collect()).collect();
    loop {
        let pairs =
            savings.iter().enumerate().flat_map(|(i, row)| row.iter().enumerate().map(move |(j, &s)| (i, j, s)));
        let Some((i, j, saved)) = pairs.max_by(|a, b| a.2.total_cmp(&b.2)) else { break };
        if saved <= 0.0 {
            break;
        }
        // ChannelGroup i, the later one, joins group j.
        let joined = groups.remove(i);
        savings.remove(i);
        for row in savings.iter_mut().skip(i) {
            row.remove(i);
        }
        let group = &mut groups[j];
        group.histogram = group.histogram.merged(&joined.histogram);
        group.bits = group.histogram.trimmed().bits;
        group.channels.extend(joined.channels);
        for k in 0..groups.len() {
            if k != j {
                savings[k.max(j)][k.min(j)] = saving(&groups[k], &groups[j]);
            }
        }
    }
}
