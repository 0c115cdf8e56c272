//! Decoding all anchors of a large bundle on one core, under a context model and under tables, and where the time goes.
//!
//! 40,000 anchors, F 50, K 10, two offsets in five drawn. `cargo bench -p pocketsplat-trainer --bench decode`.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{DMat3, DVec3};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::Normalisation;
use pocketsplat_codec::bundle::{self, BundleInfo, ChannelCoding, SizeReport, WriteOptions, mean_steps};
use pocketsplat_format::Bundle;
use pocketsplat_format::bundle::AnchorSite;
use pocketsplat_format::context::Context;
use pocketsplat_kernels::scene::{Anchors, Heads, ModelShape, Scene};
use pocketsplat_trainer::train::context::start::initial_context;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const N_ANCHORS: usize = 40_000;
const SHAPE: ModelShape =
    ModelShape { view_colour: true, view_geometry: true, view_distance: true, ..ModelShape::plain(50, 10) };
const BASE_STEPS: [f32; 3] = [1.0, 0.1, 0.2];

/// Anchors on a sphere's surface, their values spread over a few steps, with a context model as training starts it.
fn scene() -> Scene<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut lattice = std::collections::BTreeSet::new();
    while lattice.len() < N_ANCHORS {
        let direction = DVec3::from(std::array::from_fn(|_| rng.random_range(-1.0..1.0)));
        lattice.insert((direction.normalize_or(DVec3::X) * 300.0).round().as_ivec3().to_array());
    }
    let mut spread = |n: usize, width: f32| -> Vec<f32> { (0..n).map(|_| rng.random_range(-width..width)).collect() };
    let anchors = Anchors {
        features: spread(N_ANCHORS * SHAPE.feature_dim, 1.5),
        log_scales: spread(N_ANCHORS * 6, 0.3).iter().map(|x| x - 3.0).collect(),
        offsets: spread(N_ANCHORS * 3 * SHAPE.n_offsets, 1.0),
        mask_logits: spread(N_ANCHORS * SHAPE.n_offsets, 1.0).iter().map(|x| x - 4.8).collect(),
        prune_rank: Vec::new(),
        view_weights: Vec::new(),
        lattice: lattice.into_iter().collect(),
    };
    let mut scene =
        Scene { shape: SHAPE, voxel_size: 0.005, anchors, heads: Heads::filled(&SHAPE, 0.0), context: None };
    scene.context = Some(initial_context(&scene, scene.anchors.len(), BASE_STEPS, &mut rng));
    scene
}

fn written(scene: &Scene<f32>, channels: ChannelCoding) -> Vec<u8> {
    let info = BundleInfo {
        normalisation: Normalisation { centre: DVec3::ZERO, scale: 1.0 },
        background: [0; 3],
        training_px: [400; 2],
        protocol: None,
        preview: Camera {
            rotation: DMat3::IDENTITY,
            translation: DVec3::new(0.0, 0.0, 4.0),
            focal_px: [555.0; 2],
            principal_px: [200.0; 2],
            width_px: 400,
            height_px: 400,
        },
    };
    let options = WriteOptions { channels, ..WriteOptions::default() };
    bundle::write(scene, &info, &options).expect("the scene is sound").bytes
}

/// Decodes every anchor to values; returns their sites.
fn decode(bundle: &Bundle<'_>, values: &mut [f32]) -> Vec<AnchorSite> {
    let mut words = vec![0; bundle.anchor_scratch_words()];
    let mut models = bundle.anchor_models(&mut words).expect("as many words as asked for");
    let mut sites = vec![AnchorSite::default(); bundle.n_anchors() as usize];
    let mut rest = sites.as_mut_slice();
    for chunk in bundle.chunks() {
        let (chunk_sites, after) = rest.split_at_mut(chunk.n_anchors().into());
        chunk.decode_values(&mut models, chunk_sites, values).expect("a sound chunk");
        rest = after;
    }
    sites
}

/// What the context says about every anchor, without reading a symbol: grid, network, and which table each channel takes.
fn predict(context: &Context<'_>, sites: &[AnchorSite], with_models: bool) {
    let (mut features, mut hidden) = (vec![0; context.n_inputs()], vec![0; context.n_hidden()]);
    let (network, n_scalars) = (context.network(0), SHAPE.feature_dim + 6);
    for site in sites {
        context.features(site.lattice, &mut features);
        network.hidden(&features, &mut hidden);
        let steps = network.steps(&hidden);
        black_box(&steps);
        if with_models {
            let offsets = (0..SHAPE.n_offsets).filter(|k| (site.mask >> k) & 1 == 1);
            let channels = (0..n_scalars).chain(offsets.flat_map(|k| n_scalars + 3 * k..n_scalars + 3 * k + 3));
            channels.for_each(|channel| _ = black_box(network.model(channel, &steps, &hidden, &[])));
        }
    }
}

fn benchmark(criterion: &mut Criterion) {
    let scene = scene();
    let tables = ChannelCoding::Tables(mean_steps(&scene).expect("a scene with a context"));
    for (name, channels) in [("context", ChannelCoding::Context), ("tables", tables)] {
        let bytes = written(&scene, channels);
        let bundle = Bundle::parse(&bytes).expect("the writer's bundle is sound");
        let mut values = vec![0.0; usize::from(bundle.header().max_chunk_anchors) * bundle.header().n_channels()];
        let sites = decode(&bundle, &mut values);
        let report = SizeReport::of(&bundle).expect("sound chunks");
        let n_symbols = sites.len() * (SHAPE.feature_dim + 6) + 3 * report.n_drawn_offsets;
        println!(
            "{name}: {} anchors, {} bytes, {n_symbols} channel symbols of {:.2} bits",
            sites.len(),
            bytes.len(),
            (report.ideal.total() - report.ideal.positions - report.ideal.masks) / n_symbols as f64
        );
        let mut group = criterion.benchmark_group(name);
        group.sample_size(10).throughput(Throughput::Elements(n_symbols as u64));
        group.bench_function("all", |bencher| bencher.iter(|| decode(&bundle, &mut values)));
        if let Some(context) = bundle.context() {
            group.bench_function("grid, hidden units, steps", |bencher| {
                bencher.iter(|| predict(context, &sites, false))
            });
            group.bench_function("these and models", |bencher| bencher.iter(|| predict(context, &sites, true)));
        }
        group.finish();
    }
}

criterion_group!(benches, benchmark);
criterion_main!(benches);
