//! Splats blended in integers, for processors without an FPU.
//!
//! With e = −log₂ α, a pixel at column x and row y of a tile has
//!
//! ```text
//! e(x, y) = −log₂ o + P·(x − c(y))² + Q·(y − v)²    c(y) = u + shear·(y − v)
//! P = ½·log₂ e·Σ'yy/det Σ'    Q = ½·log₂ e/Σ'yy
//! ```
//!
//! for a splat of opacity o centred at (u, v). That is a parabola along a row and down a column, so a step adds a difference, which itself
//! changes by a constant: ten products of f32 set a splat up in a tile, and then there are sums alone. A table gives 2⁻ᵉ.

use pocketsplat_format::rules::{self, TILE_PX};

use super::blending::{Blending, Pixel, SplatWork, TileRegion};
use crate::fixed::fixed;
use crate::project::{PackedSplat, log_cut};

/// Bits behind the point of exponents along a row, and of those from row to row, which are larger.
const PIXEL_BITS: i32 = 20;
const ROW_BITS: i32 = 17;
/// Those of colours, within ±8, and of transmittance. Together 28: what one of them times the other adds to a pixel.
const COLOUR_BITS: i32 = 12;
const TRANSMITTANCE_BITS: i32 = 16;
/// The largest: more could overflow.
const COLOUR_MAX: i32 = 0x7FFF;
/// Those of the natural logarithm of opacities, of which even the largest alpha that draws nothing is more than −8; and what makes it
/// −log₂ with [`ROW_BITS`].
const LOG_OPACITY_BITS: i32 = 13;
const LOG_OPACITY_MIN: i32 = -8 << LOG_OPACITY_BITS;
const LOG2_E_BITS: i32 = 10;
const MINUS_LOG2_E: i32 = -(LOG2_E * (1 << (ROW_BITS - LOG_OPACITY_BITS + LOG2_E_BITS)) as f32) as i32;
/// What the table's index has behind the point.
const INDEX_BITS: i32 = 8;

const LOG2_E: f32 = core::f32::consts::LOG2_E;
/// A part of a whole of [`TRANSMITTANCE_BITS`], rounded.
const fn share(x: f64) -> i32 {
    (x * (1 << TRANSMITTANCE_BITS) as f64 + 0.5) as i32
}
const ALPHA_MAX: u32 = share(rules::ALPHA_MAX) as u32;
const TRANSMITTANCE_MIN: i32 = share(rules::TRANSMITTANCE_MIN);
/// −log₂ 0.99: below this exponent alpha is the largest.
const EXPONENT_MIN: i32 = (0.014_499_569_695_115_09 * (1 << PIXEL_BITS) as f64) as i32;

/// Dilation leaves no direction a precision of more than 6 px⁻². Were it 8, a splat whose exponent is at most 9 somewhere in a tile, whose
/// pixels are 21.2 px apart at most, would be at most (√9 + 21.2·√(½·log₂ e·8))² = 2,912 at the tile's first pixel, and
/// (√9 + 15·√(½·log₂ e·8))² = 1,524 at the first of a row that it reaches.
const MOST_OF_TILE: i32 = 2912 << ROW_BITS;
const MOST_OF_ROW: i32 = 1524 << ROW_BITS;

/// 2^(−i/256), [`TRANSMITTANCE_BITS`] behind the point; the first is one too small, for 16 bits.
static POWERS: [u16; (1 << INDEX_BITS) + 1] = {
    let mut powers = [u16::MAX; (1 << INDEX_BITS) + 1];
    let (mut power, mut i) = (65_536.0_f64, 1);
    while i < powers.len() {
        power *= 0.997_296_064_965_018_8;
        powers[i] = (power + 0.5) as u16;
        i += 1;
    }
    powers
};

/// In integers: a pixel is red, green and blue with 28 bits behind the point, and transmittance with 16; that of a finished one is negated.
pub(crate) struct IntegerBlending;

impl Blending for IntegerBlending {
    /// −log₂ of the least alpha, [`PIXEL_BITS`] behind the point.
    type Rule = i32;
    /// [`COLOUR_BITS`] behind the point.
    type Background = [i32; 3];

    const EMPTY: Pixel = [0.0, 0.0, 0.0, f32::from_bits(1 << TRANSMITTANCE_BITS)];

