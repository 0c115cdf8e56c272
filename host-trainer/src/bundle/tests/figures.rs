//! Figures, not laws: `cargo test --release -p pocketsplat --lib bundle::tests::figures -- --ignored --nocapture`.

use std::collections::HashMap;
use std::time::Instant;

use pocketsplat_core::{Budget, Bundle, Decoder, MaxSplats, TileSink};

use super::{camera, write_random};
use crate::bundle::SizeReport;
use crate::scene::ModelShape;

struct NoSink;

impl TileSink for NoSink {
    fn tile(&mut self, _: u16, _: u16, _: u16, _: u16, _: &[[u8; 3]]) {}
}

/// Bits of all symbols by each channel's own empirical entropy.
fn entropy_bits(bundle: &Bundle<'_>) -> f64 {
    let n_channels = bundle.header().n_channels();
    let mut counts = vec![HashMap::<i16, f64>::new(); n_channels];
    for chunk in bundle.chunks() {
        let n = usize::from(chunk.n_anchors());
        let (mut lattice, mut symbols) = (vec![[0; 3]; n], vec![0; n * n_channels]);
        chunk.decode_symbols(bundle.tables(), &mut lattice, &mut symbols).expect("a sound chunk");
        for (i, symbol) in symbols.into_iter().enumerate() {
            *counts[i % n_channels].entry(symbol).or_default() += 1.0;
        }
    }
    let total = f64::from(bundle.header().n_anchors);
    counts.iter().flat_map(HashMap::values).map(|n| -n * (n / total).log2()).sum()
}

#[test]
#[ignore = "prints figures of random scenes and takes seconds"]
fn bytes_and_times_of_random_scenes() {
    for (n_anchors, feature_dim, n_offsets) in [(2_000, 16, 4), (2_000, 32, 10), (40_000, 32, 10)] {
        let shape = ModelShape {
            feature_dim,
            n_offsets,
            view_direction: true,
            view_distance: true,
            dilation_compensation: true,
        };
        let start = Instant::now();
        let (_, bytes) = write_random(shape, n_anchors, 1, 128);
        let written = start.elapsed();
        let bundle = Bundle::parse(&bytes).expect("a sound bundle");
        let report = SizeReport::of(&bundle).expect("sound chunks");
        let model_bits = report.feature_bits + report.log_scale_bits + report.offset_bits;
        println!("{n_anchors} anchors, F {feature_dim}, K {n_offsets}: written in {written:?}, {report:?}");
        println!(
            "  {} tables; {:.2} bytes an anchor; ANS +{:.3} % on the tables, all +{:.3} % on the channels' entropy",
            bundle.tables().len(),
            report.bytes_per_anchor(),
            100.0 * (8.0 * report.symbols as f64 / model_bits - 1.0),
            100.0 * (8.0 * (report.symbols + report.tables) as f64 / entropy_bits(&bundle) - 1.0),
        );
        let plan =
            bundle.plan(&Budget { width_px: 400, height_px: 400, max_splats: MaxSplats::Worst }).expect("a plan");
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
