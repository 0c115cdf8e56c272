//! An anchor's values by name.

use crate::bundle::Header;
use crate::math::exp;

/// One decoded anchor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Anchor<'r> {
    /// Position, normalised frame.
    pub(crate) position: [f32; 3],
    /// `[F]`.
    pub(crate) feature: &'r [f32],
    /// l_a, which scales the offsets and is the anchor's own size, normalised units.
    pub(crate) extent: [f32; 3],
    /// l_g, the base size of its Gaussians, normalised units.
    pub(crate) base_scale: [f32; 3],
    /// `[K]` offsets in units of `extent`.
    pub(crate) offsets: &'r [[f32; 3]],
    /// Bit k is set when offset k may be drawn.
    pub(crate) mask: u32,
}

impl<'r> Anchor<'r> {
    /// Names the parts of a row of channels; `None` when the row is too short.
    pub(crate) fn from_row(header: &Header, position: [f32; 3], mask: u32, row: &'r [f32]) -> Option<Self> {
        let (feature, rest) = row.split_at_checked(header.feature_dim.into())?;
        let (&[a0, a1, a2, g0, g1, g2], rest) = rest.split_first_chunk::<6>()?;
        let (offsets, _) = rest.as_chunks::<3>();
        Some(Self {
            position,
            feature,
            extent: [exp(a0), exp(a1), exp(a2)],
            base_scale: [exp(g0), exp(g1), exp(g2)],
            offsets,
            mask,
        })
    }
}
