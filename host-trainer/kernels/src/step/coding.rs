//! What coding does to the values of anchors, and what it costs, as a step is told.

use pocketsplat_format::context::Context;

use crate::ops::rate::noise::Stream;
use crate::scene::ContextNetwork;

/// What a step does to the values of anchors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Nothing.
    Raw,
    /// Noise of fixed steps.
    Noise,
    /// Noise of the context model's steps, and the rate.
    Context,
    /// Rounding as the decoder sees it, and the rate.
    IntegerModel,
}

/// What happens to the values of the visible anchors before they are drawn.
#[derive(Clone, Copy, Debug)]
pub enum Coding<'a, R> {
    /// Nothing.
    Raw,
    /// Noise as wide as fixed steps, so that the scene becomes one that survives rounding.
    Noise {
        /// Of this iteration.
        stream: Stream,
        /// Of features, log-scales and offsets.
        steps: [f32; 3],
    },
    /// Noise as wide as the steps of the scene's context model, and the rate under it.
    Context {
        /// Of this iteration.
        stream: Stream,
        /// The terms of the loss.
        rate: RateTerms,
        /// With it values are rounded, and steps and distributions are those of its integers: what a decoder sees.
        exact: Option<IntegerModel<'a, R>>,
    },
    /// The same with the integers that a device makes of the scene that it holds; for such a device alone.
    Integers {
        /// Of this iteration.
        stream: Stream,
        /// The terms of the loss.
        rate: RateTerms,
        /// Step of the heads' matrices, which are drawn as they will be written; a power of two.
        head_step: f32,
    },
}

impl<R> Coding<'_, R> {
    /// The stream and the terms of the rate, where a context model has one.
    pub fn rate(&self) -> Option<(Stream, &RateTerms)> {
        match self {
            Self::Raw | Self::Noise { .. } => None,
            Self::Context { stream, rate, .. } | Self::Integers { stream, rate, .. } => Some((*stream, rate)),
        }
    }
}

/// The integer form of the scene's context model.
#[derive(Clone, Copy, Debug)]
pub struct IntegerModel<'a, R> {
    /// What decides.
    pub context: &'a Context<'a>,
    /// The networks that its integers stand for, through which gradients pass.
    pub networks: &'a [ContextNetwork<R>],
}

/// How much bits weigh in the loss.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateTerms {
    /// λ: weight of the mean bits of a value.
    pub lambda: f64,
    /// Share of the visible anchors that the mean is taken over, times the [weight](crate::scene::Anchors::view_weights) of each.
    pub sample: f64,
    /// Weight of the mean opening of the visible anchors' masks.
    pub mask: f64,
    /// Whether the masks of an anchor answer for the bits of its features and log-scales too, a K-th part each (Chen et al.
    /// 2025, HAC++, section 3.4); else for those of their offsets alone.
    pub masks_weigh_anchors: bool,
    /// Weight of the bits of the grid's signs, relative to those of the values.
    pub grid: f64,
}

/// What a step found out about the rate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RateReport {
    /// Anchors that the rest is estimated from.
    pub n_sampled: usize,
    /// Mean bits of an anchor: features, log-scales, offsets.
    pub bits: [f64; 3],
}
