//! What the steps of each phase do to the values of anchors.

use pocketsplat_format::context::Context;

use super::integers::{Integers, head_step};
use crate::train::schedule::{Backbone, Hac};
use pocketsplat_kernels::ops::rate::noise::Stream;
use pocketsplat_kernels::step::Phase;
use pocketsplat_kernels::step::coding::{Coding, IntegerModel, RateTerms};

/// What a step of `phase` does.
///
/// * `lambda`: weight of a value's bits. * `stream`: of the iteration. * `exact`: the integers, in the phase that needs them; without
///   them a device makes its own.
pub(in crate::train) fn coding<'a>(
    phase: Phase,
    backbone: Backbone,
    hac: &Hac,
    lambda: f64,
    stream: Stream,
    exact: Option<(&'a Context<'a>, &'a Integers)>,
) -> Coding<'a, f32> {
    let masks_weigh_anchors = backbone == Backbone::HacPlus;
    let rate = RateTerms {
        lambda,
        sample: hac.sample,
        mask: if masks_weigh_anchors { 0.0 } else { hac.mask_weight },
        masks_weigh_anchors,
        grid: hac.grid_weight,
    };
    match phase {
        Phase::Raw => Coding::Raw,
        Phase::Noise => Coding::Noise { stream, steps: hac.base_steps() },
        Phase::IntegerModel if exact.is_none() => Coding::Integers { stream, rate, head_step: head_step() },
        Phase::Context | Phase::IntegerModel => {
            let exact = exact.map(|(context, integers)| IntegerModel { context, networks: &integers.networks });
            Coding::Context { stream, rate, exact }
        }
    }
}
