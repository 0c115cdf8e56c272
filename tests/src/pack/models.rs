//! What codes the channels of an anchor: tables, or a context.

use pocketsplat_format::bundle::{FrequencyTable, Tables};
use pocketsplat_format::context::{Context, Group, N_GROUPS, Steps, Trail};
use pocketsplat_format::entropy::{FREQUENCY_TOTAL, NormalModel};

use super::stream::{Slots, frequencies, raw};

/// Cell, drawn offsets and symbols of an anchor.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Anchor {
    /// Lattice coordinates.
    pub cell: [i32; 3],
    /// Bit k is set if offset k is drawn.
    pub drawn: u32,
    /// One a channel; 0 for those of offsets that are not drawn.
    pub symbols: Vec<i16>,
}

/// A frequency table.
#[derive(Clone, Debug, PartialEq)]
pub struct TableDraft {
    /// Value of symbol 0.
    pub origin: f32,
    /// Distance of neighbouring values.
    pub step: f32,
    /// Symbol of the first entry.
    pub min_symbol: i16,
    /// Where entries begin, then where the escape begins and ends.
    pub bounds: Vec<u16>,
}

impl TableDraft {
    /// The table of symbols from `least` to `most`, in the proportions of `symbols`; what is outside is escaped.
    ///
    /// A symbol of the range that does not occur has no slots; the escape has at least one.
    pub fn counting(step: f32, [least, most]: [i16; 2], symbols: impl Iterator<Item = i16>) -> Self {
        let mut counts = vec![0_u32; (i32::from(most) - i32::from(least) + 1) as usize];
        let mut n_escaped = 0;
        for symbol in symbols {
            match counts.get_mut((i32::from(symbol) - i32::from(least)) as usize) {
                Some(count) => *count += 1,
                None => n_escaped += 1,
            }
        }
        let escape = if n_escaped > 0 { 64 } else { 1 };
        let mut bounds = vec![0];
        let shares = frequencies(&counts, FREQUENCY_TOTAL - escape);
        bounds.extend(shares.iter().scan(0, |end, share| {
            *end += share;
            Some(*end)
        }));
        bounds.push(FREQUENCY_TOTAL);
        Self { origin: 0.0, step, min_symbol: least, bounds }
    }

    /// The slots of a symbol.
    pub fn slots(&self, symbol: i16) -> Vec<Slots> {
        let entry = i32::from(symbol) - i32::from(self.min_symbol);
        let n_symbols = self.bounds.len() - 2;
        let slots_of = |entry: usize| (self.bounds[entry], self.bounds[entry + 1] - self.bounds[entry]);
        match usize::try_from(entry).ok().filter(|&entry| entry < n_symbols).map(slots_of) {
            Some(own @ (_, 1..)) => vec![own],
            _ => self.escaped(symbol),
        }
    }

    /// The slots of a symbol that takes the escape whether it has an entry or not.
    pub fn escaped(&self, symbol: i16) -> Vec<Slots> {
        let [high, low] = symbol.to_be_bytes();
        let escape = self.bounds[self.bounds.len() - 2];
        vec![(escape, FREQUENCY_TOTAL - escape), raw(high), raw(low)]
    }

    /// Its bytes.
    pub fn bytes(&self) -> Vec<u8> {
        self.viewed(|table| table.emit().collect())
    }

    fn viewed<T>(&self, of: impl FnOnce(FrequencyTable<'_>) -> T) -> T {
        let bounds: Vec<[u8; 2]> = self.bounds.iter().map(|bound| bound.to_le_bytes()).collect();
        of(FrequencyTable::new(self.origin, self.step, self.min_symbol, &bounds))
    }
}

/// The tables section.
pub fn tables_section(tables: &[TableDraft], of_channel: &[u16]) -> Vec<u8> {
    let bounds: Vec<Vec<[u8; 2]>> =
        tables.iter().map(|table| table.bounds.iter().map(|bound| bound.to_le_bytes()).collect()).collect();
    let views: Vec<FrequencyTable<'_>> = tables
        .iter()
        .zip(&bounds)
        .map(|(table, bounds)| FrequencyTable::new(table.origin, table.step, table.min_symbol, bounds))
        .collect();
    Tables::emit(&views, of_channel).collect()
}

/// How a context codes one channel.
#[derive(Clone, Debug, PartialEq)]
pub struct CodedChannel {
    /// Which.
    pub channel: usize,
    /// Its symbol.
    pub symbol: i16,
    /// What gives it its frequencies.
    pub model: NormalModel,
    /// Of the symbol: one without an escape, two near, four far.
    pub slots: Vec<Slots>,
}

/// An anchor on its way through a context.
#[derive(Clone, Debug, PartialEq)]
pub struct CodedAnchor {
    /// Its level, where anchors follow anchors.
    pub level: usize,
    /// The network's inputs and hidden units.
    pub inputs: Vec<i16>,
    #[expect(missing_docs, reason = "above")]
    pub hidden: Vec<i16>,
    /// Of its groups.
    pub exponents: [i32; N_GROUPS],
    /// Distance of neighbouring values of each group.
    pub steps: [f32; N_GROUPS],
    /// Its channels that are coded.
    pub channels: Vec<CodedChannel>,
}

/// What a context makes of the anchors of a chunk, which are in file order.
///
/// * `is_coded`: whether a channel is, given the drawn offsets.
pub fn walk(context: &Context<'_>, anchors: &[Anchor], is_coded: impl Fn(usize, u32) -> bool) -> Vec<CodedAnchor> {
    let (mut inputs, mut hidden) = (vec![0; context.n_inputs()], vec![0; context.n_hidden()]);
    let mut trail = Trail::default();
    let mut given = [vec![0; context.n_parent_inputs()], vec![0; context.n_parent_inputs()]];
    let mut coded = Vec::new();
    for anchor in anchors {
        let place = context.place(&mut trail, anchor.cell);
        let level = place.map_or(0, |place| place.level);
        let network = context.network(level);
        match &place {
            None => {
                context.features(anchor.cell, &mut inputs);
                network.hidden(&inputs, &mut hidden);
            }
            Some(place) => {
                context.follow(place, &given[level.min(1)], &mut inputs);
                // At level 2 there are places alone.
                network.hidden(if level == 2 { &inputs[..3] } else { &inputs }, &mut hidden);
            }
        }
        let steps: Steps = network.steps(&hidden);
        let mut residuals = Vec::new();
        let mut channels = Vec::new();
        for (channel, &symbol) in anchor.symbols.iter().enumerate().filter(|(c, _)| is_coded(*c, anchor.drawn)) {
            let model = network.model(channel, &steps, &hidden, &residuals);
            if residuals.len() < context.n_residuals() {
                residuals.push(network.residual(channel, &steps, &hidden, symbol));
            }
            channels.push(CodedChannel { channel, symbol, model, slots: model.slots(symbol).as_slice().to_vec() });
        }
        if place.is_some() && level > 0 {
            let parent = |(channel, &symbol): (usize, &i16)| {
                let group = context.group(channel);
                steps.of(group).parent_input(group, symbol.into())
            };
            let own: Vec<i16> = anchor.symbols.iter().take(context.n_parent_inputs()).enumerate().map(parent).collect();
            if level == 2 {
                given[1].clone_from(&own);
            }
            given[0] = own;
        }
        let groups = Group::ALL;
        coded.push(CodedAnchor {
            level,
            inputs: inputs.clone(),
            hidden: hidden.clone(),
            exponents: groups.map(|group| steps.exponent(group)),
            steps: groups.map(|group| steps.value(group)),
            channels,
        });
    }
    coded
}
