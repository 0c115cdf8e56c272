//! The channels of an anchor, one symbol each, with tables or with a context.

use pocketsplat_half::{ChannelTables, read_values};

use super::AnchorSite;
use crate::bundle::tables::IndexedTables;
use crate::context::{Context, Group, GroupStep, N_GROUPS, Network, Trail};
use crate::entropy::AnsReader;
use crate::stopwatch::{Stage, Stopwatch};

/// The models of the channels.
#[derive(Debug)]
pub(super) enum ChannelModels<'b, 's> {
    Static(IndexedTables<'b, 's>),
    Context(ContextModels<'b, 's>),
}

/// A context with the memory that it works in.
#[derive(Debug)]
pub(super) struct ContextModels<'b, 's> {
    pub(super) context: Context<'b>,
    /// Inputs `[n_inputs]`, hidden units `[n_hidden]`, and `[n_kept]`: with taps what each feature leaves of the mean that the
    /// anchor's place gives it; of anchors that follow anchors what those that began the current cells of levels 1 and 2 give.
    pub(super) numbers: &'s mut [i16],
    /// If not, the value of a symbol is the symbol.
    pub(super) scaled: bool,
    /// Bits of the symbols of a feature, of a log-scale, of a coordinate of an offset.
    pub(super) symbol_bits: [u8; N_GROUPS],
    /// The exponents of the steps of the anchor read last.
    pub(super) step_bits: u16,
    /// Where the current cells of levels began.
    pub(super) trail: Trail,
}

/// What a row is made of: symbols, or the values they stand for.
pub(super) trait Channel: Copy {
    /// A channel of an offset that is not drawn.
    const UNDRAWN: Self;

    /// From a symbol, an i16, and the origin and the step of its values.
    fn from_symbol(symbol: i32, origin: f32, step: f32) -> Self;

    /// The same for values without an origin.
    fn from_scaled(symbol: i32, step: f32) -> Self;

    /// Fills `run` from channel `first` on with symbols of tables that have a short cut; returns how many there are before one that has none.
    fn read_tables(
        tables: &ChannelTables<'_, '_>,
        first: usize,
        run: &mut [Self],
        symbols: &mut AnsReader<'_>,
    ) -> usize;
}

impl Channel for i16 {
    const UNDRAWN: Self = 0;

    #[inline(always)]
    fn from_symbol(symbol: i32, _origin: f32, _step: f32) -> Self {
        symbol as Self
    }

    #[inline(always)]
    fn from_scaled(symbol: i32, _step: f32) -> Self {
        symbol as Self
    }

    #[inline(always)]
    fn read_tables(
        tables: &ChannelTables<'_, '_>,
        first: usize,
        run: &mut [Self],
        symbols: &mut AnsReader<'_>,
    ) -> usize {
        tables.read_values_with(first, run, symbols.stream(), |symbol, _, _| symbol as Self)
    }
}

impl Channel for f32 {
    const UNDRAWN: Self = 0.0;

    #[inline(always)]
    fn from_symbol(symbol: i32, origin: f32, step: f32) -> Self {
        origin + symbol as Self * step
    }

    #[inline(always)]
    fn from_scaled(symbol: i32, step: f32) -> Self {
        symbol as Self * step
    }

    #[inline(always)]
    fn read_tables(
        tables: &ChannelTables<'_, '_>,
        first: usize,
        run: &mut [Self],
        symbols: &mut AnsReader<'_>,
    ) -> usize {
        read_values(tables, first, run, symbols.stream())
    }
}

impl<'b> ChannelModels<'b, '_> {
    /// The exponents of the steps of the anchor read last; 0 with tables.
    pub(super) fn step_bits(&self) -> u16 {
        match self {
            Self::Static(_) => 0,
            Self::Context(models) => models.step_bits,
        }
    }

    /// Fills `row` with the next anchor's channels; returns the reader behind them.
    ///
    /// * `n_scalars`: channels before the offsets'. * `is_first`: it begins a chunk, which depends on no other.
    pub(super) fn read<T: Channel>(
        &mut self,
        site: AnchorSite,
        n_scalars: usize,
        is_first: bool,
        symbols: AnsReader<'b>,
        row: &mut [T],
        watch: &mut impl Stopwatch,
    ) -> AnsReader<'b> {
        let Some((scalars, offsets)) = row.split_at_mut_checked(n_scalars) else { return symbols };
        let (offsets, _) = offsets.as_chunks_mut();
        match self {
            Self::Static(tables) => read_static(tables, site.mask, symbols, scalars, offsets),
            Self::Context(_) if !cfg!(feature = "context") => symbols,
            Self::Context(models) => {
                if is_first {
                    models.trail.restart();
                }
                models.read(site, symbols, scalars, offsets, watch)
            }
        }
    }
}

