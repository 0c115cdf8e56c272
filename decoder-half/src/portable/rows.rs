//! One splat blended into the rows of a tile.

/// Pixels of a row.
pub const ROW_LEN: usize = 16;

/// Slack for rounding of a span's ends, pixels.
pub const SLACK_PX: f32 = 1e-3;
/// Rounds a span's beginning up when added before digits are cut off, except for the last thousandth of a pixel.
pub(super) const ALMOST_ONE: f32 = 0.999;

/// A splat over the rows of a tile: at row dy from its centre alpha is a Gaussian of x around `centre_x + shear·dy`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct RowSplat {
    /// From the splat's centre to the first row, pixels.
    pub dy: f32,
    /// How far a row's centre moves per row.
    pub shear: f32,
    /// Inverse variance along a row, px⁻².
    pub row_precision: f32,
    /// Inverse variance across rows, px⁻².
    pub column_precision: f32,
    /// Natural logarithm of the opacity.
    pub log_opacity: f32,
    /// Squared Mahalanobis radius at which alpha is the least that draws.
    pub reach: f32,
    /// The inverse of `row_precision`.
    pub row_variance: f32,
    /// Of the splat, in pixels from the centre of a row's first pixel.
    pub centre_x: f32,
    /// Red, green, blue.
    pub colour: [f32; 3],
    /// What a pixel's step along a row changes by from pixel to pixel: e^−`row_precision`.
    pub ratio_step: f32,
    /// A pixel that less light comes through is finished.
    pub transmittance_stop: f32,
    /// Memory for the assembly, of any content.
    pub free: [u32; 4],
}

/// What the exponential function is computed with, see [`near`](Self::near).
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Exponential {
    /// 1/ln 2.
    pub log2_e: f32,
    /// 1.5 · 2²³.
    pub rounder: f32,
    /// ln 2 in two parts, the first of few digits.
    pub ln_2: [f32; 2],
    /// `(eʳ − 1 − r)/r² − ½` in powers of r, the highest first.
    pub tail: [f32; 4],
}

/// What is the same for all splats.
// In the order in which the assembly reads it.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct BlendConstants {
    pub(super) exponential: Exponential,
    slack_px: f32,
    almost_one: f32,
    pub(super) alpha_max: f32,
    transmittance_min: f32,
    /// A splat whose log opacity is below this reaches `alpha_max` nowhere, whatever is rounded.
    pub(crate) log_opacity_below_max: f32,
}

impl BlendConstants {
    /// * `alpha_max`: the largest alpha. * `log_opacity_below_max`: one per cent below its logarithm. * `transmittance_min`: a pixel that less
    ///   than this would come through takes no more colour.
    #[must_use]
    pub const fn new(
        exponential: Exponential,
        alpha_max: f32,
        log_opacity_below_max: f32,
        transmittance_min: f32,
    ) -> Self {
        let (slack_px, almost_one) = (SLACK_PX, ALMOST_ONE);
        Self { exponential, slack_px, almost_one, alpha_max, transmittance_min, log_opacity_below_max }
    }
}

/// What blending a splat took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RowsWork {
    /// Pixels for which the splat was evaluated.
    pub pixels: u32,
    /// Pixels that it finished.
    pub finished: u32,
}

impl Exponential {
    /// eˣ for x near 0: x = n·ln 2 + r with |r| ≤ ½ ln 2, eˣ = 2ⁿ·eʳ.
    ///
    /// # Budget
    /// About 15 instructions, no division, no branch.
    #[inline(always)]
    #[must_use]
    pub fn near(&self, x: f32) -> f32 {
        let shifted = x * self.log2_e + self.rounder;
        let n = shifted - self.rounder;
        let [high, low] = self.ln_2;
        let r = (x - n * high) - n * low;
        let [c4, c3, c2, c1] = self.tail;
        let tail = (((c4 * r + c3) * r + c2) * r + c1) * r + 0.5;
        let e_r = 1.0 + (r + (r * r) * tail);
        // The low bits of `shifted` hold n in two's complement: moved to the exponent field and biased, they are 2ⁿ.
        // A cast of `n` would saturate, and that check keeps the loop around it from vectorising.
        let two_n = f32::from_bits((shifted.to_bits() << 23).wrapping_add(1.0_f32.to_bits()));
        e_r * two_n
    }
}

