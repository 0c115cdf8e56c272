//! A tile sink for every display that `embedded-graphics` can draw on.
//!
//! ```
//! # use embedded_graphics_core::geometry::{Point, Size};
//! # use embedded_graphics_core::pixelcolor::Rgb565;
//! # let bytes = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/example.psb"));
//! # let mut scratch = [0; 8 * 1024];
//! # let mut display = embedded_graphics_simulator::SimulatorDisplay::<Rgb565>::new(Size::new(32, 24));
//! use pocketsplat_core::{Budget, Bundle, Decoder, DisplaySink, Plan, RenderError};
//!
//! let bundle = Bundle::parse(bytes)?;
//! let plan = Plan::new(&bundle, &Budget::for_frame(32, 24).in_bytes(scratch.len()))?;
//! let mut decoder = Decoder::bind(&bundle, plan, &mut scratch)?;
//! match decoder.render(&bundle.header().preview, &mut DisplaySink::new(&mut display, Point::zero())) {
//!     Ok(report) => assert_eq!((report.splats, display.get_pixel(Point::new(31, 23))), (5, Rgb565::new(0, 0, 8))),
//!     Err(RenderError::Decode(error)) => return Err(error), // the camera or the bundle
//!     Err(RenderError::Sink(error)) => panic!("the bus of the display: {error}"),
//! }
//! # Ok::<(), pocketsplat_core::DecodeError>(())
//! ```

use embedded_graphics_core::draw_target::DrawTarget;
use embedded_graphics_core::geometry::{Point, Size};
use embedded_graphics_core::pixelcolor::{Rgb888, RgbColor};
use embedded_graphics_core::primitives::Rectangle;

use crate::decoder::{Tile, TileSink};

/// Draws tiles on a display with the frame's first pixel at `origin`.
///
/// Each tile is one `fill_contiguous`, so a display driver sets its window once for 256 pixels. The first error of the display
/// ends the frame as [`RenderError::Sink`](crate::RenderError::Sink).
#[must_use = "a sink draws nothing by itself: hand it to `Decoder::render`"]
#[derive(Debug)]
pub struct DisplaySink<'d, D: DrawTarget> {
    display: &'d mut D,
    origin: Point,
    /// The display's largest red, green and blue, when it is dithered.
    dithered_to: Option<[u8; 3]>,
}

impl<'d, D: DrawTarget> DisplaySink<'d, D> {
    /// Draws on `display` from `origin` on; bytes are rounded to the display's colours as `embedded-graphics` does.
    pub fn new(display: &'d mut D, origin: Point) -> Self {
        Self { display, origin, dithered_to: None }
    }

    /// Dithers instead, with a 4×4 ordered pattern (Bayer 1973): bands of a 16-bit display turn into a fine pattern.
    ///
    /// # Budget
    /// About 20 instructions a channel.
    pub fn dithered(self) -> Self
    where
        D::Color: RgbColor,
    {
        Self { dithered_to: Some([D::Color::MAX_R, D::Color::MAX_G, D::Color::MAX_B]), ..self }
    }
}

impl<D> TileSink for DisplaySink<'_, D>
where
    D: DrawTarget,
    D::Color: From<Rgb888>,
{
    type Error = D::Error;

    // Not inlined: among what draws a tile its loop would not stay in registers.
    #[inline(never)]
    fn tile(&mut self, mut tile: Tile<'_>) -> Result<(), D::Error> {
        if let Some(most) = self.dithered_to {
            tile.dither(most);
        }
        let corner = self.origin + Point::new(tile.x_px.into(), tile.y_px.into());
        let area = Rectangle::new(corner, Size::new(tile.width.into(), tile.height.into()));
        let colours = tile.rgb.iter().map(|&[r, g, b]| D::Color::from(Rgb888::new(r, g, b)));
        self.display.fill_contiguous(&area, colours)
    }
}

#[cfg(test)]
mod tests {
    use embedded_graphics_core::pixelcolor::{IntoStorage, Rgb565, Rgb888, RgbColor};

    use crate::decoder::{ByteOrder, Rounding, Tile};

    const MOST: [u8; 3] = [Rgb565::MAX_R, Rgb565::MAX_G, Rgb565::MAX_B];

    /// A tile of one colour.
    fn plain(rgb: &mut [[u8; 3]; 16]) -> Tile<'_> {
        Tile::new([0, 0], [4, 4], rgb).expect("sixteen pixels")
    }

    fn dithered(rgb: [u8; 3], most: [u8; 3]) -> [[u8; 3]; 16] {
        let mut pixels = [rgb; 16];
        plain(&mut pixels).dither(most);
        pixels
    }

    #[test]
    fn dither_keeps_the_mean_and_the_ends() {
        for byte in 0..=255_u8 {
            let mut sums = [0.0; 3];
            for [r, g, b] in dithered([byte; 3], MOST) {
                let shown = Rgb565::from(Rgb888::new(r, g, b));
                let steps = [shown.r(), shown.g(), shown.b()];
                for ((sum, step), most) in sums.iter_mut().zip(steps).zip(MOST) {
                    *sum += 255.0 * f32::from(step) / f32::from(most) / 16.0;
                }
            }
            assert!(sums.into_iter().all(|mean| (mean - f32::from(byte)).abs() < 0.3), "{byte}: {sums:?}");
            assert!((1..255).contains(&byte) || sums == [f32::from(byte); 3], "{byte}: {sums:?}");
        }
    }

    #[test]
    fn a_packed_tile_is_what_a_display_of_16_bits_shows() {
        for byte in 0..=255_u8 {
            let rgb = [byte, byte.wrapping_add(85), byte.wrapping_add(170)];
            for rounding in [Rounding::Nearest, Rounding::Dithered] {
                let mut pixels = [rgb; 16];
                let packed = plain(&mut pixels).into_rgb565(ByteOrder::LittleEndian, rounding);
                let shown = if rounding == Rounding::Dithered { dithered(rgb, MOST) } else { [rgb; 16] };
                for (pixel, [r, g, b]) in packed.as_chunks::<2>().0.iter().zip(shown) {
                    let shown = Rgb565::from(Rgb888::new(r, g, b)).into_storage();
                    assert_eq!(u16::from_le_bytes(*pixel), shown, "{rgb:?}, {rounding:?}");
                }
            }
        }
    }

    #[test]
    fn a_display_of_all_bits_shows_every_byte() {
        for byte in 0..=255_u8 {
            assert_eq!(dithered([byte; 3], [255; 3]), [[byte; 3]; 16]);
        }
    }
}
