//! The network of a level: from an anchor's inputs to the distributions of its symbols.

use super::mlp::Layer;
use super::{Context, Group, Steps, residual};
use crate::entropy::NormalModel;
use crate::error::DecodeError;

/// The integer network that anchors of a level have; made by [`Context::network`].
#[derive(Clone, Copy, Debug)]
pub struct Network<'c, 'a> {
    context: &'c Context<'a>,
    hidden: Layer<'a>,
    output: Layer<'a>,
}

impl<'c, 'a> Network<'c, 'a> {
    /// The network at the front of `bytes`, not yet checked, and what follows it.
    pub(super) fn first(context: &'c Context<'a>, bytes: &'a [u8], n_inputs: usize) -> (Self, &'a [u8]) {
        let ([hidden, output], rest) = Layer::pair(bytes, n_inputs, context.n_hidden(), context.n_outputs());
        (Self { context, hidden, output }, rest)
    }

    pub(super) fn check(&self) -> Result<(), DecodeError> {
        self.hidden.check()?;
        self.output.check()
    }

    /// The hidden units: `(W1·x + b1) >> shift`, limited to 0..=32767.
    ///
    /// * `inputs`: `[n_inputs]` of the context. * `hidden`: `[n_hidden]`, filled.
    #[inline(always)]
    pub fn hidden(&self, inputs: &[i16], hidden: &mut [i16]) {
        self.hidden.rectified(inputs, hidden);
    }

    /// One output: `(W2·h + b2) >> shift`, limited to i16.
    #[inline(always)]
    #[must_use]
    pub fn output(&self, row: usize, hidden: &[i16]) -> i16 {
        self.output.limited(row, hidden)
    }

    /// The anchor's quantisation steps.
    #[inline]
    #[must_use]
    pub fn steps(&self, hidden: &[i16]) -> Steps {
        let first = usize::from(self.context.n_channels).saturating_mul(2);
        let raw = [0, 1, 2].map(|group: usize| self.output(first.saturating_add(group), hidden));
        Steps::new(self.context.base_steps, raw)
    }

    /// The distribution of a channel's symbol.
    ///
    /// * `residuals`: [`residual`](Self::residual) of every feature before, where there are taps.
    ///
    /// # Budget
    /// Two rows of the network.
    #[must_use]
    pub fn model(&self, channel: usize, steps: &Steps, hidden: &[i16], residuals: &[i16]) -> NormalModel {
        let mean = self.output(channel, hidden);
        let scale = self.output(channel.saturating_add(self.context.n_channels.into()), hidden);
        let group = self.context.group(channel);
        let step = steps.of(group);
        let raised_mean = step.raised_mean(mean);
        step.model(
            if group == Group::Feature { self.context.moved(channel, raised_mean, residuals) } else { raised_mean },
            scale,
        )
    }

    /// What a feature's symbol leaves of the mean that its anchor's place gives it, in eighths of the step.
    ///
    /// # Budget
    /// A row of the network.
    #[must_use]
    pub fn residual(&self, feature: usize, steps: &Steps, hidden: &[i16], symbol: i16) -> i16 {
        residual(symbol.into(), steps.of(Group::Feature).raised_mean(self.output(feature, hidden)))
    }

    /// Mean and scale of each channel from `first` on, in 1/[`MEAN_PARTS`](super::MEAN_PARTS) of a base step and in eighths of an
    /// octave of one.
    #[inline]
    pub(crate) fn moments(&self, first: usize, hidden: &[i16], moments: &mut [[i16; 2]]) {
        self.output.pairs(first, first.saturating_add(self.context.n_channels.into()), hidden, moments);
    }
}
