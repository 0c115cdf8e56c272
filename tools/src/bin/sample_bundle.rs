//! Writes a small bundle made by hand: a banded planet with a ring, 160×120, every effect in use; the ring is a tier
//! of its own, and its patches hide a disc each.
//!
//! No training and no capture is behind it, so a firmware has something to draw from a fresh clone.

use std::path::PathBuf;

use anyhow::Context as _;
use clap::Parser;
use glam::{DMat3, DQuat, DVec3};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::Normalisation;
use pocketsplat_codec::bundle::{self, BundleInfo, ChannelCoding, WriteOptions};
use pocketsplat_format::context::{GridFrame, GridLevel, LevelKind};
use pocketsplat_kernels::scene::{Anchors, ContextModel, Head, Heads, ModelShape, Scene};

/// Writes a small bundle made by hand.
#[derive(Parser)]
struct Args {
    /// The file to write.
    out: PathBuf,
    /// What gives the symbols their frequencies; a context model is made of the channels' means and deviations.
    #[arg(long, value_parser = ["static", "context"], default_value = "static")]
    coder: String,
    /// Without glint and haze: as the same from everywhere.
    #[arg(long)]
    matte: bool,
    /// With isotropic Gaussians instead of discs.
    #[arg(long)]
    isotropic: bool,
}

const SHAPE: ModelShape = ModelShape {
    view_colour: true,
    view_geometry: true,
    view_distance: true,
    dilation_compensation: true,
    detail_hidden: 8,
    ..ModelShape::plain(16, 4)
};
const VOXEL_SIZE: f64 = 1.0 / 64.0;
const BACKGROUND: [u8; 3] = [8, 10, 24];
/// Where the light comes from.
const SUN: DVec3 = DVec3::new(0.62, -0.68, 0.39);

// What the features of an anchor mean here; the rest are zero.
const COLOUR: usize = 0;
const QUATERNION: usize = 3;
const OPACITY: usize = 7;
/// Added before the ReLU and taken off after it, so that a signed feature passes through the hidden layer.
const LIFT: f32 = 4.0;
// Hidden units that are no feature's.
const GLINT: usize = 8;
const HAZE: usize = 9;

/// A patch of surface: one anchor with four discs.
struct Patch {
    position: DVec3,
    normal: DVec3,
    /// Distance of the four discs to the patch's centre, and their radius.
    reach: f64,
    colour: DVec3,
    opacity: f64,
}

