//! Anchors evaluated one after the other, or two at a time where that costs less.

use pocketsplat_format::bundle::Effects;
use pocketsplat_format::{Stage, Stopwatch};

use super::Anchor;
use super::gaussian::{Evaluation, GaussianSink, Workspace, fill_inputs};
use crate::arena::Arena;
use crate::functions::Functions;
use crate::mlp::{FeatureSums, HeadFormat, HeadShape, Heads, Role};

/// What evaluates anchors.
pub(crate) struct Evaluator<'s, N: HeadFormat> {
    pub(crate) heads: Heads<'s, N>,
    /// What the head sees that sees most, see [`HeadShape::inputs`].
    pub(crate) inputs: &'s mut [f32],
    pub(crate) work: Workspace<'s>,
    /// Where anchors are evaluated two at a time.
    pub(crate) pair: Option<Pair<'s>>,
    /// What the heads begin with, where that is in memory.
    pub(crate) sums: Option<FeatureSums<'s>>,
}

/// Two anchors at a time: the first waits for the second.
pub(crate) struct Pair<'s> {
    /// Of the first; its feature is among the evaluator's inputs.
    offsets: &'s mut [[f32; 3]],
    /// What the second anchor's heads read.
    inputs: &'s mut [f32],
    /// The second anchor's hidden units.
    units: &'s mut [f32],
    waiting: Option<Waiting>,
}

/// An anchor without its feature and its offsets.
struct Waiting {
    number: u32,
    position: [f32; 3],
    extent: [f32; 3],
    base_scale: [f32; 3],
    mask: u32,
}

impl<'s> Pair<'s> {
    /// Takes its memory from `arena`; `None` if there is too little.
    pub(crate) fn take(arena: &mut Arena<'s>, shape: HeadShape) -> Option<Self> {
        Some(Self {
            offsets: arena.take(shape.offsets).ok()?,
            inputs: arena.take(shape.inputs()).ok()?,
            units: arena.take(shape.pair_units_len()).ok()?,
            waiting: None,
        })
    }
}

impl Waiting {
    /// * `inputs`: its feature, of `feature_dim` floats, and what else its heads read.
    fn anchor<'r>(&self, inputs: &'r [f32], feature_dim: usize, offsets: &'r [[f32; 3]]) -> Anchor<'r> {
        let Self { position, extent, base_scale, mask, .. } = *self;
        let feature = inputs.get(..feature_dim).unwrap_or_default();
        Anchor { position, feature, extent, base_scale, offsets, mask }
    }
}

impl<'s, N: HeadFormat> Evaluator<'s, N> {
    /// The same heads, for a second painter.
    ///
    /// * `pair`: words for the anchor that waits, if there is room for one.
    pub(crate) fn shared(&self, inputs: &'s mut [f32], work: Workspace<'s>, pair: &'s mut [u32]) -> Self {
        let heads = self.heads;
        let pair = if heads.takes_two() { Pair::take(&mut Arena::of_words(pair), heads.shape) } else { None };
        Self { heads, inputs, work, pair, sums: self.sums.as_ref().map(FeatureSums::shared) }
    }
}

impl<N: HeadFormat> Evaluator<'_, N> {
    /// Hands the Gaussians of `anchor` that a camera at `eye` can see to `sink`, now or when the next anchor comes; in the order of
    /// the anchors.
    pub(crate) fn visit<F: Functions>(
        &mut self,
        number: u32,
        anchor: &Anchor<'_>,
        (effects, eye): (Effects, [f32; 3]),
        watch: &mut impl Stopwatch,
        sink: &mut impl GaussianSink,
    ) {
        watch.enter(Stage::Heads);
        let Self { heads, inputs, work, pair, sums } = self;
        let mut evaluation = Evaluation { heads, work, effects };
        let Some(Pair { offsets, inputs: second_inputs, units, waiting }) = pair else {
            fill_inputs(anchor, effects, eye, inputs);
            let mut role = match sums {
                Some(sums) if cfg!(feature = "baked") => match sums.of(number, &heads.shape) {
                    Some(sums) => Role::Begun(sums),
                    // Unreachable, for all anchors have sums; its feature was not read.
                    None => return,
                },
                _ => Role::Alone,
            };
            evaluation.run::<F>(number, anchor, N::values(inputs), &mut role, watch, sink);
            return;
        };
        let Some(first) = waiting.take() else {
            fill_inputs(anchor, effects, eye, inputs);
            offsets.iter_mut().zip(anchor.offsets).for_each(|(kept, offset)| *kept = *offset);
            let Anchor { position, extent, base_scale, mask, .. } = *anchor;
            *waiting = Some(Waiting { number, position, extent, base_scale, mask });
            return;
        };
        fill_inputs(anchor, effects, eye, second_inputs);
        let (Some(first_values), Some(second_values)) = (N::floats(inputs), N::floats(second_inputs)) else { return };
        let mut role = Role::First { inputs: second_inputs, units, n_known: 0 };
        evaluation.run::<F>(
            first.number,
            &first.anchor(inputs, heads.shape.feature, offsets),
            first_values,
            &mut role,
            watch,
            sink,
        );
        watch.enter(Stage::Heads);
        let mut role = role.of_second();
        evaluation.run::<F>(number, anchor, second_values, &mut role, watch, sink);
    }

    /// The same for an anchor that waits for another.
    pub(crate) fn finish<F: Functions>(
        &mut self,
        effects: Effects,
        watch: &mut impl Stopwatch,
        sink: &mut impl GaussianSink,
    ) {
        let Self { heads, inputs, work, pair, .. } = self;
        let Some(Pair { offsets, waiting, .. }) = pair else { return };
        if let (Some(first), Some(values)) = (waiting.take(), N::floats(inputs)) {
            watch.enter(Stage::Heads);
            let anchor = first.anchor(inputs, heads.shape.feature, offsets);
            Evaluation { heads, work, effects }.run::<F>(first.number, &anchor, values, &mut Role::Alone, watch, sink);
        }
    }

    /// Forgets an anchor that waits, after an error.
    pub(crate) fn discard_waiting(&mut self) {
        if let Some(pair) = &mut self.pair {
            pair.waiting = None;
        }
    }
}
