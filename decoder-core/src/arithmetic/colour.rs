//! Depth of the colours that leave the decoder.

/// How a finished pixel is rounded.
pub(crate) trait Colours {
    /// The bytes of a colour in 255ths at column `x` and row `y` of its tile.
    fn bytes(colour: [f32; 3], x: usize, y: usize) -> [u8; 3];
}

/// Eight bits a channel.
#[derive(Clone, Copy, Debug)]
pub struct Rgb888;
/// The 5, 6 and 5 bits of most small displays, widened to bytes again: a display driver's conversion loses nothing more.
#[derive(Clone, Copy, Debug)]
pub struct Rgb565;
/// As [`Rgb565`], with a 4×4 ordered dither (Bayer 1973) in place of rounding, which turns bands into a fine pattern.
#[derive(Clone, Copy, Debug)]
pub struct Rgb565Dithered;

/// Bayer's matrix in sixteenths of a step.
const BAYER: [[u8; 4]; 4] = [[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]];

impl Colours for Rgb888 {
    #[inline(always)]
    fn bytes([red, green, blue]: [f32; 3], _: usize, _: usize) -> [u8; 3] {
        // A float cast saturates: negative becomes 0, and so does NaN; 255.5 and more become 255.
        [(red + 0.5) as u8, (green + 0.5) as u8, (blue + 0.5) as u8]
    }
}

impl Colours for Rgb565 {
    #[inline(always)]
    fn bytes(colour: [f32; 3], _: usize, _: usize) -> [u8; 3] {
        five_six_five(colour, 0.5)
    }
}

impl Colours for Rgb565Dithered {
    #[inline(always)]
    fn bytes(colour: [f32; 3], x: usize, y: usize) -> [u8; 3] {
        let [row, column] = [y & 3, x & 3];
        let sixteenths = BAYER.get(row).and_then(|row| row.get(column)).copied().unwrap_or_default();
        five_six_five(colour, (f32::from(sixteenths) + 0.5) / 16.0)
    }
}

/// Steps of 5, 6 and 5 bits, a part `up` of each rounded up, as the bytes that they stand for.
#[inline(always)]
fn five_six_five([red, green, blue]: [f32; 3], up: f32) -> [u8; 3] {
    let byte = |c: f32, bits: u32| {
        let most = (1_u32 << bits) - 1;
        let steps = (c * (most as f32 / 255.0) + up) as u32;
        let steps = if steps < most { steps } else { most };
        // The upper bits again below them, as displays do: 0 and 255 stay what they are.
        (steps << (8 - bits) | steps >> (2 * bits - 8)) as u8
    };
    [byte(red, 5), byte(green, 6), byte(blue, 5)]
}

#[cfg(test)]
mod tests {
    use super::{Colours, Rgb565, Rgb565Dithered, Rgb888};

    #[test]
    fn ends_stay_and_steps_are_at_most_half_a_step_away() {
        for i in 0..=2550 {
            let c = i as f32 / 10.0;
            let [red, green, blue] = Rgb565::bytes([c; 3], 0, 0).map(f32::from);
            assert!((red - c).abs() < 4.9 && red == blue && (green - c).abs() < 2.9, "{c}: {red} {green}");
        }
        for (c, byte) in [(-3.0, 0), (f32::NAN, 0), (255.0, 255), (900.0, 255)] {
            assert_eq!(Rgb888::bytes([c; 3], 0, 0), [byte; 3], "{c}");
            assert_eq!(Rgb565::bytes([c; 3], 0, 0), [byte; 3], "{c}");
            assert_eq!(Rgb565Dithered::bytes([c; 3], 3, 0), [byte; 3], "{c}");
        }
    }

    #[test]
    fn dither_keeps_the_mean() {
        for i in 0..100 {
            let c = i as f32 * 2.53;
            let mut sums = [0.0; 3];
            for (x, y) in (0..4).flat_map(|y| (0..4).map(move |x| (x, y))) {
                for (sum, byte) in sums.iter_mut().zip(Rgb565Dithered::bytes([c; 3], x, y)) {
                    *sum += f32::from(byte) / 16.0;
                }
            }
            assert!(sums.into_iter().all(|mean| (mean - c).abs() < 0.8), "{c}: {sums:?}");
        }
    }
}
