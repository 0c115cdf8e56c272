//! A row of tiles as a display takes it: 16 whole lines of pixels, one behind the other.

use pocketsplat_format::{DecodeError, Field, saturate};

use super::drawing::Drawing;
use super::pixel_format::PixelFormat;
use crate::arithmetic::Arithmetic;

/// A finished row of tiles.
#[derive(Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct TileRow<'p> {
    /// Its first column, pixels; 0 unless tiles of this row were asked for before.
    pub x_px: u16,
    /// Its first row, pixels.
    pub y_px: u16,
    /// Its width, pixels: from `x_px` to the end of the frame.
    pub width: u16,
    /// Its height, pixels: 16, or what is left of the frame.
    pub height: u16,
    /// `[height, width, bytes_per_pixel]`, row by row.
    pub bytes: &'p mut [u8],
}

impl<A: Arithmetic> Drawing<'_, '_, '_, A> {
    /// Draws the next row of tiles into `pixels`, so that one transfer sends whole lines of the frame: the bytes of
    /// [`next_tile`](Self::next_tile)'s pixels; `None` after the last row.
    ///
    /// With two such buffers the bus sends one while the processor fills the other. After single tiles of a row this is the rest
    /// of the row.
    ///
    /// * `pixels`: `[height, width, bytes_per_pixel]` of the row, or more; `16 · width · bytes_per_pixel` serve every row.
    ///
    /// ```
    /// # fn main() -> Result<(), pocketsplat_core::DecodeError> {
    /// # let bytes = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/example.psb"));
    /// # let mut scratch = [0; 8 * 1024];
    /// use pocketsplat_core::{Budget, Bundle, ByteOrder, Decoder, PixelFormat, Plan, Rounding};
    ///
    /// let format = PixelFormat::Rgb565(ByteOrder::BigEndian, Rounding::Dithered);
    /// let bundle = Bundle::parse(bytes)?;
    /// let plan = Plan::new(&bundle, &Budget::for_frame(32, 24))?;
    /// let mut decoder = Decoder::bind(&bundle, plan, &mut scratch)?;
    /// let mut drawing = decoder.begin(&bundle.header().preview)?;
    /// let mut buffers = [[0; 16 * 32 * 2]; 2];
    /// let mut lines = 0;
    /// while let Some(row) = drawing.next_tile_row(format, &mut buffers[0])? {
    ///     lines += row.bytes.len() / (32 * 2); // or: wait for the last transfer, then begin that of row.bytes
    ///     buffers.swap(0, 1);
    /// }
    /// assert_eq!(lines, 24);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`DecodeError::BufferTooShort`] names the bytes of `pixels` and those needed, and nothing is drawn: the row can be asked for
    /// again. Others as for [`next_tile`](Self::next_tile).
    ///
    /// # Budget
    /// As [`next_tile`](Self::next_tile) for each tile of the row, and one copy of its pixels.
    pub fn next_tile_row<'p>(
        &mut self,
        format: PixelFormat,
        pixels: &'p mut [u8],
    ) -> Result<Option<TileRow<'p>>, DecodeError> {
        let Some([x_px, y_px, width, height]) = self.rest_of_row() else { return Ok(None) };
        let bytes_per_pixel = format.bytes_per_pixel();
        let line_len = usize::from(width) * bytes_per_pixel;
        let (needed, available) = (usize::from(height) * line_len, pixels.len());
        let Some(bytes) = pixels.get_mut(..needed) else {
            let [needed, available] = [needed, available].map(saturate);
            return Err(DecodeError::BufferTooShort { field: Field::RowBuffer, needed, available });
        };
        while let Some(tile) = self.next_tile()? {
            let is_last = tile.x_px + tile.width >= x_px + width;
            let start = usize::from(tile.x_px - x_px) * bytes_per_pixel;
            let len = usize::from(tile.width) * bytes_per_pixel;
            let packed = tile.into_bytes(format);
            for (line, from) in bytes.chunks_exact_mut(line_len.max(1)).zip(packed.chunks_exact(len.max(1))) {
                let line = line.get_mut(start..start + len).unwrap_or_default();
                // Byte by byte this would take three instructions each.
                let ((to, to_rest), (from, from_rest)) = (line.as_chunks_mut::<16>(), from.as_chunks::<16>());
                to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
                to_rest.iter_mut().zip(from_rest).for_each(|(to, from)| *to = *from);
            }
            if is_last {
                return Ok(Some(TileRow { x_px, y_px, width, height, bytes }));
            }
        }
        Err(DecodeError::Internal)
    }
}
