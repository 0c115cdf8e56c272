//! A display of memory gets the pixels that `render` draws, in the middle.

use std::convert::Infallible;

use embedded_hal::delay::DelayNs;
use mipidsi::interface::{Interface, InterfaceKind};
use mipidsi::models::ST7789;
use pocketsplat_core::{Budget, Bundle, ByteOrder, Decoder, Plan, Rounding, Tile, TileSink};

const PANEL_PX: (u16, u16) = (40, 50);

/// What an ST7789 does with windows and pixels; anything else does nothing.
struct Memory {
    /// First and last column and row of the window.
    window: [[u16; 2]; 2],
    pixels: Pixels,
}

/// `[height, width]`, two bytes each; `None` before the first.
type Pixels = [[Option<[u8; 2]>; PANEL_PX.0 as usize]; PANEL_PX.1 as usize];

impl Interface for Memory {
    type Word = u8;
    type Error = Infallible;
    const KIND: InterfaceKind = InterfaceKind::Serial4Line;

    fn send_command(&mut self, command: u8, arguments: &[u8]) -> Result<(), Infallible> {
        if let (0x2A | 0x2B, &[a, b, c, d]) = (command, arguments) {
            self.window[usize::from(command - 0x2A)] = [u16::from_be_bytes([a, b]), u16::from_be_bytes([c, d])];
        }
        Ok(())
    }

    fn send_pixels<const N: usize>(&mut self, pixels: impl IntoIterator<Item = [u8; N]>) -> Result<(), Infallible> {
        let [columns, rows] = self.window.map(|[first, last]| usize::from(first)..=usize::from(last));
        let places = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
        for (pixel, (x, y)) in pixels.into_iter().zip(places) {
            self.pixels[y][x] = Some([pixel[0], pixel[1]]);
        }
        Ok(())
    }

    fn send_repeated_pixel<const N: usize>(&mut self, pixel: [u8; N], n: u32) -> Result<(), Infallible> {
        self.send_pixels((0..n).map(|_| pixel))
    }
}

/// Waits for nothing.
struct NoDelay;

impl DelayNs for NoDelay {
    fn delay_ns(&mut self, _: u32) {}
}

/// A black panel with a frame that begins `top` rows down.
struct Expected {
    pixels: Pixels,
    top: u16,
}

impl TileSink for Expected {
    type Error = Infallible;

    fn tile(&mut self, tile: Tile<'_>) -> Result<(), Infallible> {
        let (x_px, y_px, width) = (tile.x_px, tile.y_px, tile.width);
        let pixels = tile.into_rgb565(ByteOrder::BigEndian, Rounding::Dithered).as_chunks().0;
        for (pixel, i) in pixels.iter().zip(0..) {
            let (x, y) = (x_px + i % width, self.top + y_px + i / width);
            self.pixels[usize::from(y)][usize::from(x)] = Some(*pixel);
        }
        Ok(())
    }
}

#[test]
fn a_display_shows_the_pixels_of_render_in_the_middle() {
    let bundle =
        Bundle::parse(include_bytes!("../../../decoder-format/src/bundle/example.psb")).expect("the example is sound");
    let camera = pocketsplat_panel::fitted(&bundle.header().preview, PANEL_PX.0, PANEL_PX.1);
    assert_eq!((camera.width_px, camera.height_px), (40, 30), "4 : 3 across");
    let mut scratch = [0; 16 * 1024];
    let plan = Plan::new(&bundle, &Budget::for_frame(40, 30).in_bytes(scratch.len())).expect("fits");
    let mut decoder = Decoder::bind(&bundle, plan, &mut scratch).expect("bound");

    let mut expected = Expected { pixels: [[Some([0, 0]); 40]; 50], top: 10 };
    decoder.render(&camera, &mut expected).expect("drawn");
    let mut memory = Memory { window: [[0; 2]; 2], pixels: [[None; 40]; 50] };
    let mut display = mipidsi::Builder::new(ST7789, &mut memory)
        .display_size(PANEL_PX.0, PANEL_PX.1)
        .init(&mut NoDelay)
        .unwrap_or_else(|_| panic!("a display of memory takes its set-up"));
    pocketsplat_panel::blank(&mut display).expect("memory takes everything");
    let report = pocketsplat_panel::draw(&mut decoder, &camera, &mut display).expect("drawn");
    drop(display);
    assert_eq!(report.splats, 5);
    assert!(memory.pixels == expected.pixels, "other pixels");
}

#[test]
fn a_frame_fills_the_side_of_the_panel_that_is_scarce() {
    let bundle =
        Bundle::parse(include_bytes!("../../../decoder-format/src/bundle/example.psb")).expect("the example is sound");
    let fitted = |width, height| {
        let camera = pocketsplat_panel::fitted(&bundle.header().preview, width, height);
        (camera.width_px, camera.height_px)
    };
    assert_eq!([fitted(240, 240), fitted(320, 240), fitted(320, 120)], [(240, 180), (320, 240), (160, 120)]);
}
