//! Splats blended in f32.

use pocketsplat_format::math::EXPONENTIAL;
use pocketsplat_format::rules::{self, TILE_PX};
use pocketsplat_half::{BlendConstants, ROW_LEN, RowSplat, SLACK_PX, blend_rows, span, sqrt_above};

use super::blending::{Blending, Pixel, SplatWork, TileRegion};
use crate::project::{PackedSplat, log_cut};

const TRANSMITTANCE_MIN: f32 = rules::TRANSMITTANCE_MIN as f32;
/// One per cent below the logarithm of the largest alpha.
const LOG_OPACITY_BELOW_MAX: f32 = -0.0201;
static CONSTANTS: BlendConstants =
    BlendConstants::new(EXPONENTIAL, rules::ALPHA_MAX as f32, LOG_OPACITY_BELOW_MAX, TRANSMITTANCE_MIN);
const _: () = assert!(rules::ALPHA_MAX > 0.99 - 1e-9 && ROW_LEN == TILE_PX as usize);

/// In f32, by the rows of `pocketsplat-half`.
///
/// A pixel is red, green, blue and transmittance; the transmittance of a finished one is negated, so that it fails every later test
/// without a flag of its own.
pub(crate) struct FloatBlending;

impl Blending for FloatBlending {
    /// −ln of the least alpha.
    type Rule = f32;
    type Background = [f32; 3];

    const EMPTY: Pixel = [0.0, 0.0, 0.0, 1.0];

    fn rule(alpha_cut: u8) -> f32 {
        log_cut(alpha_cut)
    }

    #[inline(always)]
    fn is_alive([.., transmittance]: Pixel) -> bool {
        transmittance > 0.0
    }

    /// # Budget
    /// Two exponentials a row, two multiplications and the blend a pixel.
    #[inline(always)]
    fn blend(
        place: TileRegion,
        [tile_x, tile_y]: [f32; 2],
        splat: &PackedSplat,
        log_cut: &f32,
        pixels: &mut [Pixel],
    ) -> SplatWork {
        let splat = splat.unpack();
        let [mean_x, mean_y] = splat.mean;
        // In pixels of the tile, measured from the centre of its first one.
        let centre_x = mean_x - tile_x - 0.5;
        let centre_y = mean_y - tile_y - 0.5;
        let reach = 2.0 * (splat.log_opacity + log_cut);
        // Rounded, the opacity may lie below the cut. Written so that NaN leaves as well.
        if !(reach >= 0.0) {
            return SplatWork::default();
        }
        let half_height = sqrt_above(reach / splat.column_precision) + SLACK_PX;
        let Some((first, last)) = span(centre_y, half_height, place.height) else { return SplatWork::default() };
        let (rows, _) = pixels.as_chunks_mut::<ROW_LEN>();
        let Some(rows) = rows.get_mut(first..=last) else { return SplatWork::default() };
        let n_rows = rows.len() as u32;
        let mut row_splat = RowSplat {
            dy: first as f32 - centre_y,
            shear: splat.shear,
            row_precision: splat.row_precision,
            column_precision: splat.column_precision,
            log_opacity: splat.log_opacity,
            reach,
            row_variance: 1.0 / splat.row_precision,
            centre_x,
            colour: splat.colour,
            ratio_step: EXPONENTIAL.near(-splat.row_precision),
            transmittance_stop: TRANSMITTANCE_MIN,
            free: [0; 4],
        };
        let work = blend_rows(&mut row_splat, &CONSTANTS, rows, place.width);
        SplatWork { rows: n_rows, pixels: work.pixels, finished: work.finished }
    }

    #[inline(always)]
    fn rgb([red, green, blue, _]: Pixel) -> [u8; 3] {
        // A float cast saturates: negative becomes 0, and so does NaN; 255.5 and more become 255.
        [red, green, blue].map(|channel| (channel * 255.0 + 0.5) as u8)
    }

    #[inline(always)]
    fn background(rgb: [f32; 3]) -> [f32; 3] {
        rgb
    }

    #[inline(always)]
    fn rgb_before([r, g, b, transmittance]: Pixel, [back_r, back_g, back_b]: [f32; 3]) -> [u8; 3] {
        let through = transmittance.abs();
        Self::rgb([r + through * back_r, g + through * back_g, b + through * back_b, transmittance])
    }
}
