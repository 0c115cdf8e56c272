//! A frame that comes tile by tile, or row of tiles by row of tiles, each when it is asked for.

use core::ptr;
use core::slice;
use core::task::Poll;

use pocketsplat_core::{ByteOrder, Drawing, PixelFormat, Rounding};

use crate::camera::Camera;
use crate::decoder::{Begun, Decoder, Report};
use crate::status::{Failure, Message, Status, status_of};

/// What the bytes of a pixel are.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Three bytes: red, green, blue.
    Rgb888 = 0,
    /// Two bytes, the one with red first: five bits of red, six of green, five of blue, each the nearest. What displays on SPI take.
    Rgb565BigEndian = 1,
    /// The same, the byte with blue first. What LCD controllers read from memory.
    Rgb565LittleEndian = 2,
    /// As PSB_FORMAT_RGB565_BIG_ENDIAN, by a 4×4 ordered pattern (Bayer 1973), which turns bands into a fine pattern.
    Rgb565BigEndianDithered = 3,
    /// As PSB_FORMAT_RGB565_LITTLE_ENDIAN, by the same pattern.
    Rgb565LittleEndianDithered = 4,
}

/// What a call of psb_advance came to.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Nothing to show yet.
    Working = 0,
    /// The next tile.
    Tile = 1,
    /// The frame is complete.
    Complete = 2,
}

/// A finished part of a frame: a tile, or a row of tiles.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Pixels {
    /// Row by row, width × height pixels; NULL when the frame is complete.
    pub bytes: *const u8,
    /// Bytes of them.
    pub len: usize,
    /// First column, pixels.
    pub x_px: u16,
    /// First row, pixels.
    pub y_px: u16,
    /// Width, pixels.
    pub width: u16,
    /// Height, pixels.
    pub height: u16,
}

impl Pixels {
    const NONE: Self = Self { bytes: ptr::null(), len: 0, x_px: 0, y_px: 0, width: 0, height: 0 };

    fn new([x_px, y_px, width, height]: [u16; 4], bytes: &[u8]) -> Self {
        Self { bytes: bytes.as_ptr(), len: bytes.len(), x_px, y_px, width, height }
    }
}

fn to_core(format: u32) -> Result<PixelFormat, Failure> {
    Ok(match format {
        0 => PixelFormat::Rgb888,
        1 => PixelFormat::Rgb565(ByteOrder::BigEndian, Rounding::Nearest),
        2 => PixelFormat::Rgb565(ByteOrder::LittleEndian, Rounding::Nearest),
        3 => PixelFormat::Rgb565(ByteOrder::BigEndian, Rounding::Dithered),
        4 => PixelFormat::Rgb565(ByteOrder::LittleEndian, Rounding::Dithered),
        _ => return Err(Failure::Number("format needs to be a PSB_FORMAT, 0 to 4", format as usize)),
    })
}

/// Begins a frame whose pixels come when they are asked for, by psb_next_tile or psb_next_tile_row: the same as psb_render's.
///
/// format: a psb_format. message: NULL, or where to say what was wrong. A frame that was begun before, and is not complete, ends here without
/// harm; psb_render ends it too.
///
/// # Safety
/// Pointers are NULL or point to what the call says; the decoder is bound.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psb_begin(
    decoder: *mut Decoder,
    camera: *const Camera,
    format: u32,
    message: *mut Message,
) -> Status {
    // SAFETY: the caller's promise.
    let (camera, message) = unsafe { (camera.as_ref(), message.as_mut()) };
    let outcome = (|| {
        // SAFETY: NULL or a bound decoder, the caller's promise.
        let bound = unsafe { Decoder::bound(decoder) }?;
        let camera = camera.ok_or(Failure::Misuse("camera is NULL"))?.to_core()?;
        let format = to_core(format)?;
        let begun = Begun { drawing: bound.begin(&camera)?, format };
        // SAFETY: not NULL, since it has a bound decoder.
        unsafe { Decoder::keep(decoder, begun) };
        Ok(())
    })();
    status_of(outcome, message)
}

/// Draws the next tile of the frame that was begun: 16 by 16 pixels, less at the right and at the bottom; in rows from the top, each from the left.
///
/// tile: gets the tile; its bytes are NULL when the frame is complete. They lie in scratch memory and stay until the next call with this decoder.
/// report: NULL, or where to say, when the frame is complete, what it consisted of. message: NULL, or where to say what was wrong;
/// PSB_STATUS_MISUSE when no frame is begun.
///
/// # Safety
/// Pointers are NULL or point to what the call says; the decoder is bound.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psb_next_tile(
    decoder: *mut Decoder,
    tile: *mut Pixels,
    report: *mut Report,
    message: *mut Message,
) -> Status {
    // SAFETY: the caller's promise.
    let (tile, report, message) = unsafe { (tile.as_mut(), report.as_mut(), message.as_mut()) };
    let outcome = (|| {
        let out = tile.ok_or(Failure::Misuse("tile is NULL"))?;
        *out = Pixels::NONE;
        // SAFETY: NULL or a bound decoder, the caller's promise.
        let Begun { drawing, format } = unsafe { Decoder::begun(decoder) }?;
        match drawing.next_tile()? {
            Some(tile) => {
                let place = [tile.x_px, tile.y_px, tile.width, tile.height];
                *out = Pixels::new(place, tile.into_bytes(*format));
            }
            None => say_report(drawing, report),
        }
        Ok(())
    })();
    status_of(outcome, message)
}

