//! `pocketsplat render --preview` draws what a device draws first.

use std::convert::Infallible;
use std::fs;

use pocketsplat_core::{Budget, Bundle, Decoder, Plan, Tile, TileSink};

use crate::fixture::{capture, fails, folder, pocketsplat, succeeds, text};

/// A bundle of three anchors, whose preview has 32×24 pixels.
const EXAMPLE: &[u8] = include_bytes!("../../../../decoder-format/src/bundle/example.psb");

/// A display that keeps its pixels.
struct Display(image::RgbImage);

impl TileSink for Display {
    type Error = Infallible;

    fn tile(&mut self, Tile { x_px, y_px, width, rgb, .. }: Tile<'_>) -> Result<(), Infallible> {
        for (y, row) in (u32::from(y_px)..).zip(rgb.chunks_exact(width.into())) {
            for (x, &pixel) in (u32::from(x_px)..).zip(row) {
                self.0.put_pixel(x, y, image::Rgb(pixel));
            }
        }
        Ok(())
    }
}

/// The first frame of a device with 8 KiB for it.
fn first_frame(width_px: u16, height_px: u16) -> image::RgbImage {
    let bundle = Bundle::parse(EXAMPLE).unwrap();
    let plan = Plan::new(&bundle, &Budget::for_frame(width_px, height_px).in_bytes(8 * 1024)).unwrap();
    let mut scratch = [0; 8 * 1024];
    let mut display = Display(image::RgbImage::new(width_px.into(), height_px.into()));
    let camera = bundle.header().preview.resized(width_px, height_px);
    Decoder::bind(&bundle, plan, &mut scratch).unwrap().render(&camera, &mut display).unwrap();
    display.0
}

#[test]
fn the_bundles_own_camera_is_drawn_as_a_device_draws_it() {
    let home = folder("preview");
    let bundle = home.join("example.psb");
    fs::write(&bundle, EXAMPLE).unwrap();
    let picture = home.join("first.png");
    let render = || {
        let mut command = pocketsplat();
        command.arg("render").arg(&bundle).arg("-o").arg(&picture);
        command
    };
    succeeds(render().arg("--preview"));
    assert!(image::open(&picture).unwrap().to_rgb8() == first_frame(32, 24), "another frame than a device's");
    succeeds(render().args(["--preview", "--resolution", "50x20"]));
    assert!(image::open(&picture).unwrap().to_rgb8() == first_frame(50, 20), "another frame than a device's");
    succeeds(render().args(["--preview", "--renderer", "reference"]));
    assert_eq!(image::open(&picture).unwrap().to_rgb8().dimensions(), (32, 24), "the reference's");
    let said = fails(render().args(["--preview", "--resolution", "4096x20"]));
    assert!(said.contains("up to 4080 px a side, not 4096x20"), "{said}");
    // Neither a capture nor the preview, and both.
    for (arguments, named) in [(vec![], "DATASET"), (vec![capture().to_str().unwrap(), "--preview"], "--preview")] {
        let refused = render().args(arguments).output().unwrap();
        let said = text(&refused.stderr);
        assert!(refused.status.code() == Some(2) && said.contains(named), "{said}");
    }
    // A capture without the number of a view.
    let refused = render().arg(capture()).output().unwrap();
    assert!(refused.status.code() == Some(2) && text(&refused.stderr).contains("--view"), "{}", text(&refused.stderr));
}
