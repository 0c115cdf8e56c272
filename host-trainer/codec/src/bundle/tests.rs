//! Laws of the writer and the decoder's reader together.

mod culling;
mod damage;
mod entropy;
mod heads;
mod measures;
mod round_trip;
mod rounding;
mod tiers;

use std::collections::BTreeSet;

use glam::{DMat3, DVec3};
use pocketsplat_format::Bundle;
use pocketsplat_format::bundle::AnchorSite;
use pocketsplat_format::context::{GridFrame, GridLevel, LevelKind};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{BundleInfo, ChannelCoding, WriteOptions};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::Normalisation;
use pocketsplat_kernels::scene::QuantisationSteps;
use pocketsplat_kernels::scene::{Anchors, ContextModel, Heads, ModelShape, Scene};

/// One step for every channel, so that a test can compute symbols by itself.
const STEPS: QuantisationSteps = QuantisationSteps { feature: 0.02, log_scale: 0.02, offset: 0.02 };
/// Tables of them.
const TABLES: ChannelCoding = ChannelCoding::Tables(STEPS);

/// A scene of random anchors in a cube before the camera, the same for the same arguments.
///
/// Three offsets in four are drawn; a few anchors draw none.
fn random_scene(shape: ModelShape, n_anchors: usize, seed: u64) -> Scene<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut cells = BTreeSet::new();
    let mut lattice = Vec::new();
    // The sum of four uniform numbers: roughly a Gaussian of deviation 0.58.
    let mut bell = |width: f32| (0..4).map(|_| rng.random_range(-0.5..0.5_f32)).sum::<f32>() * width;
    while lattice.len() < n_anchors {
        let cell: [i32; 3] = core::array::from_fn(|_| (bell(200.0)) as i32);
        if cells.insert(cell) {
            lattice.push(cell);
        }
    }
    let anchors = Anchors {
        lattice,
        features: (0..n_anchors * shape.feature_dim).map(|_| bell(0.6)).collect(),
        log_scales: (0..n_anchors * 6).map(|_| -2.5 + bell(0.7)).collect(),
        offsets: (0..n_anchors * 3 * shape.n_offsets).map(|_| bell(1.0)).collect(),
        mask_logits: (0..n_anchors * shape.n_offsets).map(|_| -4.2 + bell(1.0)).collect(),
        prune_rank: Vec::new(),
        view_weights: Vec::new(),
    };
    let mut heads = Heads::filled(&shape, 0.0);
    for head in heads.each_mut() {
        for group in head.groups_mut() {
            group.iter_mut().for_each(|weight| *weight = bell(0.5));
        }
    }
    // About two offsets in three are visible.
    heads.opacity.b2.iter_mut().for_each(|bias| *bias += 0.3);
    Scene { shape, voxel_size: 0.01, anchors, heads, context: None }
}

/// The scene with a context model of random weights around its own statistics.
fn with_context(scene: Scene<f32>, seed: u64) -> Scene<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let levels = vec![
        GridLevel { kind: LevelKind::Volume, resolution: 6, n_rows: 216 },
        GridLevel { kind: LevelKind::Volume, resolution: 40, n_rows: 1024 },
        GridLevel { kind: LevelKind::Xy, resolution: 60, n_rows: 512 },
    ];
    let along = |axis: usize| scene.anchors.lattice.iter().map(move |cell| cell[axis]);
    let frame = GridFrame::spanning(
        std::array::from_fn(|axis| along(axis).min().unwrap_or(0)),
        std::array::from_fn(|axis| along(axis).max().unwrap_or(1)),
    );
    let base_steps = [0.1, 0.05, 0.2];
    let mut model = ContextModel::filled(&scene.shape, frame, levels, 12, base_steps, 0.0);
    for row in &mut model.rows {
        *row = rng.random_range(-1.0..1.0);
    }
    for group in model.networks[0].mlp.groups_mut() {
        group.iter_mut().for_each(|weight| *weight = rng.random_range(-0.3..0.3));
    }
    // Deviations of 0.35, 0.41, 0.58; log-scales around −2.5.
    let n_channels = scene.shape.values_per_anchor();
    for channel in 0..n_channels {
        let group =
            usize::from(channel >= scene.shape.feature_dim) + usize::from(channel >= scene.shape.feature_dim + 6);
        model.networks[0].mlp.b2[channel] += [0.0, -50.0, 0.0][group];
        model.networks[0].mlp.b2[n_channels + channel] += [1.8, 3.0, 1.5][group];
    }
    // Every other scene has taps.
    let mut model = model.with_taps(&scene.shape, if seed.is_multiple_of(2) { 0 } else { 4 }, 0.0);
    model.networks[0].taps.iter_mut().for_each(|tap| *tap = rng.random_range(-0.6..0.6));
    Scene { context: Some(model), ..scene }
}

