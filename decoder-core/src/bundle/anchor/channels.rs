//! The channels of an anchor, one symbol each, with tables or with a context.

use super::AnchorSite;
use crate::bundle::tables::IndexedTables;
use crate::context::Context;
use crate::entropy::AnsReader;

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
    /// `[n_inputs]`.
    pub(super) features: &'s mut [i16],
    /// `[n_hidden]`.
    pub(super) hidden: &'s mut [i16],
}

/// What a row is made of: symbols, or the values they stand for.
pub(super) trait Channel: Copy {
    /// A channel of an offset that is not drawn.
    const UNDRAWN: Self;

    /// From a symbol, an i16, and the origin and the step of its values.
    fn from_symbol(symbol: i32, origin: f32, step: f32) -> Self;
}

impl Channel for i16 {
    const UNDRAWN: Self = 0;

    #[inline(always)]
    fn from_symbol(symbol: i32, _origin: f32, _step: f32) -> Self {
        symbol as Self
    }
}

impl Channel for f32 {
    const UNDRAWN: Self = 0.0;

    #[inline(always)]
    fn from_symbol(symbol: i32, origin: f32, step: f32) -> Self {
        origin + symbol as Self * step
    }
}

impl<'b> ChannelModels<'b, '_> {
    /// Fills `row` with the next anchor's channels; returns the reader behind them.
    ///
    /// * `n_scalars`: channels before the offsets'.
    pub(super) fn read<T: Channel>(
        &mut self,
        site: AnchorSite,
        n_scalars: usize,
        symbols: AnsReader<'b>,
        row: &mut [T],
    ) -> AnsReader<'b> {
        let Some((scalars, offsets)) = row.split_at_mut_checked(n_scalars) else { return symbols };
        let (offsets, _) = offsets.as_chunks_mut();
        match self {
            Self::Static(tables) => read_static(*tables, site.mask, symbols, scalars, offsets),
            Self::Context(models) => models.read(site, symbols, scalars, offsets),
        }
    }
}

/// Fills scalars and offsets with symbols of tables.
#[inline(never)]
fn read_static<'b, T: Channel>(
    tables: IndexedTables<'b, '_>,
    mut mask: u32,
    symbols: AnsReader<'b>,
    scalars: &mut [T],
    offsets: &mut [[T; 3]],
) -> AnsReader<'b> {
    let Some((scalar_numbers, offset_numbers)) = tables.of_channels().split_at_checked(scalars.len()) else {
        return symbols;
    };
    // Arguments of this size are passed in memory; a copy stays in registers.
    let mut symbols = symbols;
    let mut read = |slot: &mut T, number: [u8; 2]| {
        if let Some((symbol, table)) = tables.symbol(number, &mut symbols) {
            *slot = T::from_symbol(symbol, table.origin, table.step);
        }
    };
    for (slot, &number) in scalars.iter_mut().zip(scalar_numbers) {
        read(slot, number);
    }
    for (offset, numbers) in offsets.iter_mut().zip(offset_numbers.as_chunks::<3>().0) {
        *offset = [T::UNDRAWN; 3];
        if mask & 1 == 1 {
            for (slot, &number) in offset.iter_mut().zip(numbers) {
                read(slot, number);
            }
        }
        mask >>= 1;
    }
    symbols
}

impl<'b> ContextModels<'b, '_> {
    /// Fills scalars and offsets with symbols of models that follow from the anchor's place.
    #[inline(never)]
    fn read<T: Channel>(
        &mut self,
        site: AnchorSite,
        symbols: AnsReader<'b>,
        scalars: &mut [T],
        offsets: &mut [[T; 3]],
    ) -> AnsReader<'b> {
        // As above.
        let mut symbols = symbols;
        let Self { context, features, hidden } = self;
        context.features(site.lattice, features);
        context.hidden(features, hidden);
        let steps = context.steps(hidden);
        let first_offset = scalars.len();
        let mut read = |slot: &mut T, channel: usize| {
            let symbol = context.model(channel, &steps, hidden).symbol(&mut symbols);
            *slot = T::from_symbol(symbol.into(), 0.0, steps.value(context.group(channel)));
        };
        for (channel, slot) in scalars.iter_mut().enumerate() {
            read(slot, channel);
        }
        let mut mask = site.mask;
        for (offset, first) in offsets.iter_mut().zip((first_offset..).step_by(3)) {
            *offset = [T::UNDRAWN; 3];
            if mask & 1 == 1 {
                for (slot, channel) in offset.iter_mut().zip(first..) {
                    read(slot, channel);
                }
            }
            mask >>= 1;
        }
        symbols
    }
}
