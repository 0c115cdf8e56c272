//! The pixels of a tile as bytes: red, green and blue, or rounded to the fewer bits of a display.

use core::cell::Cell;

use super::tile::Tile;

/// The largest steps of red, green and blue in 16 bits.
const MOST_565: [u8; 3] = [31, 63, 31];

/// What the bytes of a pixel are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum PixelFormat {
    /// Three bytes: red, green, blue.
    Rgb888,
    /// Two bytes: five bits of red, six of green, five of blue.
    Rgb565(ByteOrder, Rounding),
}

impl PixelFormat {
    /// Bytes of a pixel.
    #[must_use]
    pub const fn bytes_per_pixel(self) -> usize {
        match self {
            Self::Rgb888 => 3,
            Self::Rgb565(..) => 2,
        }
    }
}

/// Which byte of a 16-bit pixel comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ByteOrder {
    /// The one with red: what displays on SPI take.
    BigEndian,
    /// The one with blue: what LCD controllers read from memory.
    LittleEndian,
}

/// How bytes become steps of fewer bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Rounding {
    /// To the nearest step.
    Nearest,
    /// By a 4×4 ordered pattern (Bayer 1973), which turns bands into a fine pattern.
    Dithered,
}

impl<'t> Tile<'t> {
    /// The pixels in a format, row by row, in the place where they are.
    #[must_use]
    pub fn into_bytes(self, format: PixelFormat) -> &'t mut [u8] {
        match format {
            PixelFormat::Rgb888 => self.rgb.as_flattened_mut(),
            PixelFormat::Rgb565(order, rounding) => self.into_rgb565(order, rounding),
        }
    }

    /// Packs the pixels into 16 bits each, five of red, six of green, five of blue, in the place where they are; returns the bytes, two a
    /// pixel and row by row.
    ///
    /// ```
    /// use pocketsplat_core::{ByteOrder, Rounding, Tile};
    ///
    /// let mut rgb = [[255, 0, 0], [0, 130, 255]];
    /// let tile = Tile::new([0, 0], [2, 1], &mut rgb).expect("two pixels");
    /// assert_eq!(tile.into_rgb565(ByteOrder::BigEndian, Rounding::Nearest), [0xf8, 0x00, 0x04, 0x1f]);
    /// ```
    ///
    /// # Budget
    /// One pass over the pixels, and no memory.
    // Not inlined: among what draws a tile its loop would not stay in registers.
    #[inline(never)]
    #[must_use]
    pub fn into_rgb565(self, order: ByteOrder, rounding: Rounding) -> &'t mut [u8] {
        let width = usize::from(self.width).max(1);
        let bytes = self.rgb.as_flattened_mut();
        let n_pixels = bytes.len() / 3;
        let cells = Cell::from_mut(&mut *bytes).as_slice_of_cells();
        // A pixel is read before anything that is written reaches it: two bytes for three.
        let packed = cells.chunks_exact(2).zip(cells.chunks_exact(3));
        let (mut x, mut y) = (0_u16, 0_u16);
        for (to, from) in packed {
            let ([first, second], [r, g, b]) = (to, from) else { continue };
            let rgb = [r.get(), g.get(), b.get()];
            let [r, g, b] = match rounding {
                Rounding::Nearest => nearest_steps(rgb, MOST_565),
                Rounding::Dithered => dithered_steps(rgb, MOST_565, (x, y)),
            }
            .map(u16::from);
            let pixel = r << 11 | g << 5 | b;
            let [high, low] = match order {
                ByteOrder::BigEndian => pixel.to_be_bytes(),
                ByteOrder::LittleEndian => pixel.to_le_bytes(),
            };
            first.set(high);
            second.set(low);
            x += 1;
            if usize::from(x) == width {
                // Of pixels beyond the height the pattern goes on.
                (x, y) = (0, y.wrapping_add(1));
            }
        }
        bytes.get_mut(..2 * n_pixels).unwrap_or_default()
    }
}

#[cfg(feature = "embedded-graphics")]
impl Tile<'_> {
    /// Changes each pixel to the bytes next to those of the steps `0..=most` that its channels are dithered to.
    pub(crate) fn dither(&mut self, most: [u8; 3]) {
        for (y, line) in (0..).zip(self.rgb.chunks_exact_mut(usize::from(self.width).max(1))) {
            for (x, pixel) in (0..).zip(line) {
                let [r, g, b] = dithered_steps(*pixel, most, (x, y));
                let [most_r, most_g, most_b] = most;
                *pixel = [(r, most_r), (g, most_g), (b, most_b)].map(|(step, most)| {
                    let most = u32::from(most).max(1);
                    // At most 255.
                    ((u32::from(step) * 255 + most / 2) / most) as u8
                });
            }
        }
    }
}

