//! Front-to-back compositing of one tile.

use crate::math::exp;
use crate::math::functions::Functions;
use crate::project::{Splat, SplatRecord, TileRect, log_cut};
use crate::rules::{self, TILE_PX};

const ALPHA_MAX: f32 = rules::ALPHA_MAX as f32;
const TRANSMITTANCE_MIN: f32 = rules::TRANSMITTANCE_MIN as f32;

/// Which contributions are left out.
pub(crate) struct BlendRule {
    /// The least alpha.
    alpha_min: f32,
    /// −ln of it.
    log_cut: f32,
    /// A pixel that less light comes through is finished.
    transmittance_stop: f32,
}

impl BlendRule {
    /// * `alpha_cut`: the least alpha, in 255ths. * `transmittance_stop`: in 10 000ths.
    pub(crate) fn new(alpha_cut: u8, transmittance_stop: u16) -> Self {
        Self {
            alpha_min: f32::from(alpha_cut) / 255.0,
            log_cut: log_cut(alpha_cut),
            transmittance_stop: f32::from(transmittance_stop) * TRANSMITTANCE_MIN,
        }
    }
}

/// Red, green, blue and transmittance of a pixel while it is drawn; the transmittance of a finished one is negated, so that it fails
/// every later test without a flag of its own.
pub(crate) type Pixel = [f32; 4];

/// Nothing drawn yet.
pub(crate) const EMPTY: Pixel = [0.0, 0.0, 0.0, 1.0];

/// Where a tile lies; it ends early at the frame's right and lower border.
#[derive(Clone, Copy)]
pub(crate) struct TilePlace {
    pub(crate) column: u8,
    pub(crate) row: u8,
    pub(crate) width: u16,
    pub(crate) height: u16,
}

/// What a tile cost.
#[derive(Clone, Copy, Default)]
pub(crate) struct TileWork {
    /// Splats blended into it.
    pub(crate) splats: u32,
    /// Rows of pixels that a splat reaches.
    pub(crate) rows: u32,
    /// Pixels for which a splat was evaluated.
    pub(crate) pixels: u32,
    /// Pixels that are not finished.
    pub(crate) alive: u32,
}

/// Draws the splats of `list`, in its order, behind what is in a tile.
///
/// * `list`: indices into `splats` and `rects`, nearest first; entries beside the tile's columns are skipped.
/// * `pixels`: `[TILE_PIXELS]`, [`EMPTY`] at first.
///
/// # Budget
/// Per splat and row of pixels two exponentials, per pixel two multiplications and the blend.
pub(crate) fn blend_tile<F: Functions, S: SplatRecord>(
    place: TilePlace,
    splats: &[S],
    rects: &[TileRect],
    list: &[u32],
    rule: &BlendRule,
    pixels: &mut [Pixel],
) -> TileWork {
    let rows = pixels.chunks_exact(TILE_PX.into()).take(place.height.into());
    let in_tile = rows.flat_map(|row| row.iter().take(place.width.into()));
    let mut alive = in_tile.filter(|[.., transmittance]| *transmittance > 0.0).count() as u32;
    let mut work = TileWork::default();
    for &index in list {
        if alive == 0 {
            break;
        }
        let (Some(rect), Some(splat)) = (rects.get(index as usize), splats.get(index as usize)) else { continue };
        if place.column < rect.first_column || place.column > rect.last_column {
            continue;
        }
        let [rows, evaluated] = blend_splat::<F>(place, &splat.unpack(), rule, pixels, &mut alive);
        work.splats += 1;
        work.rows += rows;
        work.pixels = work.pixels.saturating_add(evaluated);
    }
    TileWork { alive, ..work }
}

/// Puts the background behind a tile, if there is one, and rounds to bytes, `[height, width]` row by row.
// Not inlined: that saves text, and a frame calls it once a tile.
#[inline(never)]
pub(crate) fn finish_tile(place: TilePlace, pixels: &[Pixel], background: Option<[f32; 3]>, rgb: &mut [[u8; 3]]) {
    match background {
        Some(background) => finish(place, pixels, rgb, |pixel| behind(pixel, background)),
        None => finish(place, pixels, rgb, |[red, green, blue, _]| [red, green, blue]),
    }
}

/// Rounds what `colour` makes of each pixel to bytes.
fn finish(place: TilePlace, pixels: &[Pixel], rgb: &mut [[u8; 3]], colour: impl Fn(Pixel) -> [f32; 3]) {
    let (rows, _) = pixels.as_chunks::<{ TILE_PX as usize }>();
    let out_rows = rgb.chunks_exact_mut(usize::from(place.width).max(1));
    for (out_row, row) in out_rows.zip(rows).take(place.height.into()) {
        for (out, pixel) in out_row.iter_mut().zip(row) {
            // A float cast saturates: negative becomes 0, and so does NaN; 255.5 and more become 255.
            *out = colour(*pixel).map(|channel| (channel * 255.0 + 0.5) as u8);
        }
    }
}

