//! The slots of an anchor's symbols, under either coder.

use pocketsplat_format::context::Context;
use pocketsplat_format::entropy::Slot;

use super::channels::{ChannelName, ContextWork};
use super::stream::SlotList;
use super::table::TableSet;
use pocketsplat_kernels::scene::ModelShape;

/// What gives the channels' symbols their frequencies.
pub(super) enum ChannelCoder<'c> {
    /// Static tables, the same for all anchors.
    Tables(TableSet),
    /// The context model, anchor by anchor.
    Context(Context<'c>),
}

impl<'c> ChannelCoder<'c> {
    /// Appends the slots of an anchor's symbols `[n_channels]`, those of its drawn offsets alone.
    pub(super) fn push(
        &self,
        work: &mut ContextWork<'c>,
        shape: &ModelShape,
        lattice: [i32; 3],
        drawn: u32,
        symbols: &[i16],
        list: &mut SlotList,
    ) {
        let named =
            symbols.iter().enumerate().map(|(channel, &symbol)| (channel, symbol, ChannelName::of(shape, channel)));
        let coded = named.filter(|(_, _, name)| name.is_coded(drawn));
        match self {
            Self::Tables(tables) => {
                for (channel, symbol, name) in coded {
                    tables.of_channel(channel).slots(symbol).for_each(|slot| list.push(name.part(), &slot));
                }
            }
            Self::Context(context) => {
                let steps = work.enter(context, lattice);
                for (channel, symbol, name) in coded {
                    let slots = work.next(channel, &steps, symbol).slots(symbol);
                    for &(start, frequency) in slots.as_slice() {
                        list.push(name.part(), &Slot { symbol: (), start, frequency });
                    }
                }
                work.leave(&steps, symbols);
            }
        }
    }
}