    fn rule(alpha_cut: u8) -> i32 {
        fixed(log_cut(alpha_cut) * LOG2_E, PIXEL_BITS)
    }

    #[inline(always)]
    fn is_alive(pixel: Pixel) -> bool {
        let [.., transmittance] = integers(pixel);
        transmittance > 0
    }

    /// # Budget
    /// On RV32IMAC about 1,400 instructions a splat, 120 a row and 40 a pixel.
    // Not inlined: among everything that a frame needs its loops would not stay in registers.
    #[inline(never)]
    fn blend(
        place: TileRegion,
        corner_px: [f32; 2],
        splat: &PackedSplat,
        cut: &i32,
        pixels: &mut [Pixel],
    ) -> SplatWork {
        let mut work = SplatWork::default();
        let Some((mut form, colour)) = Form::of(splat, corner_px) else { return work };
        let row_cut = cut >> (PIXEL_BITS - ROW_BITS);
        let (rows, _) = bytemuck::must_cast_slice_mut::<_, [i32; 4]>(pixels).as_chunks_mut::<{ TILE_PX as usize }>();
        for row in rows.iter_mut().take(place.height.into()) {
            if form.least <= row_cut {
                work.rows += 1;
                if form.first < MOST_OF_ROW {
                    let pixels = row.get_mut(..place.width.into()).unwrap_or_default();
                    blend_row(pixels, form.row(), *cut, colour, &mut work);
                }
            } else if form.least_step >= 0 {
                break;
            }
            form.step();
        }
        work
    }

    #[inline(always)]
    fn rgb(pixel: Pixel) -> [u8; 3] {
        let [red, green, blue, _] = integers(pixel);
        [red, green, blue].map(rounded)
    }

    #[inline(always)]
    fn background(rgb: [f32; 3]) -> [i32; 3] {
        rgb.map(|channel| fixed(channel, COLOUR_BITS))
    }

    #[inline(always)]
    fn rgb_before(pixel: Pixel, [back_r, back_g, back_b]: [i32; 3]) -> [u8; 3] {
        let [r, g, b, transmittance] = integers(pixel);
        let behind = |sum: i32, back: i32| sum.wrapping_add(transmittance.wrapping_abs().wrapping_mul(back));
        [behind(r, back_r), behind(g, back_g), behind(b, back_b)].map(rounded)
    }
}

/// A splat's exponents in a tile, row after row, [`ROW_BITS`] behind the point; those along a row have [`PIXEL_BITS`].
struct Form {
    /// At the row's first pixel, how much more at the next row's, and how much that grows.
    first: i32,
    first_step: i32,
    first_step_step: i32,
    /// The least of the row, wherever it lies.
    least: i32,
    least_step: i32,
    least_step_step: i32,
    /// From the row's first pixel to its second, how that changes from row to row, and from pixel to pixel.
    along: i32,
    along_step: i32,
    along_along: i32,
}

/// Along a row: the exponent at its first pixel, the difference to the next, and how that grows.
#[derive(Clone, Copy)]
struct Row {
    exponent: i32,
    step: i32,
    step_step: i32,
}

impl Form {
    /// In the tile that begins at `corner_px`, and the splat's colour; `None` where it cannot reach the tile.
    #[inline(always)]
    fn of(splat: &PackedSplat, [corner_x, corner_y]: [f32; 2]) -> Option<(Self, [i32; 3])> {
        let ([mean_x, mean_y], shear, [row_precision, column_precision]) = splat.shape();
        let (log_opacity, colour) = splat.fixed(LOG_OPACITY_BITS, COLOUR_BITS);
        let colour = colour.map(|channel| channel.clamp(-COLOUR_MAX, COLOUR_MAX));
        let opacity = log_opacity.max(LOG_OPACITY_MIN).wrapping_mul(MINUS_LOG2_E) >> LOG2_E_BITS;
        // From the splat's centre to the first pixel's, down the column and along the row.
        let dy = corner_y - mean_y + 0.5;
        let dx = corner_x - mean_x + 0.5 - shear * dy;
        let (p, q) = (row_precision * (0.5 * LOG2_E), column_precision * (0.5 * LOG2_E));
        let (p_dx, q_dy, p_shear) = (p * dx, q * dy, p * shear);
        let (across, sheared) = (q_dy * dy, p_shear * shear);
        let least = opacity.saturating_add(fixed(across, ROW_BITS));
        let first = least.saturating_add(fixed(p_dx * dx, ROW_BITS));
        if first > MOST_OF_TILE {
            return None;
        }
        // Twice a number is the number with a bit more.
        let down = fixed(q_dy, ROW_BITS + 1).wrapping_add(fixed(q, ROW_BITS));
        let aside = fixed(sheared, ROW_BITS).wrapping_sub(fixed(p_shear * dx, ROW_BITS + 1));
        let form = Self {
            first,
            first_step: down.wrapping_add(aside),
            first_step_step: fixed(q, ROW_BITS + 1).wrapping_add(fixed(sheared, ROW_BITS + 1)),
            least,
            least_step: down,
            least_step_step: fixed(q, ROW_BITS + 1),
            along: fixed(p_dx, PIXEL_BITS + 1).wrapping_add(fixed(p, PIXEL_BITS)),
            along_step: fixed(p_shear, PIXEL_BITS + 1).wrapping_neg(),
            along_along: fixed(p, PIXEL_BITS + 1),
        };
        Some((form, colour))
    }