/// As [`blend_rows_one_by_one`], four rows at once where there are vectors.
// Not inlined: among everything that a frame needs its loops would not stay in registers.
#[inline(never)]
pub fn blend_rows(
    splat: &mut RowSplat,
    constants: &BlendConstants,
    rows: &mut [[[f32; 4]; ROW_LEN]],
    width: u16,
) -> RowsWork {
    #[cfg(any(target_arch = "x86_64", target_arch = "aarch64", target_family = "wasm"))]
    return super::rows_in_fours::blend_rows(splat, constants, rows, width);
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64", target_family = "wasm")))]
    blend_rows_one_by_one(splat, constants, rows, width)
}

/// Blends a splat into rows of pixels, front to back.
///
/// Along a row alpha is a Gaussian of x, so the step from pixel to pixel is a factor, which itself changes by a constant
/// factor: two multiplications replace an exponential. Over 16 pixels the rounding grows to about 1e-5 of alpha.
///
/// * `rows`: red, green, blue and transmittance of each pixel; the transmittance of a finished one
///   is negated. * `width`: pixels of a row that are drawn, at most [`ROW_LEN`].
///
/// # Budget
/// Two exponentials a row, two multiplications and the blend a pixel.
#[inline(always)]
pub fn blend_rows_one_by_one(
    splat: &RowSplat,
    constants: &BlendConstants,
    rows: &mut [[[f32; 4]; ROW_LEN]],
    width: u16,
) -> RowsWork {
    let exp_near = |x| constants.exponential.near(x);
    let mut work = RowsWork::default();
    let mut dy = splat.dy;
    for row in rows {
        let across = dy * dy * splat.column_precision;
        let row_centre = splat.centre_x + splat.shear * dy;
        dy += 1.0;
        let left = splat.reach - across;
        // Written so that NaN leaves as well.
        if !(left > 0.0) {
            continue;
        }
        let half_width = sqrt_above(left * splat.row_variance) + SLACK_PX;
        let Some((first, last)) = span(row_centre, half_width, width) else { continue };
        let Some(pixels) = row.get_mut(first..=last) else { continue };
        let dx = first as f32 - row_centre;
        let mut gauss = exp_near(splat.log_opacity - 0.5 * (across + dx * dx * splat.row_precision));
        let mut ratio = exp_near(-splat.row_precision * (dx + 0.5));
        work.pixels += pixels.len() as u32;
        for pixel in pixels {
            work.finished += u32::from(blend_pixel(pixel, gauss, splat, constants));
            gauss *= ratio;
            ratio *= splat.ratio_step;
        }
    }
    work
}

/// Blends one splat into one pixel; returns whether the pixel is finished by it.
#[inline(always)]
fn blend_pixel(pixel: &mut [f32; 4], gauss: f32, splat: &RowSplat, constants: &BlendConstants) -> bool {
    let alpha = if gauss > constants.alpha_max { constants.alpha_max } else { gauss };
    let ([r, g, b, transmittance], [red, green, blue]) = (*pixel, splat.colour);
    let weight = alpha * transmittance;
    let next = transmittance - weight;
    if next >= splat.transmittance_stop {
        *pixel = [r + weight * red, g + weight * green, b + weight * blue, next];
        return false;
    }
    finish_pixel(pixel, weight, next, splat, constants)
}

/// What a splat of `weight` leaves of a pixel that hardly more than `next` comes through; returns whether it is finished by it.
#[inline(always)]
pub(super) fn finish_pixel(
    pixel: &mut [f32; 4],
    weight: f32,
    next: f32,
    splat: &RowSplat,
    constants: &BlendConstants,
) -> bool {
    let ([r, g, b, transmittance], [red, green, blue]) = (*pixel, splat.colour);
    let alive = transmittance > 0.0;
    if alive {
        *pixel = if next >= constants.transmittance_min {
            [r + weight * red, g + weight * green, b + weight * blue, -next]
        } else {
            [r, g, b, -transmittance]
        };
    }
    alive
}

/// First and last pixel within `half` of `centre` among `0..n`, and maybe one before them; pixel i lies at i.
#[inline]
#[must_use]
pub fn span(centre: f32, half: f32, n: u16) -> Option<(usize, usize)> {
    let low = centre - half;
    let high = centre + half;
    if high < 0.0 {
        return None;
    }
    // Both casts round towards zero and saturate; NaN gives the first pixel.
    let first = (low + ALMOST_ONE) as u32;
    let last = high as u32;
    let end = u32::from(n);
    let last = if last < end { last } else { end.wrapping_sub(1) };
    (first <= last && last < end).then_some((first as usize, last as usize))
}

/// A number not below √x and at most 0.2 % above it, for spans that may be too long but not too short.
///
/// Halving the exponent is right within 6 %; a step of Newton's method squares that and always ends above the root. It
/// costs a division where a correctly rounded root would take several times as long.
#[inline]
#[must_use]
pub fn sqrt_above(x: f32) -> f32 {
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
