//! Everything a firmware calls, linked without an allocator.
//!
//! It is never run. That it links proves that nothing in the decoder's graph wants an allocator; which panics it reaches
//! is read from its symbols.
#![no_std]
#![no_main]

use core::convert::Infallible;
use core::hint::black_box;
use core::panic::PanicInfo;

use pocketsplat_core::{
    Budget, Bundle, Camera, DecodeError, Decoder, FrameReport, MaxSplats, Plan, RenderError, Residency, Rotation,
    ScratchShape, Strips,
};
use pocketsplat_format::bundle::AnchorSite;

/// The linker's entry point; `black_box` hides every argument, so no branch of the decoder is known to be dead.
#[expect(unsafe_code, reason = "the linker looks for this very name")]
#[unsafe(no_mangle)]
extern "C" fn _start() -> ! {
    let mut scratch = [0; 4096];
    let mut words = [0; 64];
    let camera = Camera {
        rotation: Rotation::new_unchecked([0.0; 9]),
        translation: [0.0; 3],
        focal_px: [0.0; 2],
        principal_px: [0.0; 2],
        width_px: 0,
        height_px: 0,
    };
    loop {
        let _ = black_box(draw(black_box(&[]), black_box(&camera), black_box(&mut scratch)));
        let _ = black_box(decode(black_box(&[]), black_box(&mut words), black_box(&mut [0.0])));
    }
}

/// Parse, plan, bind, draw.
fn draw(bytes: &[u8], camera: &Camera, scratch: &mut [u8]) -> Result<FrameReport, RenderError<Infallible>> {
    let bundle = Bundle::parse(bytes)?;
    let [max_splats, residency, strips] = black_box([0_u8; 3]);
    let mut budget = Budget::for_frame(camera.width_px, camera.height_px)
        .in_bytes(black_box(ScratchShape::most(black_box(16), 4).scratch_len()))
        .with_tiers(black_box(u8::MAX))
        .with_max_splats(match max_splats {
            0 => MaxSplats::Measured,
            1 => MaxSplats::Worst,
            n => MaxSplats::AtMost(n.into()),
        })
        .with_residency(match residency {
            0 => Residency::Auto,
            1 => Residency::Resident,
            2 => Residency::Baked,
            3 => Residency::AutoWithSums,
            _ => Residency::Streamed,
        })
        .with_strips(if strips == 0 { Strips::Auto } else { Strips::Exactly(strips) });
    budget.skips_damage = black_box(false);
    let plan = Plan::new(&bundle, &budget)?;
    black_box((plan.work(), plan.pruning_rate(), plan.n_strips(), plan.is_resident(), plan.is_baked()));
    let mut decoder = Decoder::bind(&bundle, plan, scratch)?;
    let camera = camera.resized(black_box(1), black_box(1));
    #[cfg(feature = "orbit")]
    let camera = camera.orbited(black_box(1.0));
    #[cfg(feature = "drawing")]
    if black_box(true) {
        return drawing::draw(&mut decoder, &camera);
    }
    display::draw(&mut decoder, &camera)
}

/// A chunk by itself.
fn decode(bytes: &[u8], words: &mut [u32], values: &mut [f32]) -> Result<(), DecodeError> {
    let bundle = Bundle::parse(bytes)?;
    let mut models = bundle.anchor_models(words)?;
    bundle.chunk(black_box(0))?.decode_values(&mut models, &mut [AnchorSite::default()], values)
}

#[cfg(feature = "drawing")]
mod drawing {
    use super::*;
    use pocketsplat_core::{ByteOrder, PixelFormat, Rounding};

    /// Tile by tile, or row of tiles by row of tiles.
    pub(super) fn draw(decoder: &mut Decoder<'_, '_>, camera: &Camera) -> Result<FrameReport, RenderError<Infallible>> {
        let mut drawing = decoder.begin(camera)?;
        if black_box(true) {
            while let Some(tile) = drawing.next_tile()? {
                black_box(tile.into_rgb565(ByteOrder::BigEndian, Rounding::Nearest));
            }
        }
        let mut buffer = [0; 64];
        let format = if black_box(true) {
            PixelFormat::Rgb888
        } else {
            PixelFormat::Rgb565(ByteOrder::LittleEndian, Rounding::Dithered)
        };
        while let Some(row) = drawing.next_tile_row(black_box(format), black_box(&mut buffer))? {
            black_box(row);
        }
        Ok(drawing.report())
    }
}

#[cfg(not(feature = "embedded-graphics"))]
mod display {
    use super::*;
    use pocketsplat_core::{Tile, TileSink};

    /// A display that keeps nothing.
    struct Display;

    impl TileSink for Display {
        type Error = Infallible;

        fn tile(&mut self, Tile { x_px, y_px, width, height, rgb, .. }: Tile<'_>) -> Result<(), Infallible> {
            black_box((x_px, y_px, width, height, rgb));
            Ok(())
        }
    }

    pub(super) fn draw(decoder: &mut Decoder<'_, '_>, camera: &Camera) -> Result<FrameReport, RenderError<Infallible>> {
        decoder.render(camera, &mut Display)
    }
}

#[cfg(feature = "embedded-graphics")]
mod display {
    use super::*;
    use embedded_graphics_core::Pixel;
    use embedded_graphics_core::draw_target::DrawTarget;
    use embedded_graphics_core::geometry::{Dimensions, Point, Size};
    use embedded_graphics_core::pixelcolor::Rgb888;
    use embedded_graphics_core::primitives::Rectangle;
    use pocketsplat_core::DisplaySink;

    /// A display that keeps nothing.
    struct Display;

    impl Dimensions for Display {
        fn bounding_box(&self) -> Rectangle {
            Rectangle::new(Point::zero(), Size::new(1, 1))
        }
    }

    impl DrawTarget for Display {
        type Color = Rgb888;
        type Error = core::convert::Infallible;

        fn draw_iter<I: IntoIterator<Item = Pixel<Rgb888>>>(&mut self, pixels: I) -> Result<(), Self::Error> {
            pixels.into_iter().for_each(|pixel| _ = black_box(pixel));
            Ok(())
        }
    }

    pub(super) fn draw(decoder: &mut Decoder<'_, '_>, camera: &Camera) -> Result<FrameReport, RenderError<Infallible>> {
        let mut display = Display;
        decoder.render(camera, &mut DisplaySink::new(&mut display, Point::zero()))
    }
}

/// Not inlined and not empty, so that every panic keeps its name in the symbols.
#[panic_handler]
#[inline(never)]
fn panic(info: &PanicInfo<'_>) -> ! {
    loop {
        black_box(info);
    }
}
