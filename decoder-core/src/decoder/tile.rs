//! A finished tile, and who takes it.

/// A finished tile.
#[derive(Debug)]
#[non_exhaustive]
pub struct Tile<'t> {
    /// Its first column, pixels.
    pub x_px: u16,
    /// Its first row, pixels.
    pub y_px: u16,
    /// Its width, pixels.
    pub width: u16,
    /// Its height, pixels.
    pub height: u16,
    /// `[height, width]`, row by row.
    pub rgb: &'t mut [[u8; 3]],
}

/// Takes finished tiles, for instance to a display.
pub trait TileSink {
    /// What can go wrong with a tile; [`Infallible`](core::convert::Infallible) where nothing can.
    type Error;

    /// One tile, whose pixels are the sink's to change: it may [pack](Tile::into_rgb565) them where they are.
    ///
    /// Tiles come in rows from the top, each row from the left; together they fill the frame, none twice.
    ///
    /// # Errors
    /// The sink's own: the frame ends with it, and no more tiles come.
    fn tile(&mut self, tile: Tile<'_>) -> Result<(), Self::Error>;
}

impl<'t> Tile<'t> {
    /// A tile of pixels of one's own, such as a copy of a sink's; `None` unless there are `width · height`.
    ///
    /// * `corner_px`: its first column and row, pixels. * `size`: its width and height, pixels.
    #[must_use]
    pub fn new(corner_px: [u16; 2], size: [u16; 2], rgb: &'t mut [[u8; 3]]) -> Option<Self> {
        let ([x_px, y_px], [width, height]) = (corner_px, size);
        let n_pixels = u32::from(width) * u32::from(height);
        (u32::try_from(rgb.len()) == Ok(n_pixels)).then_some(Self { x_px, y_px, width, height, rgb })
    }
}

#[cfg(test)]
mod tests {
    use super::Tile;

    #[test]
    fn a_tile_has_the_pixels_of_its_size() {
        let made = |size, n_pixels| Tile::new([16, 32], size, &mut std::vec![[0; 3]; n_pixels]).is_some();
        assert_eq!([made([3, 2], 6), made([3, 2], 5), made([3, 2], 7), made([0, 9], 0)], [true, false, false, true]);
        assert!(!made([u16::MAX, u16::MAX], 1), "more than there are");
    }
}