/// Does a small part of the frame that was begun: a few anchors, a part of the sort of a strip, or a few splats of a tile. Between two calls the processor
/// is free, for a watchdog, USB or another task; psb_next_tile does as many at once as a tile takes.
///
/// progress: gets a psb_progress, PSB_PROGRESS_WORKING with every error. tile: gets the tile, as psb_next_tile gives it; NULL there unless progress is PSB_PROGRESS_TILE.
/// report: NULL, or where to say, when the frame is complete, what it consisted of. message: NULL, or where to say what was wrong;
/// PSB_STATUS_MISUSE when no frame is begun.
///
/// # Safety
/// Pointers are NULL or point to what the call says; the decoder is bound.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psb_advance(
    decoder: *mut Decoder,
    progress: *mut u8,
    tile: *mut Pixels,
    report: *mut Report,
    message: *mut Message,
) -> Status {
    // SAFETY: the caller's promise.
    let (progress, tile) = unsafe { (progress.as_mut(), tile.as_mut()) };
    // SAFETY: the same.
    let (report, message) = unsafe { (report.as_mut(), message.as_mut()) };
    let outcome = (|| {
        let out = tile.ok_or(Failure::Misuse("tile is NULL"))?;
        *out = Pixels::NONE;
        let progress = progress.ok_or(Failure::Misuse("progress is NULL"))?;
        *progress = Progress::Working as u8;
        // SAFETY: NULL or a bound decoder, the caller's promise.
        let Begun { drawing, format } = unsafe { Decoder::begun(decoder) }?;
        let found = match drawing.advance()? {
            Poll::Pending => Progress::Working,
            Poll::Ready(Some(tile)) => {
                let place = [tile.x_px, tile.y_px, tile.width, tile.height];
                *out = Pixels::new(place, tile.into_bytes(*format));
                Progress::Tile
            }
            Poll::Ready(None) => {
                say_report(drawing, report);
                Progress::Complete
            }
        };
        *progress = found as u8;
        Ok(())
    })();
    status_of(outcome, message)
}

/// Draws the next row of tiles into memory of the caller, so that one transfer sends 16 whole lines of the frame, fewer at the bottom. After
/// single tiles of a row it draws the rest of the row.
///
/// bytes: len bytes; 16 × width of the frame × bytes of a pixel serve every row. Too few are PSB_STATUS_MISUSE and the message names those needed;
/// the row can be asked for again. row: gets the row, in bytes; NULL there when the frame is complete. report: NULL, or where to say, when the
/// frame is complete, what it consisted of. message: NULL, or where to say what was wrong; PSB_STATUS_MISUSE when no frame is begun.
///
/// With two such pieces of memory the bus sends one while the next call fills the other.
///
/// # Safety
/// Pointers are NULL or point to what the call says; the decoder is bound, and bytes lie apart from its memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn psb_next_tile_row(
    decoder: *mut Decoder,
    bytes: *mut u8,
    len: usize,
    row: *mut Pixels,
    report: *mut Report,
    message: *mut Message,
) -> Status {
    // SAFETY: the caller's promise.
    let (row, report, message) = unsafe { (row.as_mut(), report.as_mut(), message.as_mut()) };
    let outcome = (|| {
        let out = row.ok_or(Failure::Misuse("row is NULL"))?;
        *out = Pixels::NONE;
        if bytes.is_null() {
            return Err(Failure::Misuse("bytes is NULL"));
        }
        // SAFETY: not NULL; the rest is the caller's promise.
        let bytes = unsafe { slice::from_raw_parts_mut(bytes, len) };
        // SAFETY: NULL or a bound decoder, the caller's promise.
        let Begun { drawing, format } = unsafe { Decoder::begun(decoder) }?;
        match drawing.next_tile_row(*format, bytes)? {
            Some(row) => *out = Pixels::new([row.x_px, row.y_px, row.width, row.height], row.bytes),
            None => say_report(drawing, report),
        }
        Ok(())
    })();
    status_of(outcome, message)
}

fn say_report(drawing: &Drawing<'_, '_, '_>, report: Option<&mut Report>) {
    if let Some(report) = report {
        *report = drawing.report().into();
    }
}