/// Blends one splat into the rows of the tile; returns how many rows it reaches and how many pixels it was evaluated for.
///
/// Along a row alpha is a Gaussian of x, so the step from pixel to pixel is a factor, which itself changes by a constant
/// factor: two multiplications replace an exponential. Over 16 pixels the rounding grows to about 1e-5 of alpha.
// Not inlined: among everything that a frame needs its loops would not stay in registers.
#[inline(never)]
fn blend_splat<F: Functions>(
    place: TilePlace,
    splat: &Splat,
    rule: &BlendRule,
    pixels: &mut [Pixel],
    alive: &mut u32,
) -> [u32; 2] {
    let [mean_x, mean_y] = splat.mean;
    // In pixels of the tile, measured from the centre of its first one.
    let centre_x = mean_x - f32::from(u16::from(place.column) * TILE_PX) - 0.5;
    let centre_y = mean_y - f32::from(u16::from(place.row) * TILE_PX) - 0.5;
    let reach = 2.0 * (splat.log_opacity + rule.log_cut);
    let row_variance = 1.0 / splat.row_precision;
    // Whatever the functions: its error grows with the square of a pixel's distance.
    let ratio_step = exp(-splat.row_precision);
    let half_height = sqrt_above(reach / splat.column_precision) + SLACK_PX;
    let Some((first, last)) = span(centre_y, half_height, place.height) else { return [0; 2] };
    let (rows, _) = pixels.as_chunks_mut::<{ TILE_PX as usize }>();
    let Some(rows) = rows.get_mut(first..=last) else { return [0; 2] };
    let n_rows = rows.len() as u32;
    let mut n_evaluated = 0;
    let mut dy = first as f32 - centre_y;
    for row in rows {
        let across = dy * dy * splat.column_precision;
        let row_centre = centre_x + splat.shear * dy;
        dy += 1.0;
        let left = reach - across;
        let half_width = sqrt_above(if left > 0.0 { left * row_variance } else { 0.0 }) + SLACK_PX;
        let Some((first, last)) = span(row_centre, half_width, place.width) else { continue };
        let Some(pixels) = row.get_mut(first..=last) else { continue };
        let dx = first as f32 - row_centre;
        let mut gauss = F::exp_near(splat.log_opacity - 0.5 * (across + dx * dx * splat.row_precision));
        let mut ratio = F::exp_near(-splat.row_precision * (dx + 0.5));
        n_evaluated += pixels.len() as u32;
        for pixel in pixels {
            if gauss >= rule.alpha_min && blend_pixel(pixel, gauss, splat.colour, rule.transmittance_stop) {
                *alive -= 1;
            }
            gauss *= ratio;
            ratio *= ratio_step;
        }
    }
    [n_rows, n_evaluated]
}

/// Blends one splat into one pixel; returns whether the pixel is finished by it.
#[inline(always)]
fn blend_pixel(pixel: &mut Pixel, gauss: f32, [red, green, blue]: [f32; 3], stop: f32) -> bool {
    let alpha = if gauss > ALPHA_MAX { ALPHA_MAX } else { gauss };
    let [r, g, b, transmittance] = *pixel;
    let next = transmittance * (1.0 - alpha);
    let weight = alpha * transmittance;
    if next >= stop {
        *pixel = [r + weight * red, g + weight * green, b + weight * blue, next];
        return false;
    }
    let alive = transmittance > 0.0;
    if alive {
        *pixel = if next >= TRANSMITTANCE_MIN {
            [r + weight * red, g + weight * green, b + weight * blue, -next]
        } else {
            [r, g, b, -transmittance]
        };
    }
    alive
}

/// The colour with the background behind it.
#[inline]
fn behind([r, g, b, transmittance]: Pixel, [back_r, back_g, back_b]: [f32; 3]) -> [f32; 3] {
    let through = transmittance.abs();
    [r + through * back_r, g + through * back_g, b + through * back_b]
}

/// Slack for rounding of a span's ends, pixels; the test of alpha decides about the pixels it adds.
const SLACK_PX: f32 = 1e-3;
/// Rounds a span's beginning up when added before digits are cut off, except for the last thousandth of a pixel.
const ALMOST_ONE: f32 = 0.999;

/// First and last pixel within `half` of `centre` among `0..n`, and maybe one before them; pixel i lies at i.
#[inline]
fn span(centre: f32, half: f32, n: u16) -> Option<(usize, usize)> {
    let low = centre - half;
    let high = centre + half;
    if high < 0.0 {
        return None;
    }
    // Both casts round towards zero and saturate; NaN gives the first pixel, which the test of alpha leaves alone.
    let first = (low + ALMOST_ONE) as u32;
    let last = high as u32;
    let end = u32::from(n);
    let last = if last < end { last } else { end.wrapping_sub(1) };
    (first <= last && last < end).then_some((first as usize, last as usize))
}

/// A number not below √x and at most 0.2 % above it, for spans that may be too long but not too short.
///
/// Halving the exponent is right within 6 %; a step of Newton's method squares that and always ends above the root. It
/// costs a division where a correctly rounded root would take 47 instructions on a Cortex-M4.
#[inline]
fn sqrt_above(x: f32) -> f32 {
    let guess = f32::from_bits((x.to_bits() >> 1) + 0x1FBD_1DF5);
    0.5 * (guess + x / guess)
}

#[cfg(test)]
mod tests {
    use super::sqrt_above;

    #[test]
    fn sqrt_above_brackets_the_root() {
        for i in 1..100_000 {
            let x = i as f32 * 0.013;
            let (ours, root) = (f64::from(sqrt_above(x)), f64::from(x).sqrt());
            assert!(ours >= root * (1.0 - 1e-7) && ours < root * 1.002, "{ours} against {root} for {x}");
        }
        assert!(sqrt_above(0.0) < 1e-9, "zero stays negligible");
    }
}
