//! The same blend where the processor has vectors of four floats: what a row begins with is computed for four rows at a time, and the
//! channels of a pixel together.

use wide::{CmpGe, CmpGt, f32x4, i32x4};

use super::rows::{ALMOST_ONE, BlendConstants, Exponential, ROW_LEN, RowSplat, RowsWork, SLACK_PX, finish_pixel};

const LANES: usize = 4;

/// What four rows begin with.
struct Beginnings {
    /// First pixel.
    first: [i32; LANES],
    /// The one behind the last; not behind the first where the splat does not reach.
    end: [i32; LANES],
    gauss: [f32; LANES],
    ratio: [f32; LANES],
}

/// As [`blend_rows_one_by_one`](super::rows::blend_rows_one_by_one), bit for bit where variances are positive.
pub(super) fn blend_rows(
    splat: &RowSplat,
    constants: &BlendConstants,
    rows: &mut [[[f32; 4]; ROW_LEN]],
    width: u16,
) -> RowsWork {
    let mut work = RowsWork::default();
    let [red, green, blue] = splat.colour;
    // What a pixel changes by for a weight: of what comes through a weight is taken away.
    let change = f32x4::new([red, green, blue, -1.0]);
    let mut dy = splat.dy;
    for rows in rows.chunks_mut(LANES) {
        let mut dys = [0.0; LANES];
        for lane in &mut dys {
            *lane = dy;
            dy += 1.0;
        }
        let Beginnings { first, end, gauss, ratio } = beginnings(splat, constants, f32x4::new(dys), width);
        let lanes = first.into_iter().zip(end).zip(gauss).zip(ratio);
        for (row, (((first, end), mut gauss), mut ratio)) in rows.iter_mut().zip(lanes) {
            let Some(pixels) = row.get_mut(first as usize..end as usize) else { continue };
            work.pixels += pixels.len() as u32;
            for pixel in pixels {
                let alpha = if gauss > constants.alpha_max { constants.alpha_max } else { gauss };
                let [.., transmittance] = *pixel;
                let weight = alpha * transmittance;
                let next = transmittance - weight;
                if next >= splat.transmittance_stop {
                    *pixel = (f32x4::new(*pixel) + f32x4::splat(weight) * change).to_array();
                } else {
                    work.finished += u32::from(finish_pixel(pixel, weight, next, splat, constants));
                }
                gauss *= ratio;
                ratio *= splat.ratio_step;
            }
        }
    }
    work
}

#[inline(always)]
fn beginnings(splat: &RowSplat, constants: &BlendConstants, dy: f32x4, width: u16) -> Beginnings {
    let [zero, half] = [0.0, 0.5].map(f32x4::splat);
    let across = dy * dy * f32x4::splat(splat.column_precision);
    let row_centre = f32x4::splat(splat.centre_x) + f32x4::splat(splat.shear) * dy;
    let left = f32x4::splat(splat.reach) - across;
    let half_width = sqrt_above(left * f32x4::splat(splat.row_variance)) + f32x4::splat(SLACK_PX);
    let low = row_centre - half_width + f32x4::splat(ALMOST_ONE);
    let high = row_centre + half_width;
    // As of `span`, but for the ends, which are cut while they are floats; NaN gives the first pixel.
    let first = cut(low, ROW_LEN as f32).fast_trunc_int();
    let last = cut(high, f32::from(width) - 1.0).fast_trunc_int();
    let is_reached: i32x4 = bytemuck::cast(left.cmp_gt(zero) & (high.cmp_ge(zero) | high.is_nan()));
    let end = (last + i32x4::splat(1)) & is_reached;
    let dx = f32x4::from_i32x4(first) - row_centre;
    let precision = f32x4::splat(splat.row_precision);
    let gauss = near(&constants.exponential, f32x4::splat(splat.log_opacity) - half * (across + dx * dx * precision));
    let ratio = near(&constants.exponential, f32x4::splat(-splat.row_precision) * (dx + half));
    Beginnings { first: first.to_array(), end: end.to_array(), gauss: gauss.to_array(), ratio: ratio.to_array() }
}

/// `x` cut to 0 and `most`; of NaN 0.
#[inline(always)]
fn cut(x: f32x4, most: f32) -> f32x4 {
    let (zero, most) = (f32x4::splat(0.0), f32x4::splat(most));
    let positive = x.cmp_gt(zero).blend(x, zero);
    most.cmp_gt(positive).blend(positive, most)
}

