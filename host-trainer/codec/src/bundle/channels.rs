//! The channels of an anchor: their names, their groups, and what the context model says of them.

use std::fmt;

use pocketsplat_format::context::{Context, Steps, Trail};
use pocketsplat_format::entropy::NormalModel;

use super::stream::Part;
use pocketsplat_kernels::scene::ModelShape;

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

    /// What its slots say.
    pub(super) fn part(self) -> Part {
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

/// The context model on its way through the anchors of a chunk.
#[derive(Default)]
pub(crate) struct ContextWork<'c> {
    inputs: Vec<i16>,
    hidden: Vec<i16>,
    /// Of the anchor's features so far, where there are taps.
    residuals: Vec<i16>,
    /// Where the current cells of levels began.
    trail: Trail,
    /// The level of the anchor entered last.
    at: Option<(usize, Context<'c>)>,
    /// What the anchors that began the current cells of levels 1 and 2 give.
    given: [Vec<i16>; 2],
}

impl<'c> ContextWork<'c> {
    /// Evaluates the hidden layer for the next anchor of a chunk and returns its steps.
    pub(crate) fn enter(&mut self, context: &Context<'c>, lattice: [i32; 3]) -> Steps {
        self.inputs.resize(context.n_inputs(), 0);
        self.hidden.resize(context.n_hidden(), 0);
        let level = match context.place(&mut self.trail, lattice) {
            None => {
                context.features(lattice, &mut self.inputs);
                0
            }
            Some(place) => {
                context.follow(&place, &self.given[place.level.min(1)], &mut self.inputs);
                place.level
            }
        };
        let network = context.network(level);
        network.hidden(&self.inputs, &mut self.hidden);
        self.residuals.clear();
        self.at = Some((level, *context));
        network.steps(&self.hidden)
    }

    /// The distribution of the next channel that is coded of the anchor entered last; `symbol` is what it turns out to be.
    ///
    /// # Panics
    /// Before any anchor.
    pub(super) fn next(&mut self, channel: usize, steps: &Steps, symbol: i16) -> NormalModel {
        let (level, context) = self.at.expect("an anchor was entered");
        let network = context.network(level);
        let model = network.model(channel, steps, &self.hidden, &self.residuals);
        if self.residuals.len() < context.n_residuals() {
            self.residuals.push(network.residual(channel, steps, &self.hidden, symbol));
        }
        model
    }

    /// Goes on from the anchor entered last, whose symbols are known now: others may follow it.
    ///
    /// * `symbols`: `[n_channels]`, of which features and log-scales count.
    pub(crate) fn leave(&mut self, steps: &Steps, symbols: &[i16]) {
        let Some((level @ 1.., context)) = self.at else { return };
        let given: Vec<i16> = symbols[..context.n_parent_inputs()]
            .iter()
            .enumerate()
            .map(|(channel, symbol)| {
                let group = context.group(channel);
                steps.of(group).parent_input(group, (*symbol).into())
            })
            .collect();
        if level > 1 {
            self.given[1].clone_from(&given);
        }
        self.given[0] = given;
    }
}
