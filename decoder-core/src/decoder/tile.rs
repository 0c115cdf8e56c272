//! A finished tile, and who takes it.

use pocketsplat_format::rules::TILE_PX;

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

    /// A quarter of a tile of at most 16×16 pixels, each pixel as four: while a scene moves, a frame of half the width and height fills a display
    /// so.
    ///
    /// * `quarter`: from 0 to 3, those above before those below. * `rgb`: memory for 256 pixels.
    ///
    /// `None` where the tile, at the frame's right or lower edge, ends before that quarter, for a quarter above 3, and where `rgb` is too short.
    ///
    /// ```
    /// # fn main() -> Result<(), pocketsplat_core::DecodeError> {
    /// # let bytes = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/example.psb"));
    /// # let mut scratch = [0; 8 * 1024];
    /// use pocketsplat_core::{Budget, Bundle, Decoder, Plan};
    ///
    /// let bundle = Bundle::parse(bytes)?;
    /// let plan = Plan::new(&bundle, &Budget::for_frame(32, 24))?;
    /// let mut decoder = Decoder::bind(&bundle, plan, &mut scratch)?;
    /// let mut drawing = decoder.begin(&bundle.header().preview.resized(16, 12))?;
    /// let (mut n_pixels, mut rgb) = (0, [[0; 3]; 256]);
    /// while let Some(tile) = drawing.next_tile()? {
    ///     for quarter in 0..4 {
    ///         if let Some(tile) = tile.doubled(quarter, &mut rgb) {
    ///             n_pixels += tile.rgb.len(); // or: display.send(tile.x_px, tile.y_px, tile.rgb)
    ///         }
    ///     }
    /// }
    /// assert_eq!(n_pixels, 32 * 24);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Budget
    /// One pass over the pixels.
    #[inline(never)]
    #[must_use]
    pub fn doubled<'q>(&self, quarter: u8, rgb: &'q mut [[u8; 3]]) -> Option<Tile<'q>> {
        const HALF: u16 = TILE_PX / 2;
        if quarter > 3 {
            return None;
        }
        let (left, top) = (u16::from(quarter & 1) * HALF, u16::from(quarter >> 1) * HALF);
        let [width, height] = [self.width.checked_sub(left)?, self.height.checked_sub(top)?].map(|size| size.min(HALF));
        let rgb = rgb.get_mut(..4 * usize::from(width) * usize::from(height)).filter(|rgb| !rgb.is_empty())?;
        let rows = self.rgb.chunks_exact(usize::from(self.width)).skip(top.into());
        let pairs = rgb.chunks_exact_mut(4 * usize::from(width));
        for (row, pair) in rows.zip(pairs) {
            let (above, below) = pair.split_at_mut(2 * usize::from(width));
            for (pixel, double) in row.iter().skip(left.into()).zip(above.chunks_exact_mut(2)) {
                double.fill(*pixel);
            }
            below.copy_from_slice(above);
        }
        let twice = |at: u16, within: u16| at.checked_add(within)?.checked_mul(2);
        let (x_px, y_px) = (twice(self.x_px, left)?, twice(self.y_px, top)?);
        Some(Tile { x_px, y_px, width: 2 * width, height: 2 * height, rgb })
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

    /// Of tiles of all sizes, each pixel is where half its place is, once.
    #[test]
    fn quarters_fill_a_tile_twice_as_large() {
        for (width, height) in [(16, 16), (8, 8), (9, 7), (16, 1), (1, 16), (3, 12)] {
            let size = usize::from(width) * usize::from(height);
            let mut pixels: std::vec::Vec<[u8; 3]> = (0..size).map(|i| [i as u8, (i / 7) as u8, 9]).collect();
            let source = pixels.clone();
            let tile = Tile::new([32, 48], [width, height], &mut pixels).expect("its pixels");
            let mut found = std::vec![None; 4 * size];
            for quarter in 0..4 {
                let mut rgb = [[0; 3]; 256];
                let Some(part) = tile.doubled(quarter, &mut rgb) else { continue };
                assert_eq!(part.rgb.len(), usize::from(part.width) * usize::from(part.height));
                for (i, &rgb) in part.rgb.iter().enumerate() {
                    let x = usize::from(part.x_px - 64) + i % usize::from(part.width);
                    let y = usize::from(part.y_px - 96) + i / usize::from(part.width);
                    assert_eq!(found[y * 2 * usize::from(width) + x].replace(rgb), None, "{width}x{height}: twice");
                }
            }
            for (i, rgb) in found.into_iter().enumerate() {
                let (x, y) = (i % (2 * usize::from(width)), i / (2 * usize::from(width)));
                assert_eq!(rgb, Some(source[y / 2 * usize::from(width) + x / 2]), "{width}x{height} at {x}, {y}");
            }
        }
        let mut pixels = [[0; 3]; 64];
        let tile = Tile::new([0, 0], [8, 8], &mut pixels).expect("its pixels");
        assert!(tile.doubled(0, &mut [[0; 3]; 255]).is_none() && tile.doubled(1, &mut [[0; 3]; 256]).is_none());
        let mut high = [[0; 3]; 40];
        let tile = Tile::new([0, 0], [1, 40], &mut high).expect("its pixels");
        assert!(tile.doubled(4, &mut [[0; 3]; 256]).is_none(), "no such quarter");
        let far = Tile::new([u16::MAX, 0], [8, 8], &mut pixels).expect("its pixels");
        assert!(far.doubled(0, &mut [[0; 3]; 256]).is_none(), "beyond all frames");
    }
}
