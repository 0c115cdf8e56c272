//! The display: a draw target whose pixels lie in its own memory, as those of an SPI display do.
#![expect(unsafe_code, reason = "the linker puts the display's memory outside the device's RAM")]

use core::ffi::CStr;

use embedded_graphics::framebuffer::{Framebuffer, buffer_size};
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::pixelcolor::raw::{BigEndian, RawU24};
use semihosting::{fs, io, io::Write as _};
use static_cell::ConstStaticCell;

use crate::{HEIGHT_PX, WIDTH_PX};

/// Red, green, blue: in this order big-endian pixels are the bytes of a PPM file.
pub(crate) type Panel =
    Framebuffer<Rgb888, RawU24, BigEndian, WIDTH_PX, HEIGHT_PX, { buffer_size::<Rgb888>(WIDTH_PX, HEIGHT_PX) }>;

/// Not RAM of the device: memory that on a board is beyond the display's bus.
#[unsafe(link_section = ".panel")]
pub(crate) static PANEL: ConstStaticCell<Panel> = ConstStaticCell::new(Panel::new());

/// Writes what the panel shows to `frame0.ppm` and so on, in the folder in which QEMU runs.
///
/// * `frame`: 0 to 9.
pub(crate) fn write_ppm(panel: &Panel, frame: u8) -> io::Result<()> {
    let name = [b'f', b'r', b'a', b'm', b'e', b'0' + frame, b'.', b'p', b'p', b'm', 0];
    let mut file = fs::File::create(CStr::from_bytes_until_nul(&name).unwrap_or_default())?;
    write!(file, "P6\n{WIDTH_PX} {HEIGHT_PX}\n255\n")?;
    file.write_all(panel.data())
}