fn planet() -> Vec<Patch> {
    const N: usize = 220;
    const RADIUS: f64 = 0.85;
    let golden_angle = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let patch = |i: usize| {
        let z = 1.0 - 2.0 * (i as f64 + 0.5) / N as f64;
        let (sin, cos) = (golden_angle * i as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        let normal = DVec3::new(r * cos, r * sin, z);
        let band = match (4.5 * (z + 1.0)) as u32 {
            1 | 7 => DVec3::new(0.55, 0.36, 0.24),
            3 | 5 => DVec3::new(0.93, 0.62, 0.30),
            4 => DVec3::new(0.75, 0.25, 0.16),
            _ => DVec3::new(0.95, 0.85, 0.64),
        };
        Patch { position: RADIUS * normal, normal, reach: 0.10, colour: lit(band, normal), opacity: 0.97 }
    };
    (0..N).map(patch).collect()
}

fn ring() -> Vec<Patch> {
    let tilt = DQuat::from_rotation_x(0.35) * DQuat::from_rotation_y(0.2);
    let rows = [(1.25, 40, DVec3::new(0.50, 0.62, 0.85)), (1.55, 50, DVec3::new(0.80, 0.86, 0.95))];
    let patch = |(radius, n, colour): (f64, usize, DVec3), i: usize| {
        let (sin, cos) = (std::f64::consts::TAU * i as f64 / n as f64).sin_cos();
        let normal = tilt * DVec3::Z;
        Patch { position: tilt * (radius * DVec3::new(cos, sin, 0.0)), normal, reach: 0.085, colour, opacity: 0.8 }
    };
    rows.into_iter().flat_map(|row| (0..row.1).map(move |i| patch(row, i))).collect()
}

/// Lambert's law over a little ambient light.
fn lit(colour: DVec3, normal: DVec3) -> DVec3 {
    colour * (0.25 + 0.75 * normal.dot(SUN.normalize()).max(0.0))
}

fn scene(shape: ModelShape) -> Scene<f32> {
    let mut anchors = Anchors::default();
    let n_planet = planet().len();
    for (index, patch) in planet().into_iter().chain(ring()).enumerate() {
        anchors.lattice.push((patch.position / VOXEL_SIZE).round().as_ivec3().to_array());
        let turn = DQuat::from_rotation_arc(DVec3::Z, patch.normal);
        let mut feature = [0.0_f64; SHAPE.feature_dim];
        feature[COLOUR..][..3].copy_from_slice(&patch.colour.map(|c| (c / (1.0 - c)).ln()).to_array());
        feature[QUATERNION..][..4].copy_from_slice(&[turn.w, turn.x, turn.y, turn.z]);
        feature[OPACITY] = patch.opacity.atanh();
        anchors.features.extend(feature.map(|f| f as f32));
        let log_reach = patch.reach.ln() as f32;
        // The discs' radius: two thirds of their spacing, so that they overlap into a surface.
        anchors.log_scales.extend(std::iter::repeat_n(log_reach, shape.n_log_scales()));
        for (k, [x, y]) in [[-0.5, -0.5], [0.5, -0.5], [-0.5, 0.5], [0.5, 0.5]].into_iter().enumerate() {
            // The ring is thinner by a disc a patch.
            anchors.mask_logits.push(if index >= n_planet && k == 2 { -10.0 } else { 1.0 });
            anchors.offsets.extend((turn * DVec3::new(x, y, 0.0)).to_array().map(|o| o as f32));
        }
    }
    Scene { shape, voxel_size: VOXEL_SIZE, anchors, heads: heads(&shape), context: None }
}

/// Heads that read the features as [`scene`] wrote them, add a glint towards the sun and a haze with distance, if they see the view,
/// and a glow by night.
fn heads(shape: &ModelShape) -> Heads<f32> {
    let mut heads = Heads::filled(shape, 0.0);
    for head in [&mut heads.opacity, &mut heads.covariance, &mut heads.colour] {
        for unit in 0..=OPACITY {
            head.w1[unit * head.n_in + unit] = 1.0;
            head.b1[unit] = LIFT;
        }
    }
    let (distance, direction) = (SHAPE.feature_dim, SHAPE.feature_dim + 1);
    let colour = &mut heads.colour;
    if shape.sees_view() {
        for (axis, sun) in SUN.to_array().into_iter().enumerate() {
            colour.w1[GLINT * colour.n_in + direction + axis] = sun as f32;
        }
        colour.w1[HAZE * colour.n_in + distance] = 0.5;
    }
    colour.b1[HAZE] = -1.5;
    for k in 0..SHAPE.n_offsets {
        pass(&mut heads.opacity, k, OPACITY);
        if shape.anisotropic {
            // Discs: wide along x and y, thin along z.
            heads.covariance.b2[7 * k..][..3].copy_from_slice(&[0.3, 0.3, -2.5]);
            for part in 0..4 {
                pass(&mut heads.covariance, 7 * k + 3 + part, QUATERNION + part);
            }
        }
        for axis in 0..3 {
            let row = 3 * k + axis;
            pass(&mut heads.colour, row, COLOUR + axis);
            heads.colour.w2[row * SHAPE.feature_dim + GLINT] = 0.5;
            heads.colour.w2[row * SHAPE.feature_dim + HAZE] = -0.25;
        }
    }
    if let Some(detail) = &mut heads.detail {
        // The darker a disc, the more it glows; its red, green and blue are the last inputs.
        detail.w1[SHAPE.feature_dim..detail.n_in].fill(-1.0);
        detail.b1[0] = 0.9;
        for (channel, glow) in [0.10, 0.02, 0.12].into_iter().enumerate() {
            detail.w2[channel * detail.n_hidden] = glow;
        }
    }
    heads
}

/// Makes an output the value of a feature.
fn pass(head: &mut Head<f32>, output: usize, feature: usize) {
    head.w2[output * head.n_hidden + feature] = 1.0;
    head.b2[output] -= LIFT;
}

fn camera() -> Camera {
    let lens = Camera {
        rotation: DMat3::IDENTITY,
        translation: DVec3::ZERO,
        focal_px: [190.0, 190.0],
        principal_px: [80.0, 60.0],
        width_px: 160,
        height_px: 120,
    };
    lens.looking_at(DVec3::new(2.6, -3.4, 1.5), DVec3::ZERO, DVec3::Z)
}

/// A context model that predicts each channel's mean and deviation everywhere, and steps a little finer on one side.
fn context(scene: &Scene<f32>) -> ContextModel<f32> {
    const RESOLUTION: u16 = 4;
    let along = |axis: usize| scene.anchors.lattice.iter().map(move |cell| cell[axis]);
    let corner = |pick: fn(i32, i32) -> i32| std::array::from_fn(|axis| along(axis).reduce(pick).unwrap_or(0));
    let frame = GridFrame::spanning(corner(i32::min), corner(i32::max));
    let n_rows = u32::from(RESOLUTION).pow(3);
    let levels = vec![GridLevel { kind: LevelKind::Volume, resolution: RESOLUTION, n_rows }];
    let base_steps = [0.1, 0.05, 0.1];
    let mut model = ContextModel::filled(&scene.shape, frame, levels, 4, base_steps, 0.0);
    for (row, signs) in model.rows.chunks_mut(4).enumerate() {
        signs.fill(if row % 4 < 2 { 1.0 } else { -1.0 });
    }
    model.networks[0].mlp.w1[0] = 1.0;
    let n_channels = scene.shape.values_per_anchor();
    let groups = [
        (&scene.anchors.features, SHAPE.feature_dim),
        (&scene.anchors.log_scales, scene.shape.n_log_scales()),
        (&scene.anchors.offsets, 3 * SHAPE.n_offsets),
    ];
    let mut channel = 0;
    for ((values, width), base_step) in groups.into_iter().zip(base_steps) {
        for column in 0..width {
            let values: Vec<f32> = values.iter().skip(column).step_by(width).map(|v| v / base_step).collect();
            let n = values.len() as f32;
            let mean = values.iter().sum::<f32>() / n;
            let deviation = (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f32>() / n).sqrt();
            model.networks[0].mlp.b2[channel] = mean;
            model.networks[0].mlp.b2[n_channels + channel] = deviation.max(0.1).log2();
            channel += 1;
        }
    }
    let mlp = &mut model.networks[0].mlp;
    for output in 2 * n_channels..mlp.n_out {
        mlp.w2[output * mlp.n_hidden] = -0.25;
    }
    model
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let camera = camera();
    let (sees_view, anisotropic) = (!args.matte, !args.isotropic);
    let (view_colour, view_geometry, view_distance) = (sees_view, sees_view, sees_view);
    let mut scene = scene(ModelShape { view_colour, view_geometry, view_distance, anisotropic, ..SHAPE });
    let with_context = args.coder == "context";
    if with_context {
        scene.context = Some(context(&scene));
    }
    let info = BundleInfo {
        normalisation: Normalisation { centre: DVec3::ZERO, scale: 1.0 },
        background: BACKGROUND,
        training_px: [camera.width_px, camera.height_px],
        preview: camera,
        protocol: None,
    };
    let n_planet = planet().len();
    let options = WriteOptions {
        channels: if with_context { ChannelCoding::Context } else { ChannelCoding::default() },
        importance: Some((0..scene.anchors.len()).map(|anchor| if anchor < n_planet { 1.0 } else { 0.0 }).collect()),
        pruning_rates: vec![(scene.anchors.len() - n_planet) as f32 / scene.anchors.len() as f32, 0.0],
        chunk_anchors: 64,
        ..WriteOptions::default()
    };
    let bytes = bundle::write(&scene, &info, &options).context("cannot write the sample scene")?.bytes;
    std::fs::write(&args.out, &bytes).with_context(|| format!("cannot write {}", args.out.display()))?;
    println!("{}: {} anchors, {} bytes", args.out.display(), scene.anchors.len(), bytes.len());
    Ok(())
}