    /// Goes to the next row.
    // Wraps for numbers that no projection makes.
    #[inline(always)]
    fn step(&mut self) {
        self.first = self.first.wrapping_add(self.first_step);
        self.first_step = self.first_step.wrapping_add(self.first_step_step);
        self.least = self.least.wrapping_add(self.least_step);
        self.least_step = self.least_step.wrapping_add(self.least_step_step);
        self.along = self.along.wrapping_add(self.along_step);
    }

    #[inline(always)]
    fn row(&self) -> Row {
        Row { exponent: self.first << (PIXEL_BITS - ROW_BITS), step: self.along, step_step: self.along_along }
    }
}

impl Row {
    #[inline(always)]
    fn step(&mut self) {
        self.exponent = self.exponent.wrapping_add(self.step);
        self.step = self.step.wrapping_add(self.step_step);
    }
}

/// Blends the pixels of a row whose exponents are at most `cut`: they lie side by side.
#[inline(always)]
fn blend_row(pixels: &mut [[i32; 4]], mut row: Row, cut: i32, colour: [i32; 3], work: &mut SplatWork) {
    let mut pixels = pixels.iter_mut();
    while row.exponent > cut {
        // Beyond the vertex they grow.
        if row.step >= 0 || pixels.next().is_none() {
            return;
        }
        row.step();
    }
    for pixel in pixels {
        if row.exponent > cut {
            break;
        }
        work.pixels += 1;
        work.finished += u32::from(blend_pixel(pixel, row.exponent, colour));
        row.step();
    }
}

/// Blends a splat into one pixel; returns whether the pixel is finished by it.
#[inline(always)]
fn blend_pixel(pixel: &mut [i32; 4], exponent: i32, [red, green, blue]: [i32; 3]) -> bool {
    let [r, g, b, transmittance] = *pixel;
    if transmittance <= 0 {
        return false;
    }
    let alpha = if exponent < EXPONENT_MIN { ALPHA_MAX } else { power(exponent) };
    let half = 1 << (TRANSMITTANCE_BITS - 1);
    let weight = (alpha.wrapping_mul(transmittance as u32).wrapping_add(half) >> TRANSMITTANCE_BITS) as i32;
    let next = transmittance - weight;
    if next < TRANSMITTANCE_MIN {
        *pixel = [r, g, b, -transmittance];
        return true;
    }
    let with = |sum: i32, channel: i32| sum.wrapping_add(weight.wrapping_mul(channel));
    *pixel = [with(r, red), with(g, green), with(b, blue), next];
    false
}

/// 2⁻ᵉ, from the table by a line between two of its entries.
#[inline(always)]
fn power(exponent: i32) -> u32 {
    const BETWEEN_BITS: i32 = PIXEL_BITS - INDEX_BITS;
    let index = (exponent >> BETWEEN_BITS) as usize % (POWERS.len() - 1);
    let [upper, lower] = [index, index + 1].map(|i| u32::from(POWERS.get(i).copied().unwrap_or_default()));
    let between = exponent as u32 % (1 << BETWEEN_BITS);
    let power = upper - (((upper - lower) * between) >> BETWEEN_BITS);
    power.wrapping_shr((exponent >> PIXEL_BITS) as u32)
}

