//! What a context costs an anchor, as counts.

use pocketsplat_format::bundle::Coder;
use pocketsplat_format::context::{LevelKind, first_tap};

/// Sizes of a context that its work follows from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ContextShape {
    inputs: u64,
    hidden: u64,
    /// Corners of the grid that are read for a place.
    pub(crate) corners: u64,
    taps: u64,
}

impl ContextShape {
    /// That of a bundle's context; `None` where its symbols are coded by tables.
    pub(crate) fn of(coder: &Coder<'_>) -> Option<Self> {
        let Coder::Context(context) = coder else { return None };
        let [inputs, hidden, taps] =
            [context.n_inputs(), context.n_hidden(), first_tap(context.feature_dim(), context.n_taps())]
                .map(|n| n as u64);
        let corners = context.levels().map(|level| if level.kind == LevelKind::Volume { 8 } else { 4 }).sum();
        Some(Self { inputs, hidden, corners, taps })
    }

    /// Units of the network that are evaluated for `anchors` with `symbols` in all: the hidden ones, a mean and a scale for each
    /// symbol, and three steps.
    pub(crate) fn units(&self, anchors: u64, symbols: u64) -> u64 {
        outputs(anchors, symbols) + anchors * self.hidden
    }

    /// Multiply-adds for them.
    pub(crate) fn macs(&self, anchors: u64, symbols: u64) -> u64 {
        self.hidden * (anchors * self.inputs + outputs(anchors, symbols)) + anchors * self.taps
    }
}

fn outputs(anchors: u64, symbols: u64) -> u64 {
    2 * symbols + 3 * anchors
}
