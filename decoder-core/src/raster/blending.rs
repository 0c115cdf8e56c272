//! What it takes to blend splats into pixels.

use crate::project::PackedSplat;

/// A pixel while it is drawn; what its four words are is for a [`Blending`] to say.
pub(crate) type Pixel = [f32; 4];

/// Where a tile lies; it ends early at the frame's right and lower border.
#[derive(Clone, Copy)]
pub(crate) struct TileRegion {
    pub(crate) column: u8,
    pub(crate) row: u8,
    pub(crate) width: u16,
    pub(crate) height: u16,
}

/// How splats are blended into pixels, front to back.
pub(crate) trait Blending {
    /// What is the same for all splats of a frame.
    type Rule;
    /// A colour that shows where light comes through.
    type Background: Copy;

    /// Nothing drawn yet.
    const EMPTY: Pixel;

    /// * `alpha_cut`: contributions of less are left out, in 255ths.
    fn rule(alpha_cut: u8) -> Self::Rule;

    /// Whether a pixel takes more colour.
    fn is_alive(pixel: Pixel) -> bool;

    /// Blends a splat into a tile.
    ///
    /// * `corner_px`: of the tile. * `pixels`: `[TILE_PIXELS]`.
    fn blend(
        place: TileRegion,
        corner_px: [f32; 2],
        splat: &PackedSplat,
        rule: &Self::Rule,
        pixels: &mut [Pixel],
    ) -> SplatWork;

    /// A pixel's colour in bytes, before black.
    fn rgb(pixel: Pixel) -> [u8; 3];

    /// * `rgb`: 0 to 1.
    fn background(rgb: [f32; 3]) -> Self::Background;

    /// A pixel's colour in bytes, before a background.
    fn rgb_before(pixel: Pixel, background: Self::Background) -> [u8; 3];
}

/// What a splat took in a tile.
#[derive(Clone, Copy, Default)]
pub(crate) struct SplatWork {
    /// Rows of pixels that it reaches.
    pub(crate) rows: u32,
    /// Pixels for which it was evaluated.
    pub(crate) pixels: u32,
    /// Pixels that it finished.
    pub(crate) finished: u32,
}
