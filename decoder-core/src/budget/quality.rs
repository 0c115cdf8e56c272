//! What accuracy a frame may give up to be drawn sooner.

use pocketsplat_format::{DecodeError, Field, in_range};

/// How exactly a frame is drawn.
///
/// What cutting alpha costs and saves was measured: `docs/experiments/2026-11-21-decoder-settings.md` of the repository.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Quality {
    /// A splat leaves pixels alone where its alpha is below this, in 255ths, 1..=[`Self::MAX_ALPHA_CUT`]; 1 in training. More
    /// makes splats smaller, and more opaque by as much.
    pub alpha_cut: u8,
    /// Whether the detail head runs, if the bundle has one; if not, its weights take no memory.
    pub detail: bool,
}

impl Quality {
    /// Largest [`alpha_cut`](Self::alpha_cut).
    pub const MAX_ALPHA_CUT: u8 = 64;
    /// As trained: the f64 reference within rounding.
    pub const EXACT: Self = Self { alpha_cut: 1, detail: true };
    /// What photographs hardly tell from exact; fewer instructions where splats are large.
    pub const BALANCED: Self = Self { alpha_cut: 2, detail: true };
    /// A draft: smaller splats, and no detail head.
    pub const DRAFT: Self = Self { alpha_cut: 8, detail: false };

    /// Field and value lie within their limits.
    pub(super) fn check(self) -> Result<(), DecodeError> {
        in_range(Field::AlphaCut, self.alpha_cut.into(), 1, Self::MAX_ALPHA_CUT.into())
    }
}