/// Fills scalars and offsets with symbols of tables.
// Not inlined: it has several callers.
#[inline(never)]
fn read_static<'b, T: Channel>(
    tables: &IndexedTables<'b, '_>,
    mask: u32,
    mut symbols: AnsReader<'b>,
    scalars: &mut [T],
    offsets: &mut [[T; 3]],
) -> AnsReader<'b> {
    let mut read = |first: usize, run: &mut [T]| {
        let value_of = |symbol, [origin, step]: [f32; 2]| T::from_symbol(symbol, origin, step);
        tables.read_run(first, run, &mut symbols, T::read_tables, value_of);
    };
    read(0, scalars);
    for (offset, k) in offsets.iter_mut().zip(0..) {
        if mask.wrapping_shr(k) & 1 == 0 {
            *offset = [T::UNDRAWN; 3];
        }
    }
    // Those drawn side by side are read at once.
    let (mut left, mut first) = (mask, 0_usize);
    while left != 0 {
        let n_skipped = left.trailing_zeros();
        left = left.wrapping_shr(n_skipped);
        let n_drawn = left.trailing_ones();
        left = left.unbounded_shr(n_drawn);
        first = first.wrapping_add(n_skipped as usize);
        let end = first.wrapping_add(n_drawn as usize);
        let Some(drawn) = offsets.get_mut(first..end) else { break };
        read(scalars.len().wrapping_add(first.wrapping_mul(3)), drawn.as_flattened_mut());
        first = end;
    }
    symbols
}

/// Channels whose models are computed before their symbols are read: few enough for the stack, a multiple of three.
const BLOCK: usize = 63;

/// Mean and scale of each channel of a block.
struct Block {
    moments: [[i16; 2]; BLOCK],
    len: usize,
}

impl<'b> ContextModels<'b, '_> {
    /// Fills scalars and offsets with symbols of models that follow from the anchor's place.
    // Not inlined: its block would be on the stack of what calls it to the end.
    #[inline(never)]
    fn read<T: Channel>(
        &mut self,
        site: AnchorSite,
        mut symbols: AnsReader<'b>,
        scalars: &mut [T],
        offsets: &mut [[T; 3]],
        watch: &mut impl Stopwatch,
    ) -> AnsReader<'b> {
        watch.enter(Stage::Context);
        let Self { context, numbers, scaled, symbol_bits, step_bits, trail } = self;
        let Some((inputs, rest)) = numbers.split_at_mut_checked(context.n_inputs()) else { return symbols };
        let Some((hidden, kept)) = rest.split_at_mut_checked(context.n_hidden()) else { return symbols };
        let Some((notes, coarsest)) = kept.split_at_mut_checked(context.n_notes()) else { return symbols };
        // What is noted of an anchor of level 0 no other will ask for.
        let (level, noted) = match context.place(trail, site.lattice) {
            None => {
                context.features(site.lattice, inputs);
                (0, true)
            }
            Some(place) => {
                context.follow(&place, if place.level == 0 { notes } else { coarsest }, inputs);
                (place.level, place.level > 0)
            }
        };
        let network = context.network(level);
        network.hidden(inputs, hidden);
        let steps = network.steps(hidden);
        *step_bits = steps.to_bits();
        let steps = if *scaled { steps } else { steps.unscaled() };
        let mut block = Block { moments: [[0; 2]; BLOCK], len: 0 };
        let n_scalars = scalars.len();
        let (feature, log_scales) = scalars.split_at_mut_checked(context.feature_dim()).unwrap_or_default();
        let [feature_bits, log_scale_bits, offset_bits] = *symbol_bits;
        let mut first = 0_usize;
        for (group, bits, slots) in
            [(Group::Feature, feature_bits, feature), (Group::LogScale, log_scale_bits, log_scales)]
        {
            for slots in slots.chunks_mut(BLOCK) {
                block.push(&network, hidden, first, slots.len());
                watch.enter(Stage::Decode);
                let step = steps.of(group);
                symbols = if noted && first < notes.len() {
                    block.read_noted(context, notes, (group, first), (&step, bits), symbols, slots)
                } else {
                    block.read(&step, bits, symbols, slots)
                };
                watch.enter(Stage::Context);
                first = first.saturating_add(slots.len());
            }
        }
        if level > 1 {
            // It begins a cell of level 1 too.
            for (slot, note) in coarsest.iter_mut().zip(notes) {
                *slot = *note;
            }
        }
        // Those drawn are read side by side, so that they fill blocks, and then go to their places.
        let mut slots = offsets.as_flattened_mut();
        let step = steps.of(Group::Offset);
        let mut mask = site.mask;
        while mask != 0 {
            let offset = (mask.trailing_zeros() as usize).saturating_mul(3);
            mask &= mask.wrapping_sub(1);
            block.push(&network, hidden, n_scalars.saturating_add(offset), 3);
            if block.len == BLOCK || mask == 0 {
                let Some((now, later)) = slots.split_at_mut_checked(block.len) else { break };
                watch.enter(Stage::Decode);
                symbols = block.read(&step, offset_bits, symbols, now);
                watch.enter(Stage::Context);
                slots = later;
            }
        }
        watch.enter(Stage::Decode);
        spread(offsets, site.mask);
        symbols
    }
}

