//! A tile sink for every display that `embedded-graphics` can draw on.

use embedded_graphics_core::draw_target::DrawTarget;
use embedded_graphics_core::geometry::{Point, Size};
use embedded_graphics_core::pixelcolor::Rgb888;
use embedded_graphics_core::primitives::Rectangle;

use crate::decoder::TileSink;

/// Draws tiles on a display with the frame's first pixel at `origin`.
///
/// Each tile is one `fill_contiguous`, so a display driver sets its window once for 256 pixels.
#[derive(Debug)]
pub struct DisplaySink<'d, D: DrawTarget> {
    display: &'d mut D,
    origin: Point,
    result: Result<(), D::Error>,
}

impl<'d, D: DrawTarget> DisplaySink<'d, D> {
    /// Draws on `display` from `origin` on.
    pub fn new(display: &'d mut D, origin: Point) -> Self {
        Self { display, origin, result: Ok(()) }
    }

    /// Ends the frame.
    ///
    /// # Errors
    /// The first error of the display; nothing was drawn after it.
    pub fn finish(self) -> Result<(), D::Error> {
        self.result
    }
}

impl<D> TileSink for DisplaySink<'_, D>
where
    D: DrawTarget,
    D::Color: From<Rgb888>,
{
    fn tile(&mut self, x_px: u16, y_px: u16, width: u16, height: u16, rgb: &[[u8; 3]]) {
        if self.result.is_err() {
            return;
        }
        let corner = self.origin + Point::new(x_px.into(), y_px.into());
        let area = Rectangle::new(corner, Size::new(width.into(), height.into()));
        let colours = rgb.iter().map(|&[r, g, b]| D::Color::from(Rgb888::new(r, g, b)));
        self.result = self.display.fill_contiguous(&area, colours);
    }
}
