#![doc = include_str!("../README.md")]
#![no_std]
#![no_main]

mod stop;

// For its critical section, which the logger takes.
use cortex_m as _;
use cortex_m_rt::entry;
use defmt_semihosting as _;
use embedded_graphics::framebuffer::{Framebuffer, buffer_size};
use embedded_graphics::geometry::Point;
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::pixelcolor::raw::{BigEndian, RawU24};
use pocketsplat_core::display::DisplaySink;
use pocketsplat_core::{Budget, Bundle, DecodeError, Decoder, MaxSplats, Residency, Strips};
use semihosting::{fs, io::Write as _};
use static_cell::ConstStaticCell;

// WIDTH_PX, HEIGHT_PX, MAX_SPLATS and SCRATCH_LEN: build.rs plans for the bundle that it puts into flash.
include!(concat!(env!("OUT_DIR"), "/sizes.rs"));
static BUNDLE: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/bundle.psb"));

/// Red, green, blue: in this order big-endian pixels are the bytes of a PPM file.
type Frame =
    Framebuffer<Rgb888, RawU24, BigEndian, WIDTH_PX, HEIGHT_PX, { buffer_size::<Rgb888>(WIDTH_PX, HEIGHT_PX) }>;

static FRAME: ConstStaticCell<Frame> = ConstStaticCell::new(Frame::new());
static SCRATCH: ConstStaticCell<[u8; SCRATCH_LEN]> = ConstStaticCell::new([0; SCRATCH_LEN]);

/// Why there is no picture.
#[derive(defmt::Format)]
enum Failure {
    /// The bundle, or the memory for it.
    Decode(DecodeError),
    /// The preview's size in pixels and the frame buffer's.
    FrameSize { needed: [u16; 2], available: [usize; 2] },
    /// The host does not take the file.
    File,
}

impl From<DecodeError> for Failure {
    fn from(error: DecodeError) -> Self {
        Self::Decode(error)
    }
}

#[entry]
fn main() -> ! {
    match draw(FRAME.take(), SCRATCH.take()) {
        Ok(()) => stop::success(),
        Err(failure) => {
            defmt::error!("{}", failure);
            stop::failure()
        }
    }
}

/// Draws the bundle's preview into `frame` and sends that to the host.
fn draw(frame: &mut Frame, scratch: &mut [u8]) -> Result<(), Failure> {
    let bundle = Bundle::parse(BUNDLE)?;
    let header = bundle.header();
    defmt::info!("bundle: {} bytes, {} anchors of {} splats", BUNDLE.len(), header.n_anchors, header.n_offsets);

    let camera = header.preview;
    let size = [camera.width_px, camera.height_px];
    if size.map(usize::from) != [WIDTH_PX, HEIGHT_PX] {
        return Err(Failure::FrameSize { needed: size, available: [WIDTH_PX, HEIGHT_PX] });
    }
    let budget = Budget::for_frame(camera.width_px, camera.height_px)
        .in_bytes(scratch.len())
        .with_max_splats(MaxSplats::AtMost(MAX_SPLATS))
        .with_residency(Residency::Streamed)
        .with_strips(Strips::Exactly(1));
    let plan = bundle.plan(&budget)?;
    defmt::info!("memory: {} bytes of scratch, {} of frame", plan.scratch_len(), frame.data().len());

    let mut decoder = Decoder::bind(&bundle, plan, scratch)?;
    let mut display = DisplaySink::new(frame, Point::zero());
    let report = decoder.render(&camera, &mut display)?;
    // A frame buffer has no errors.
    let Ok(()) = display.finish();
    defmt::info!("{}", report);

    write_ppm(frame).map_err(|_| Failure::File)?;
    defmt::info!("wrote frame.ppm, {} x {}", WIDTH_PX, HEIGHT_PX);
    Ok(())
}

/// Writes `frame.ppm` into the folder in which QEMU runs.
fn write_ppm(frame: &Frame) -> semihosting::io::Result<()> {
    let mut file = fs::File::create(c"frame.ppm")?;
    write!(file, "P6\n{WIDTH_PX} {HEIGHT_PX}\n255\n")?;
    file.write_all(frame.data())
}
