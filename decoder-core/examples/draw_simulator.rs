//! Draws a bundle on a display of `embedded-graphics`, here the simulator, and writes what the display shows as a PNG.
//!
//! A firmware does the same with its own display driver: any `DrawTarget` will do.
//!
//! ```sh
//! cargo run -p pocketsplat-core --features embedded-graphics --example draw_simulator -- [BUNDLE.psb [OUT.png]]
//! ```

use std::error::Error;

use embedded_graphics_core::geometry::{Point, Size};
use embedded_graphics_core::pixelcolor::Rgb565;
use embedded_graphics_simulator::{OutputSettingsBuilder, SimulatorDisplay};
use pocketsplat_core::{Budget, Bundle, Decoder};
use pocketsplat_core::{DisplaySink, Plan};

/// The bundle of the format's description: three anchors, drawn where no other bundle is given.
const EXAMPLE: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/example.psb"));

/// Pixels of the display.
const DISPLAY_PX: [u16; 2] = [160, 120];
/// What this device has left for the decoder.
const RAM_BYTES: usize = 192 * 1024;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let bytes = arguments.next().map_or(Ok(EXAMPLE.to_vec()), std::fs::read)?;
    let output = arguments.next().unwrap_or_else(|| "display.png".to_owned());

    // A display of five, six and five bits: the sink converts each pixel to the display's colours, and dithers.
    let [width_px, height_px] = DISPLAY_PX;
    let mut display = SimulatorDisplay::<Rgb565>::new(Size::new(width_px.into(), height_px.into()));

    let bundle = Bundle::parse(&bytes)?;
    let plan = Plan::new(&bundle, &Budget::for_frame(width_px, height_px).in_bytes(RAM_BYTES))?;
    let mut scratch = vec![0; plan.scratch_len()];
    let mut decoder = Decoder::bind(&bundle, plan, &mut scratch)?;

    // The preview's camera, for a frame of this size.
    let camera = bundle.header().preview.resized(width_px, height_px);
    // The simulator never fails; the error of a display on a bus would come back from here.
    let report = decoder.render(&camera, &mut DisplaySink::new(&mut display, Point::zero()).dithered())?;

    let shown = display.to_rgb_output_image(&OutputSettingsBuilder::new().scale(2).build());
    shown.save_png(&output)?;
    println!("{output}: {} splats, {} bytes of scratch", report.splats, plan.scratch_len());
    Ok(())
}
