//! Draws a bundle as its preview camera sees it, and writes a PNG.
//!
//! ```sh
//! cargo run -p pocketsplat-core --example draw_png -- [BUNDLE.psb [OUT.png]]
//! ```

use std::convert::Infallible;
use std::error::Error;

use pocketsplat_core::{Budget, Bundle, Decoder, Plan, Tile, TileSink};

/// The bundle of the format's description: three anchors, drawn where no other bundle is given.
const EXAMPLE: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/example.psb"));

/// A frame that is filled tile by tile. A device would hand each tile to its display instead.
struct Frame {
    width_px: usize,
    /// `[height, width, 3]`, row by row.
    rgb: Vec<u8>,
}

impl TileSink for Frame {
    type Error = Infallible;

    fn tile(&mut self, Tile { x_px, y_px, width, rgb, .. }: Tile<'_>) -> Result<(), Infallible> {
        for (row, pixels) in rgb.chunks_exact(width.into()).enumerate() {
            let first = ((usize::from(y_px) + row) * self.width_px + usize::from(x_px)) * 3;
            self.rgb[first..][..pixels.as_flattened().len()].copy_from_slice(pixels.as_flattened());
        }
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let bytes = arguments.next().map_or(Ok(EXAMPLE.to_vec()), std::fs::read)?;
    let output = arguments.next().unwrap_or_else(|| "frame.png".to_owned());

    // Parse: everything but the chunks is checked here, once.
    let bundle = Bundle::parse(&bytes)?;
    let camera = bundle.header().preview;

    // Plan: a PC has memory enough, so the budget names the frame's size alone.
    let plan = Plan::new(&bundle, &Budget::for_frame(camera.width_px, camera.height_px))?;

    // Bind: the decoder uses these bytes and no others.
    let mut scratch = vec![0; plan.scratch_len()];
    let mut decoder = Decoder::bind(&bundle, plan, &mut scratch)?;

    // Draw.
    let [width_px, height_px] = [camera.width_px, camera.height_px].map(usize::from);
    let mut frame = Frame { width_px, rgb: vec![0; width_px * height_px * 3] };
    let report = decoder.render(&camera, &mut frame)?;
    image::save_buffer(&output, &frame.rgb, camera.width_px.into(), camera.height_px.into(), image::ColorType::Rgb8)?;
    println!(
        "{output}: {width_px}×{height_px} pixels, {} splats, {} bytes of scratch",
        report.splats,
        plan.scratch_len()
    );
    Ok(())
}
