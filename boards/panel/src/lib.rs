//! Sends the tiles of a frame to a display that `mipidsi` drives: its window, then 16 bits a pixel.
#![no_std]

use embedded_graphics_core::draw_target::DrawTarget as _;
use embedded_graphics_core::geometry::OriginDimensions as _;
use embedded_graphics_core::pixelcolor::raw::RawU16;
use embedded_graphics_core::pixelcolor::{Rgb565, RgbColor as _};
use embedded_hal::digital::OutputPin;
use mipidsi::Display;
use mipidsi::interface::{Interface, InterfacePixelFormat};
use mipidsi::models::Model;
use pocketsplat_core::{Arithmetic, ByteOrder, Camera, DecodeError, Decoder, FrameReport, RenderError, Rounding, Tile};

/// The camera with the largest frame of its proportions that a panel of `width_px × height_px` shows.
#[must_use]
pub fn fitted(camera: &Camera, width_px: u16, height_px: u16) -> Camera {
    let [w, h, most_w, most_h] = [camera.width_px, camera.height_px, width_px, height_px].map(u32::from);
    // Both quotients are at most a side of the panel, so they fit 16 bits.
    let (w, h) = if w * most_h >= h * most_w { (most_w, h * most_w / w) } else { (w * most_h / h, most_h) };
    camera.resized(w.max(1) as u16, h.max(1) as u16)
}

/// Makes the display black: its memory holds anything after a reset.
///
/// # Errors
/// The bus of the display.
pub fn blank<I, M, R>(display: &mut Display<I, M, R>) -> Result<(), I::Error>
where
    I: Interface,
    M: Model<ColorFormat = Rgb565>,
    Rgb565: InterfacePixelFormat<I::Word>,
    R: OutputPin,
{
    display.clear(Rgb565::BLACK)
}

/// Draws what the camera sees in the middle of the display, one tile of at most 16 × 16 pixels after the other; no memory holds the frame.
///
/// # Errors
/// [`RenderError::Decode`] as [`Decoder::begin`] has it; [`RenderError::Sink`] is the bus of the display.
pub fn draw<A, I, M, R>(
    decoder: &mut Decoder<'_, '_, A>,
    camera: &Camera,
    display: &mut Display<I, M, R>,
) -> Result<FrameReport, RenderError<I::Error>>
where
    A: Arithmetic,
    I: Interface,
    M: Model<ColorFormat = Rgb565>,
    Rgb565: InterfacePixelFormat<I::Word>,
    R: OutputPin,
{
    let mut drawing = decoder.begin(camera)?;
    while let Some(tile) = drawing.next_tile()? {
        send(display, camera, tile).map_err(RenderError::Sink)?;
    }
    Ok(drawing.report())
}

/// Draws what the camera sees to nowhere: what drawing takes without a display.
///
/// # Errors
/// As [`Decoder::begin`] has it.
pub fn draw_unseen<A: Arithmetic>(
    decoder: &mut Decoder<'_, '_, A>,
    camera: &Camera,
) -> Result<FrameReport, DecodeError> {
    let mut drawing = decoder.begin(camera)?;
    while drawing.next_tile()?.is_some() {}
    Ok(drawing.report())
}

/// Sends a tile of what the camera sees to where it belongs in the middle of the display.
///
/// # Errors
/// The bus of the display.
pub fn send<I, M, R>(display: &mut Display<I, M, R>, camera: &Camera, tile: Tile<'_>) -> Result<(), I::Error>
where
    I: Interface,
    M: Model<ColorFormat = Rgb565>,
    Rgb565: InterfacePixelFormat<I::Word>,
    R: OutputPin,
{
    let size = display.size();
    // No panel has a side of 65,536 pixels.
    let [left, top] = [(size.width, camera.width_px), (size.height, camera.height_px)]
        .map(|(panel, frame)| panel.saturating_sub(frame.into()) as u16 / 2);
    let (x, y) = (left + tile.x_px, top + tile.y_px);
    let (last_x, last_y) = (x + (tile.width - 1), y + (tile.height - 1));
    // Dithered, because a gradient in 32 steps shows bands.
    let bytes = tile.into_rgb565(ByteOrder::BigEndian, Rounding::Dithered);
    let pixels = bytes.as_chunks().0.iter().map(|&pixel| Rgb565::from(RawU16::new(u16::from_be_bytes(pixel))));
    display.set_pixels(x, y, last_x, last_y, pixels)
}
