//! Figures, not laws: `cargo test --release -p pocketsplat --lib bundle::tests::figures -- --ignored --nocapture`.

use std::time::Instant;

use pocketsplat_core::{Budget, Bundle, Decoder, TileSink};

use super::{camera, decoded_rows, write_random};
use crate::bundle::{Coder, SizeReport};
use crate::scene::ModelShape;

struct NoSink;

impl TileSink for NoSink {
    fn tile(&mut self, _: u16, _: u16, _: u16, _: u16, _: &[[u8; 3]]) {}
}

#[test]
#[ignore = "prints figures of random scenes and takes seconds"]
fn bytes_and_times_of_random_scenes() {
    for (coder, n_anchors, feature_dim, n_offsets) in [
        (Coder::Static, 2_000, 16, 4),
        (Coder::Context, 2_000, 16, 4),
        (Coder::Static, 40_000, 50, 10),
        (Coder::Context, 40_000, 50, 10),
    ] {
        let shape = ModelShape {
            view_direction: true,
            view_distance: true,
            dilation_compensation: true,
            ..ModelShape::plain(feature_dim, n_offsets)
        };
        let start = Instant::now();
        let (_, bytes) = write_random(coder, shape, n_anchors, 1, 256);
        println!("{coder:?}, {n_anchors} anchors, F {feature_dim}, K {n_offsets}: made in {:?}", start.elapsed());
        let bundle = Bundle::parse(&bytes).expect("a sound bundle");
        let report = SizeReport::of(&bundle).expect("sound chunks");
        let ideal = report.ideal.total() / 8.0;
        println!(
            "  {} bytes; streams +{:.3} % on the models' cross entropy, container {:.2} % of the file",
            report.total,
            100.0 * (report.streams as f64 / ideal - 1.0),
            100.0 * report.container() / report.total as f64,
        );
        let start = Instant::now();
        println!("  {} anchors decoded in {:?}", decoded_rows(&bundle).len(), start.elapsed());
        let plan = bundle.plan(&Budget::for_frame(400, 400)).expect("a plan");
        let mut scratch = vec![0; plan.scratch_len()];
        let mut decoder = Decoder::bind(&bundle, plan, &mut scratch).expect("planned memory");
        let camera = crate::render::decoder::core_camera(&camera(400, 400)).expect("a sound camera");
        for _ in 0..2 {
            let start = Instant::now();
            let frame = decoder.render(&camera, &mut NoSink).expect("a frame");
            println!("  {:?}: {frame:?}", start.elapsed());
        }
    }
}
