//! A scene's context model in the decoder's integers, and the heads as they are written.

use pocketsplat_format::context::Context;

use crate::train::error::TrainError;
use pocketsplat_kernels::integer_model;
use pocketsplat_kernels::ops::rate::perturb;
use pocketsplat_kernels::scene::{ContextNetwork, Head, Heads, Scene};

/// Bits of the fraction of the heads' weights that a run with a context model ends with: they are drawn so in its last phase, so
/// that rounding them costs nothing.
pub(in crate::train) const HEAD_FRACTION_BITS: u8 = 7;

/// The integer form of a scene's context model, as bytes and as the networks that they stand for, and the heads as they are
/// written.
#[derive(Clone, Debug)]
pub(in crate::train) struct Integers {
    pub(in crate::train) section: Vec<u8>,
    pub(in crate::train) networks: Vec<ContextNetwork<f32>>,
    pub(in crate::train) heads: Heads<f32>,
}

impl Integers {
    /// Of the scene's context model.
    ///
    /// # Errors
    /// [`TrainError::NoContext`] when there is none, [`TrainError::IntegerModel`] when a weight has no integer form.
    pub(in crate::train) fn of(scene: &Scene<f32>) -> Result<Self, TrainError> {
        let n_channels = scene.shape.values_per_anchor();
        let model = scene.context.as_ref().ok_or(TrainError::NoContext)?;
        Ok(Self {
            section: integer_model::section(model, n_channels)?,
            networks: integer_model::rounded(model, n_channels)?,
            heads: scene.heads.map(written),
        })
    }

    /// What a decoder makes of the bytes.
    ///
    /// # Errors
    /// [`TrainError::IntegersUnread`].
    pub(in crate::train) fn context(&self, scene: &Scene<f32>) -> Result<Context<'_>, TrainError> {
        Ok(integer_model::parse(&self.section, &scene.shape)?)
    }
}

/// The last bit of the fraction.
pub(super) fn head_step() -> f32 {
    (-f32::from(HEAD_FRACTION_BITS)).exp2()
}

/// A head whose matrices are multiples of the last bit of the fraction.
fn written(head: &Head<f32>) -> Head<f32> {
    let step = head_step();
    let matrix = |weights: &[f32]| weights.iter().map(|weight| perturb::symbol(*weight, step) * step).collect();
    Head { w1: matrix(&head.w1), w2: matrix(&head.w2), ..head.clone() }
}