/// The scene with a context of random weights in which anchors follow anchors.
fn with_levels(scene: Scene<f32>, seed: u64) -> Scene<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let frame = GridFrame::spanning([-100; 3], [100; 3]);
    let mut model = ContextModel::following(&scene.shape, frame, [4, 6, 8], 12, [0.1, 0.05, 0.2], 0.0);
    let n_channels = scene.shape.values_per_anchor();
    for network in &mut model.networks {
        for group in network.mlp.groups_mut() {
            group.iter_mut().for_each(|weight| *weight = rng.random_range(-0.3..0.3));
        }
        for channel in 0..n_channels {
            let group =
                usize::from(channel >= scene.shape.feature_dim) + usize::from(channel >= scene.shape.feature_dim + 6);
            network.mlp.b2[channel] += [0.0, -50.0, 0.0][group];
            network.mlp.b2[n_channels + channel] += [1.8, 3.0, 1.5][group];
        }
    }
    Scene { context: Some(model), ..scene }
}

/// A small shape with every effect.
const SMALL: ModelShape = ModelShape {
    view_colour: true,
    view_geometry: true,
    view_distance: true,
    dilation_compensation: true,
    ..ModelShape::plain(6, 3)
};

fn camera(width_px: u32, height_px: u32) -> Camera {
    Camera {
        rotation: DMat3::from_rotation_y(0.2),
        translation: DVec3::new(0.1, -0.1, 3.0),
        focal_px: [f64::from(width_px), f64::from(width_px)],
        principal_px: [f64::from(width_px) / 2.0, f64::from(height_px) / 2.0],
        width_px,
        height_px,
    }
}

fn info() -> BundleInfo {
    BundleInfo {
        normalisation: Normalisation { centre: DVec3::new(1.0, -2.0, 0.5), scale: 2.5 },
        background: [10, 20, 30],
        training_px: [64, 48],
        preview: camera(64, 48),
        protocol: None,
    }
}

fn options(channels: ChannelCoding, chunk_anchors: u16) -> WriteOptions {
    WriteOptions { channels, chunk_anchors, ..WriteOptions::default() }
}

fn write_bytes(scene: &Scene<f32>, options: &WriteOptions) -> Vec<u8> {
    super::write(scene, &info(), options).expect("a sound scene").bytes
}

/// A random scene and its bundle, under static tables or a context.
fn write_random(
    channels: ChannelCoding,
    shape: ModelShape,
    n_anchors: usize,
    seed: u64,
    chunk: u16,
) -> (Scene<f32>, Vec<u8>) {
    let scene = random_scene(shape, n_anchors, seed);
    let scene = if channels == ChannelCoding::Context { with_context(scene, seed) } else { scene };
    let bytes = write_bytes(&scene, &options(channels, chunk));
    (scene, bytes)
}

/// All anchors of a bundle as integers: place, drawn offsets, symbols.
fn decoded_rows(bundle: &Bundle<'_>) -> Vec<(AnchorSite, Vec<i16>)> {
    let n_channels = bundle.header().n_channels();
    let mut words = vec![0; bundle.anchor_scratch_words()];
    let mut models = bundle.anchor_models(&mut words).expect("as many words as asked for");
    let mut rows = Vec::new();
    for chunk in bundle.chunks() {
        let n = usize::from(chunk.n_anchors());
        let (mut sites, mut symbols) = (vec![AnchorSite::default(); n], vec![0; n * n_channels]);
        chunk.decode_symbols(&mut models, &mut sites, &mut symbols).expect("a sound chunk");
        rows.extend(sites.into_iter().zip(symbols.chunks_exact(n_channels).map(<[i16]>::to_vec)));
    }
    rows
}
