//! All heads of a scene.

use super::detail::Detail;
use super::format::{HeadFormat, MlpHead};
use super::shape::HeadShape;
use crate::arena::Arena;
use crate::bundle::HeadsView;
use crate::error::DecodeError;

/// The heads, one block of outputs an offset: none is computed for an offset that is not drawn.
pub(crate) struct Heads<'s, N: HeadFormat> {
    pub(crate) shape: HeadShape,
    pub(crate) opacity: N::Head<'s, 1>,
    pub(crate) covariance: Covariance<'s, N>,
    pub(crate) colour: N::Head<'s, 3>,
    pub(crate) detail: Option<Detail<'s, N::Detail>>,
}

/// The covariance head.
pub(crate) enum Covariance<'s, N: HeadFormat> {
    /// A scale logit an offset.
    Isotropic(N::Head<'s, 1>),
    /// Three, and a quaternion.
    Anisotropic(N::Head<'s, 7>),
}

impl<'s, N: HeadFormat> Covariance<'s, N> {
    /// As [`MlpHead::activate`].
    pub(crate) fn activate<'h>(&self, inputs: N::Values<'_>, hidden: &'h mut [f32]) -> N::Values<'h> {
        match self {
            Self::Isotropic(head) => head.activate(inputs, hidden),
            // Unreachable without the feature; this arm drops the code, here and below.
            Self::Anisotropic(_) if !cfg!(feature = "anisotropy") => N::values(hidden),
            Self::Anisotropic(head) => head.activate(inputs, hidden),
        }
    }

    /// As [`MlpHead::block`]; of an isotropic Gaussian the first output alone means something.
    pub(crate) fn block(&self, index: usize, hidden: N::Values<'_>) -> Option<[f32; 7]> {
        match self {
            Self::Isotropic(head) => head.block(index, hidden).map(|[logit]| [logit, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
            Self::Anisotropic(_) if !cfg!(feature = "anisotropy") => None,
            Self::Anisotropic(head) => head.block(index, hidden),
        }
    }
}

impl<'s, N: HeadFormat> Heads<'s, N> {
    /// Converts the file's weights; takes [`n_weights`](super::HeadShape::n_weights) floats.
    pub(crate) fn convert(arena: &mut Arena<'s>, heads: &HeadsView<'_>, shape: HeadShape) -> Result<Self, DecodeError> {
        let mut weights = heads.weights();
        // In the order of the file.
        Ok(Self {
            shape,
            opacity: N::Head::convert(arena, &heads.opacity, &mut weights)?,
            covariance: if cfg!(feature = "anisotropy") && shape.covariance > 1 {
                Covariance::Anisotropic(N::Head::convert(arena, &heads.covariance, &mut weights)?)
            } else {
                Covariance::Isotropic(N::Head::convert(arena, &heads.covariance, &mut weights)?)
            },
            colour: N::Head::convert(arena, &heads.colour, &mut weights)?,
            detail: match &heads.detail {
                Some(head) if cfg!(feature = "detail") && shape.detail > 0 => {
                    Some(Detail::convert(arena, head, &mut weights)?)
                }
                _ => None,
            },
        })
    }
}