#[inline(always)]
fn integers(pixel: Pixel) -> [i32; 4] {
    bytemuck::must_cast(pixel)
}

/// A channel in 255ths.
#[inline(always)]
fn rounded(channel: i32) -> u8 {
    // 20 bits behind the point leave room for 255.
    let channel = (channel >> (COLOUR_BITS + TRANSMITTANCE_BITS - 20)).clamp(0, 1 << 20);
    ((channel * 255 + (1 << 19)) >> 20) as u8
}

#[cfg(test)]
mod tests {
    use std::vec;
    use std::vec::Vec;

    use super::super::{Blending, FloatBlending, IntegerBlending, Pixel, TileRegion};
    use super::{TRANSMITTANCE_BITS, integers};
    use crate::project::{PackedSplat, Splat, TILE_PIXELS};

    const CORNER_PX: [f32; 2] = [48.0, 32.0];
    const TILE: TileRegion = TileRegion { column: 3, row: 2, width: 16, height: 16 };

    struct Random(u32);

    impl Random {
        fn bits(&mut self) -> u32 {
            self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            self.0 ^ self.0 >> 15
        }

        fn between(&mut self, low: f32, high: f32) -> f32 {
            low + (high - low) * (self.bits() >> 8) as f32 / 16_777_216.0
        }
    }

    /// Of a Gaussian with these deviations, turned, plus a dilation; `None` where no tile would list it.
    fn splat(random: &mut Random) -> Option<Splat> {
        let [long, short] = [random.between(-5.0, 9.0), random.between(-5.0, 3.0)].map(f32::exp2);
        let (sin, cos) = random.between(0.0, 6.3).sin_cos();
        let of = |a: f32, b: f32, c: f32, d: f32| a * b * long * long + c * d * short * short;
        let dilation = random.between(0.17, 0.5);
        let (xx, xy, yy) =
            (of(cos, cos, sin, sin) + dilation, of(cos, sin, -sin, cos), of(sin, sin, cos, cos) + dilation);
        let det = xx * yy - xy * xy;
        // Near the tile, or as far as the splat is large.
        let mean = [(CORNER_PX[0] + 8.0, xx), (CORNER_PX[1] + 8.0, yy)]
            .map(|(middle, variance)| middle + random.between(-1.0, 1.0) * (8.0 + 2.0 * variance.sqrt()));
        (det > 0.0).then(|| Splat {
            mean,
            shear: xy / yy,
            row_precision: yy / det,
            column_precision: 1.0 / yy,
            log_opacity: random.between(-5.4, 0.0),
            colour: [0.9, -0.1, 1.4],
            depth: 1.0,
        })
    }

    /// Blended into an empty tile.
    fn drawn<B: Blending>(splat: &PackedSplat, alpha_cut: u8) -> (Vec<Pixel>, u32) {
        let mut pixels = vec![B::EMPTY; TILE_PIXELS];
        let work = B::blend(TILE, CORNER_PX, splat, &B::rule(alpha_cut), &mut pixels);
        (pixels, work.pixels)
    }

    #[test]
    fn every_pixel_has_the_alpha_of_the_formula() {
        let mut random = Random(1);
        let (mut n_drawn, mut worst) = (0, 0.0_f64);
        for _ in 0..20_000 {
            let Some(splat) = splat(&mut random) else { continue };
            let packed = PackedSplat::new(&splat);
            let kept = packed.unpack();
            let (pixels, n_pixels) = drawn::<IntegerBlending>(&packed, 1);
            let mut n_here = 0;
            for (i, pixel) in pixels.iter().enumerate() {
                let at = |axis: usize, index: usize| {
                    f64::from(CORNER_PX[axis]) + index as f64 + 0.5 - f64::from(kept.mean[axis])
                };
                let (dy, shear) = (at(1, i / 16), f64::from(kept.shear));
                let (across, along) = (dy, at(0, i % 16) - shear * dy);
                let distance_2 =
                    across * across * f64::from(kept.column_precision) + along * along * f64::from(kept.row_precision);
                let alpha = (f64::from(kept.log_opacity) - 0.5 * distance_2).exp().min(0.99);
                let [red, _, _, transmittance] = integers(*pixel);
                let found = 1.0 - f64::from(transmittance) / f64::from(1 << TRANSMITTANCE_BITS);
                n_here += u32::from(found > 0.0);
                let is_near_cut = (alpha * 255.0 - 1.0).abs() < 0.01;
                let expected = if alpha * 255.0 < 1.0 { 0.0 } else { alpha };
                let error = (found - expected).abs() / (alpha + 0.01);
                worst = if is_near_cut { worst } else { worst.max(error) };
                assert!(is_near_cut || error < 0.0015, "{found} for {expected} in pixel {i} of {kept:?}");
                let colour = f64::from(red) / f64::from(1 << 28);
                assert!((colour - found * f64::from(kept.colour[0])).abs() < 3e-4, "{colour} of {found}");
            }
            n_drawn += n_here;
            assert_eq!(n_pixels, n_here, "none is counted that takes nothing");
        }
        std::println!("{n_drawn} pixels, largest error {worst:.5}");
        assert!(n_drawn > 200_000, "{n_drawn} pixels");
    }