/// As [`Exponential::near`].
#[inline(always)]
fn near(exponential: &Exponential, x: f32x4) -> f32x4 {
    let rounder = f32x4::splat(exponential.rounder);
    let shifted = x * f32x4::splat(exponential.log2_e) + rounder;
    let n = shifted - rounder;
    let [high, low] = exponential.ln_2.map(f32x4::splat);
    let r = (x - n * high) - n * low;
    let [c4, c3, c2, c1] = exponential.tail.map(f32x4::splat);
    let [half, one] = [0.5, 1.0].map(f32x4::splat);
    let tail = (((c4 * r + c3) * r + c2) * r + c1) * r + half;
    let e_r = one + (r + (r * r) * tail);
    let bits: i32x4 = bytemuck::cast(shifted);
    let two_n = (bits << 23_u32) + i32x4::splat(1.0_f32.to_bits() as i32);
    e_r * bytemuck::cast::<i32x4, f32x4>(two_n)
}

/// As [`sqrt_above`](super::rows::sqrt_above); of a negative number anything.
#[inline(always)]
fn sqrt_above(x: f32x4) -> f32x4 {
    let bits: i32x4 = bytemuck::cast(x);
    let guess: f32x4 = bytemuck::cast((bits >> 1_u32) + i32x4::splat(0x1FBD_1DF5));
    f32x4::splat(0.5) * (guess + x / guess)
}

#[cfg(test)]
mod tests {
    use super::super::rows::blend_rows_one_by_one;
    use super::*;

    const EXPONENTIAL: Exponential = Exponential {
        log2_e: core::f32::consts::LOG2_E,
        rounder: 12_582_912.0,
        ln_2: [0.693_359_4, -2.121_944_4e-4],
        tail: [1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0],
    };
    const CONSTANTS: BlendConstants = BlendConstants::new(EXPONENTIAL, 0.99, -0.0201, 1e-4);

    /// A stream of numbers from 0 to 1, the same every time.
    struct Numbers(u32);

    impl Numbers {
        fn next(&mut self) -> f32 {
            self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (self.0 >> 8) as f32 / 16_777_216.0
        }

        fn between(&mut self, low: f32, high: f32) -> f32 {
            low + (high - low) * self.next()
        }

        /// Mostly a number of the range; now and then one that no scene has.
        fn any(&mut self, low: f32, high: f32) -> f32 {
            match (self.next() * 400.0) as u32 {
                0 => f32::NAN,
                1 => f32::INFINITY,
                2 => f32::NEG_INFINITY,
                3 => 0.0,
                4 => -1e30,
                _ => self.between(low, high),
            }
        }

        fn splat(&mut self) -> RowSplat {
            let log_opacity = self.any(-5.0, 0.0);
            let row_precision = self.any(-7.0, 2.0).exp();
            RowSplat {
                dy: self.any(-20.0, 20.0),
                shear: self.any(-3.0, 3.0),
                row_precision,
                column_precision: self.any(-7.0, 2.0).exp(),
                log_opacity,
                reach: 2.0 * (log_opacity + 5.54),
                row_variance: 1.0 / row_precision,
                centre_x: self.any(-20.0, 36.0),
                colour: [self.next(), self.next(), self.next()],
                ratio_step: EXPONENTIAL.near(-row_precision),
                transmittance_stop: 1e-4,
                free: [0; 4],
            }
        }
    }

    #[test]
    fn four_rows_at_a_time_leave_the_bits_of_one_after_the_other() {
        let random = &mut Numbers(7);
        let (mut n_pixels, mut n_finished) = (0, 0);
        for _ in 0..3000 {
            let width = (random.next() * 17.0) as u16;
            let n_rows = (random.next() * 17.0) as usize;
            let mut ours = [[[0.0, 0.0, 0.0, 1.0_f32]; ROW_LEN]; ROW_LEN];
            let mut expected = ours;
            for _ in 0..30 {
                let splat = random.splat();
                let work = blend_rows(&splat, &CONSTANTS, &mut ours[..n_rows], width);
                let one_by_one = blend_rows_one_by_one(&splat, &CONSTANTS, &mut expected[..n_rows], width);
                assert_eq!(work, one_by_one, "{splat:?}, {width} wide, {n_rows} rows");
                // The sign and digits of what is no number are the processor's affair.
                let bits = |x: f32| if x.is_nan() { u32::MAX } else { x.to_bits() };
                let same =
                    ours.as_flattened().iter().zip(expected.as_flattened()).all(|(a, b)| a.map(bits) == b.map(bits));
                assert!(same, "{splat:?}, {width} wide, {n_rows} rows");
                (n_pixels, n_finished) = (n_pixels + work.pixels, n_finished + work.finished);
            }
        }
        assert!(n_pixels > 100_000 && n_finished > 1000, "{n_pixels} pixels, {n_finished} finished");
    }
}