impl Block {
    /// Adds `len` channels from `first` on.
    fn push(&mut self, network: &Network<'_, '_>, hidden: &[i16], first: usize, len: usize) {
        let end = self.len.saturating_add(len);
        if let Some(moments) = self.moments.get_mut(self.len..end) {
            network.moments(first, hidden, moments);
            self.len = end;
        }
    }

    /// Fills `slots` with the block's symbols and empties it; a symbol of more than `bits` has the stream refused.
    // On its own it gets the registers that it needs.
    #[inline(never)]
    fn read<'b, T: Channel>(
        &mut self,
        step: &GroupStep,
        bits: u8,
        symbols: AnsReader<'b>,
        slots: &mut [T],
    ) -> AnsReader<'b> {
        self.len = 0;
        let (step, mut symbols, mut spread) = (*step, symbols, 0);
        for (slot, &[mean, scale]) in slots.iter_mut().zip(&self.moments) {
            let symbol = step.model(step.raised_mean(mean), scale).wide_symbol(&mut symbols);
            spread |= symbol ^ (symbol >> 31);
            *slot = T::from_scaled(symbol, step.value);
        }
        symbols.refuse_beyond(bits, spread);
        symbols
    }

    /// The same of channels from `first` of `group` on of an anchor that is noted; means follow the notes before where there are
    /// taps.
    ///
    /// * `notes`: `[n_notes]`, of the channels before; those of the block are filled.
    // On its own it gets the registers that it needs.
    #[inline(never)]
    fn read_noted<'b, T: Channel>(
        &mut self,
        context: &Context<'_>,
        notes: &mut [i16],
        (group, first): (Group, usize),
        (step, bits): (&GroupStep, u8),
        symbols: AnsReader<'b>,
        slots: &mut [T],
    ) -> AnsReader<'b> {
        self.len = 0;
        let (step, mut symbols, mut spread) = (*step, symbols, 0);
        for (channel, (slot, &[mean, scale])) in (first..).zip(slots.iter_mut().zip(&self.moments)) {
            let Some((before, [own, ..])) = notes.split_at_mut_checked(channel) else { break };
            let raised_mean = step.raised_mean(mean);
            let symbol = step.model(context.moved(channel, raised_mean, before), scale).wide_symbol(&mut symbols);
            *own = context.note(group, &step, raised_mean, symbol);
            spread |= symbol ^ (symbol >> 31);
            *slot = T::from_scaled(symbol, step.value);
        }
        symbols.refuse_beyond(bits, spread);
        symbols
    }
}

/// Moves the offsets at the front to the places that `mask` has for them.
fn spread<T: Channel>(offsets: &mut [[T; 3]], mask: u32) {
    let mut n_left = mask.count_ones() as usize;
    for place in (0..offsets.len()).rev() {
        // Offsets 0 to `place` are all drawn, and in their places.
        if n_left > place {
            return;
        }
        let drawn = mask.wrapping_shr(place as u32) & 1 == 1;
        n_left = n_left.saturating_sub(drawn.into());
        let offset = if drawn { offsets.get(n_left).copied() } else { None };
        if let Some(slot) = offsets.get_mut(place) {
            *slot = offset.unwrap_or([T::UNDRAWN; 3]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::spread;

    #[test]
    fn offsets_go_to_the_places_of_the_mask() {
        for mask in 0..1_u32 << 7 {
            let mut offsets: [[i16; 3]; 7] = std::array::from_fn(|i| [i as i16 + 1; 3]);
            spread(&mut offsets, mask);
            let mut n = 0;
            let expected: [[i16; 3]; 7] = std::array::from_fn(|k| {
                let drawn = (mask >> k & 1) as i16;
                n += drawn;
                [drawn * n; 3]
            });
            assert_eq!(offsets, expected, "mask {mask:07b}");
        }
    }
}