    #[test]
    fn many_layers_come_to_the_bytes_of_floats() {
        const TILES: u32 = 40;
        let mut random = Random(2);
        let (mut n_off, mut finished) = (0, [0_u32; 2]);
        for _ in 0..TILES {
            let mut floats = vec![FloatBlending::EMPTY; TILE_PIXELS];
            let mut integers = vec![IntegerBlending::EMPTY; TILE_PIXELS];
            for _ in 0..1000 {
                let Some(splat) = splat(&mut random) else { continue };
                let colour = [(); 3].map(|()| random.between(0.0, 1.0));
                let packed = PackedSplat::new(&Splat { colour, ..splat });
                let as_floats = FloatBlending::blend(TILE, CORNER_PX, &packed, &FloatBlending::rule(1), &mut floats);
                let rule = IntegerBlending::rule(1);
                let as_integers = IntegerBlending::blend(TILE, CORNER_PX, &packed, &rule, &mut integers);
                finished = [finished[0] + as_floats.finished, finished[1] + as_integers.finished];
                assert!(as_integers.rows <= as_floats.rows, "{splat:?}");
            }
            for (float, integer) in floats.iter().zip(&integers) {
                let [float, integer] = [FloatBlending::rgb(*float), IntegerBlending::rgb(*integer)];
                let off = float.iter().zip(&integer).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or_default();
                assert!(off <= 1, "{integer:?} for {float:?}");
                n_off += u32::from(off > 0);
            }
        }
        std::println!("{n_off} pixels of {TILES} tiles off, finished {finished:?}");
        assert!(n_off < TILES * TILE_PIXELS as u32 / 20, "{n_off} pixels are off");
        // Of the last ten-thousandth of the light 16 bits hold six steps.
        assert!(finished[0] > 100 && finished[0].abs_diff(finished[1]) <= finished[0] / 5, "finished {finished:?}");
    }

    #[test]
    fn a_background_shows_through_and_channels_saturate() {
        let half = f32::from_bits(1 << (TRANSMITTANCE_BITS - 1));
        let channel = |x: f32| f32::from_bits(((x * 268_435_456.0) as i32).cast_unsigned());
        let pixel = [channel(0.25), channel(-0.5), channel(3.0), half];
        let rgb_before = |pixel, rgb| IntegerBlending::rgb_before(pixel, IntegerBlending::background(rgb));
        assert_eq!(IntegerBlending::rgb(pixel), [64, 0, 255]);
        assert_eq!(rgb_before(pixel, [1.0, 1.0, 0.0]), [191, 0, 255]);
        assert_eq!(rgb_before(IntegerBlending::EMPTY, [0.2, 0.6, 1.0]), [51, 153, 255]);
    }

    #[test]
    fn numbers_that_no_projection_makes_are_drawn_somehow() {
        let mut random = Random(3);
        for _ in 0..20_000 {
            let mut float = || f32::from_bits(random.bits());
            let splat = Splat {
                mean: [float(), float()],
                shear: float(),
                row_precision: float(),
                column_precision: float(),
                log_opacity: float(),
                colour: [float(), float(), float()],
                depth: 1.0,
            };
            let (pixels, _) = drawn::<IntegerBlending>(&PackedSplat::new(&splat), 1);
            assert!(pixels.iter().all(|pixel| integers(*pixel)[3] > 0), "transmittance never grows: {splat:?}");
        }
    }
}
