//! All heads of a scene.

use pocketsplat_format::DecodeError;
use pocketsplat_format::bundle::HeadsView;

use super::block::HeadWeights;
use super::detail::Detail;
use super::format::{HeadFormat, MlpHead};
use super::pair::Role;
use super::shape::HeadShape;
use crate::arena::Arena;

/// The heads, one block of outputs an offset: none is computed for an offset that is not drawn.
#[derive(Clone, Copy)]
pub(crate) struct Heads<'s, N: HeadFormat> {
    pub(crate) shape: HeadShape,
    pub(crate) opacity: N::Head<'s, 1>,
    pub(crate) covariance: CovarianceHead<'s, N>,
    pub(crate) colour: N::Head<'s, 3>,
    pub(crate) detail: Option<Detail<'s>>,
}

/// The covariance head.
#[derive(Clone, Copy)]
pub(crate) enum CovarianceHead<'s, N: HeadFormat> {
    /// A scale logit an offset.
    Isotropic(N::Head<'s, 1>),
    /// Three, and a quaternion.
    Anisotropic(N::Head<'s, 7>),
}

impl<'s, N: HeadFormat> CovarianceHead<'s, N> {
    /// As [`MlpHead::begin`].
    fn begin(&self, feature: &[f32], sums: &mut [f32]) {
        match self {
            Self::Isotropic(head) => head.begin(feature, sums),
            // Unreachable without the feature; this arm drops the code, here and below.
            Self::Anisotropic(_) if !cfg!(feature = "anisotropy") => {}
            Self::Anisotropic(head) => head.begin(feature, sums),
        }
    }

    /// As [`MlpHead::activate`].
    pub(crate) fn activate<'h>(
        &self,
        number: usize,
        inputs: N::Values<'_>,
        hidden: &'h mut [f32],
        role: &'h mut Role<'_>,
    ) -> N::Values<'h> {
        match self {
            Self::Isotropic(head) => head.activate(number, inputs, hidden, role),
            Self::Anisotropic(_) if !cfg!(feature = "anisotropy") => N::values(hidden),
            Self::Anisotropic(head) => head.activate(number, inputs, hidden, role),
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
    /// Whether two anchors at a time cost less than one after the other.
    pub(crate) fn takes_two(&self) -> bool {
        self.opacity.takes_two()
    }

    /// Fills `sums` with what no camera changes of an anchor's hidden layers, see [`FeatureSums`](super::FeatureSums).
    ///
    /// * `sums`: [`anchor_sums_len`](HeadShape::anchor_sums_len) floats.
    pub(crate) fn begin(&self, feature: &[f32], sums: &mut [f32]) {
        // Each fills what is its own, and no more.
        let [opacity, covariance, colour, detail_sums] = self.shape.head_sums(sums);
        self.opacity.begin(feature, opacity);
        self.covariance.begin(feature, covariance);
        self.colour.begin(feature, colour);
        if cfg!(feature = "detail")
            && let Some(detail) = &self.detail
        {
            detail.begin(feature, detail_sums);
        }
    }

    /// Converts the file's weights; takes as many words as [`HeadShape`] says.
    ///
    /// * `kept_as`: of floats. * `free`: memory to work in.
    pub(crate) fn convert(
        arena: &mut Arena<'s>,
        free: &mut Arena<'_>,
        kept_as: HeadWeights,
        heads: &HeadsView<'_>,
        shape: HeadShape,
    ) -> Result<Self, DecodeError> {
        let (covariance, weights) = (&heads.covariance, &mut heads.weights());
        // In the order of the file.
        Ok(Self {
            shape,
            opacity: N::Head::convert(arena, free.borrow(), kept_as, &heads.opacity, weights)?,
            covariance: if cfg!(feature = "anisotropy") && shape.covariance > 1 {
                CovarianceHead::Anisotropic(N::Head::convert(arena, free.borrow(), kept_as, covariance, weights)?)
            } else {
                CovarianceHead::Isotropic(N::Head::convert(arena, free.borrow(), kept_as, covariance, weights)?)
            },
            colour: N::Head::convert(arena, free.borrow(), kept_as, &heads.colour, weights)?,
            detail: match &heads.detail {
                Some(head) if cfg!(feature = "detail") && shape.detail > 0 => {
                    Some(Detail::convert(arena, head, weights)?)
                }
                _ => None,
            },
        })
    }
}