/// The nearest of the steps `0..=most` of each channel.
fn nearest_steps([r, g, b]: [u8; 3], [most_r, most_g, most_b]: [u8; 3]) -> [u8; 3] {
    // At most `most`.
    [(r, most_r), (g, most_g), (b, most_b)].map(|(byte, most)| ((u16::from(byte) * u16::from(most) + 127) / 255) as u8)
}

/// Bayer's matrix in sixteenths of a step.
const BAYER: [[u8; 4]; 4] = [[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]];

/// The steps `0..=most` that each channel is dithered to at a pixel of a tile; tiles begin at multiples of four pixels, so the
/// pattern runs on across them.
fn dithered_steps([r, g, b]: [u8; 3], [most_r, most_g, most_b]: [u8; 3], (x, y): (u16, u16)) -> [u8; 3] {
    let row = BAYER.get(usize::from(y & 3)).copied().unwrap_or_default();
    let sixteenths = row.get(usize::from(x & 3)).copied().unwrap_or_default();
    // In 32nds, so that the mean of the thresholds is a half.
    let up = 255 * (2 * u32::from(sixteenths) + 1);
    [(r, most_r), (g, most_g), (b, most_b)].map(|(byte, most)| {
        // At most `most`.
        ((u32::from(byte) * u32::from(most) * 32 + up) / (255 * 32)) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tile of every byte in each channel, 16 pixels wide.
    fn every_byte() -> [[u8; 3]; 256] {
        core::array::from_fn(|i| [i, (i + 85) % 256, (i + 170) % 256].map(|byte| u8::try_from(byte).unwrap()))
    }

    fn packed(order: ByteOrder, rounding: Rounding) -> [[u8; 2]; 256] {
        let mut rgb = every_byte();
        let tile = Tile { x_px: 16, y_px: 0, width: 16, height: 16, rgb: &mut rgb };
        let bytes = tile.into_rgb565(order, rounding);
        assert_eq!(bytes.len(), 512);
        let mut pixels = [[0; 2]; 256];
        pixels.copy_from_slice(bytes.as_chunks().0);
        pixels
    }

    #[test]
    fn packing_in_place_gives_every_pixel_its_own_bits() {
        for (i, (found, rgb)) in
            packed(ByteOrder::BigEndian, Rounding::Nearest).into_iter().zip(every_byte()).enumerate()
        {
            let near = |byte: u8, most: f64| (f64::from(byte) * most / 255.0).round() as u16;
            let [r, g, b] = rgb;
            let expected = near(r, 31.0) << 11 | near(g, 63.0) << 5 | near(b, 31.0);
            assert_eq!(u16::from_be_bytes(found), expected, "pixel {i}");
        }
    }

    #[test]
    fn more_pixels_than_a_tile_has_do_not_panic() {
        let mut rgb = std::vec![[255, 0, 0]; 70_000];
        let tile = Tile { x_px: 0, y_px: 0, width: 1, height: 1, rgb: &mut rgb };
        let bytes = tile.into_rgb565(ByteOrder::BigEndian, Rounding::Dithered);
        assert_eq!((bytes.len(), &bytes[139_998..]), (140_000, &[0xf8, 0x00][..]));
    }

    #[test]
    fn orders_differ_in_their_bytes_alone() {
        for rounding in [Rounding::Nearest, Rounding::Dithered] {
            let [big, little] = [ByteOrder::BigEndian, ByteOrder::LittleEndian].map(|order| packed(order, rounding));
            assert!(big.into_iter().zip(little).all(|(big, [a, b])| big == [b, a]));
        }
    }

    #[test]
    fn a_dithered_pixel_is_one_of_the_two_nearest_steps() {
        for (i, (found, rgb)) in
            packed(ByteOrder::BigEndian, Rounding::Dithered).into_iter().zip(every_byte()).enumerate()
        {
            let pixel = u16::from_be_bytes(found);
            let steps = [pixel >> 11, pixel >> 5 & 63, pixel & 31];
            let exact = [31.0, 63.0, 31.0].iter().zip(rgb).map(|(most, byte)| f64::from(byte) * most / 255.0);
            assert!(
                exact.zip(steps).all(|(exact, step)| (exact - f64::from(step)).abs() < 1.0),
                "pixel {i}: {steps:?}"
            );
        }
    }
}
