//! An anchor's values by name.

use pocketsplat_format::bundle::Header;
use pocketsplat_format::rules;

use crate::functions::Functions;

/// One decoded anchor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Anchor<'r> {
    /// Position, normalised frame.
    pub(crate) position: [f32; 3],
    /// `[F]`.
    pub(crate) feature: &'r [f32],
    /// l_a, which scales the offsets and is the anchor's own size, normalised units.
    pub(crate) extent: [f32; 3],
    /// l_g, the base size of its Gaussians, normalised units; of isotropic ones the same along all axes.
    pub(crate) base_scale: [f32; 3],
    /// `[K]` offsets in units of `extent`.
    pub(crate) offsets: &'r [[f32; 3]],
    /// Bit k is set when offset k may be drawn.
    pub(crate) mask: u32,
}

const INK_DEVIATIONS: f32 = rules::INK_DEVIATIONS as f32;

impl<'r> Anchor<'r> {
    /// Names the parts of a row of channels; `None` when the row is too short.
    pub(crate) fn from_row<F: Functions>(
        header: &Header,
        position: [f32; 3],
        mask: u32,
        row: &'r [f32],
    ) -> Option<Self> {
        let (feature, rest) = row.split_at_checked(header.feature_dim.into())?;
        let (&[a0, a1, a2, g0], rest) = rest.split_first_chunk::<4>()?;
        let g0 = F::exp(g0);
        let (base_scale, rest) = if cfg!(feature = "anisotropy") && header.features.effects.anisotropic {
            let (&[g1, g2], rest) = rest.split_first_chunk::<2>()?;
            ([g0, F::exp(g1), F::exp(g2)], rest)
        } else {
            ([g0; 3], rest)
        };
        let (offsets, _) = rest.as_chunks::<3>();
        Some(Self { position, feature, extent: [a0, a1, a2].map(F::exp), base_scale, offsets, mask })
    }

    /// A box that holds the visible part of all splats it draws, as that of a chunk does; empty without any.
    pub(crate) fn ink_box(&self) -> ([f32; 3], [f32; 3]) {
        let ([px, py, pz], [lx, ly, lz]) = (self.position, self.extent);
        let radius = ink_radius(self.base_scale);
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        let mut mask = self.mask;
        for [ox, oy, oz] in self.offsets {
            let drawn = mask & 1 == 1;
            mask >>= 1;
            let centre = [px + ox * lx, py + oy * ly, pz + oz * lz];
            for ((low, high), x) in low.iter_mut().zip(&mut high).zip(centre).filter(|_| drawn) {
                *low = if x - radius < *low { x - radius } else { *low };
                *high = if x + radius > *high { x + radius } else { *high };
            }
        }
        (low, high)
    }
}

/// How far a Gaussian of these scales draws at most.
pub(crate) fn ink_radius([s0, s1, s2]: [f32; 3]) -> f32 {
    let widest = if s0 > s1 { s0 } else { s1 };
    INK_DEVIATIONS * if widest > s2 { widest } else { s2 }
}
