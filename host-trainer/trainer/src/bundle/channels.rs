//! The channels of an anchor: their names, and the slots of their symbols under either coder.

use std::fmt;

use pocketsplat_core::context::{Context, Group, N_GROUPS, Steps};
use pocketsplat_core::entropy::Slot;

use super::stream::{Part, SlotList};
use super::table::TableSet;
use crate::scene::ModelShape;

/// A channel of an anchor by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChannelName {
    /// Feature dimension.
    Feature(usize),
    /// Log-scale 0..6, or 0..4 where Gaussians are isotropic.
    LogScale(usize),
    /// Offset and axis.
    Offset(usize, usize),
}

impl ChannelName {
    /// The name of channel `channel` of an anchor.
    pub fn of(shape: &ModelShape, channel: usize) -> Self {
        let [first_log_scale, first_offset] = [shape.feature_dim, shape.feature_dim + shape.n_log_scales()];
        if channel < first_log_scale {
            Self::Feature(channel)
        } else if channel < first_offset {
            Self::LogScale(channel - first_log_scale)
        } else {
            Self::Offset((channel - first_offset) / 3, (channel - first_offset) % 3)
        }
    }

    /// Index of its group, which shares a step: features, log-scales, offsets.
    pub(super) fn group(self) -> usize {
        self.part() as usize - Part::Feature as usize
    }

    /// Whether it is coded for an anchor whose drawn offsets are the set bits of `drawn`.
    pub(super) fn is_coded(self, drawn: u32) -> bool {
        match self {
            Self::Offset(k, _) => (drawn >> k) & 1 == 1,
            _ => true,
        }
    }

    fn part(self) -> Part {
        match self {
            Self::Feature(_) => Part::Feature,
            Self::LogScale(_) => Part::LogScale,
            Self::Offset(..) => Part::Offset,
        }
    }
}

impl fmt::Display for ChannelName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Feature(dim) => write!(f, "feature {dim}"),
            Self::LogScale(index) => write!(f, "log-scale {index}"),
            Self::Offset(offset, axis) => write!(f, "offset {offset} {}", ["x", "y", "z"].get(axis).unwrap_or(&"?")),
        }
    }
}

/// What gives the channels' symbols their frequencies.
pub(super) enum ChannelCoder<'c> {
    /// Static tables, the same for all anchors.
    Tables(TableSet),
    /// The context model, anchor by anchor.
    Context(Context<'c>),
}

/// The groups of channels in the order of their steps.
pub(super) const GROUPS: [Group; N_GROUPS] = [Group::Feature, Group::LogScale, Group::Offset];

/// Buffers of the context model.
#[derive(Default)]
pub(super) struct ContextWork {
    features: Vec<i16>,
    hidden: Vec<i16>,
}

impl ContextWork {
    /// Evaluates the hidden layer for an anchor and returns its steps.
    pub(super) fn enter(&mut self, context: &Context<'_>, lattice: [i32; 3]) -> Steps {
        self.features.resize(context.n_inputs(), 0);
        self.hidden.resize(context.n_hidden(), 0);
        context.features(lattice, &mut self.features);
        context.hidden(&self.features, &mut self.hidden);
        context.steps(&self.hidden)
    }
}

impl ChannelCoder<'_> {
    /// Appends the slots of an anchor's symbols `[n_channels]`, those of its drawn offsets alone.
    pub(super) fn push(
        &self,
        work: &mut ContextWork,
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
                    let slots = context.model(channel, &steps, &work.hidden).slots(symbol);
                    for &(start, frequency) in slots.as_slice() {
                        list.push(name.part(), &Slot { symbol: (), start, frequency });
                    }
                }
            }
        }
    }
}
