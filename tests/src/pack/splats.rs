//! Bundles whose Gaussians are chosen one by one, for what drawing does at its limits.

use pocketsplat_format::bundle::Effects;
use pocketsplat_format::{Camera, Rotation};

use super::draft::{CoderDraft, Draft, n_channels};
use super::heads::{HeadDraft, Widths, shapes};
use super::models::{Anchor, TableDraft};
use super::sample::{NO_EFFECT, Sample};

/// One Gaussian, in the symbols of its anchor.
#[derive(Clone, Copy, Debug)]
struct Blob {
    cell: [i32; 3],
    /// Its deviations along its own axes are half of e^(s/8).
    log_scales: [i16; 3],
    /// The anchor's extent, likewise but whole.
    extent: i16,
    /// w, x, y, z in 16ths.
    quaternion: [i16; 4],
    /// Before the sigmoid, in 16ths.
    colour: [i16; 3],
    /// Before tanh, in 1024ths.
    opacity: i16,
}

/// In a 64th of a lattice cell of 1/80: z = 0.2 is a cell.
const VOXEL_SIZE: f32 = 0.2 / 16.0;
/// In the middle of the view, 1.0 away.
const MIDDLE: [i32; 3] = [0, 0, 80];
const USUAL: Blob = Blob {
    cell: MIDDLE,
    log_scales: [-16; 3],
    extent: -24,
    quaternion: [16, 0, 0, 0],
    colour: [32, 0, -24],
    opacity: 1100,
};
/// Opacities 0.00391 and 0.00488: the largest below 1/255, and one above it.
const BARELY_INVISIBLE: i16 = 4;
const BARELY_VISIBLE: i16 = 5;
const OPAQUE: i16 = 8192;

/// Looks along z from the origin.
fn camera(width_px: u16, height_px: u16) -> Camera {
    let [w, h] = [width_px, height_px].map(f32::from);
    Camera {
        rotation: Rotation::IDENTITY,
        translation: [0.0; 3],
        focal_px: [w, w],
        principal_px: [w / 2.0, h / 2.0],
        width_px,
        height_px,
    }
}

/// Heads that pass the features on: three scale logits, a quaternion, a colour, an opacity.
fn heads(widths: Widths, effects: Effects) -> Vec<HeadDraft> {
    /// What is added before the ReLU and taken off behind it, so that a signed feature passes; 64 are one.
    const LIFT: i16 = 16 * 64;
    const COVARIANCE: [usize; 7] = [0, 1, 2, 3, 4, 5, 6];
    let sources: [&[usize]; 3] = [&[10], if effects.anisotropic { &COVARIANCE } else { &[0] }, &[7, 8, 9]];
    let of_head = |([n_in, n_hidden, n_out], sources): ([usize; 3], &[usize])| {
        let mut head = HeadDraft {
            w1: vec![0; n_hidden * n_in],
            b1: vec![LIFT; n_hidden],
            w2: vec![0; n_out * n_hidden],
            b2: vec![-LIFT; n_out],
            n_in,
            n_hidden,
        };
        (0..n_hidden).for_each(|unit| head.w1[unit * n_in + unit] = 64);
        sources.iter().enumerate().for_each(|(row, source)| head.w2[row * n_hidden + source] = 64);
        head
    };
    shapes(widths, effects).into_iter().zip(sources).map(of_head).collect()
}

fn draft(blobs: &[Blob], effects: Effects) -> Draft {
    let widths = Widths { features: 11, offsets: 1, colour_hidden: 11, detail_hidden: 0 };
    let n_channels = n_channels(widths, effects);
    let anchors: Vec<Anchor> = blobs
        .iter()
        .map(|blob| {
            let features = [0; 3].into_iter().chain(blob.quaternion).chain(blob.colour).chain([blob.opacity]);
            let log_scales = [blob.extent; 3].into_iter().chain(blob.log_scales);
            let symbols = features.chain(log_scales.take(n_channels - 11 - 3)).chain([0; 3]).collect();
            Anchor { cell: blob.cell, drawn: 1, symbols }
        })
        .collect();
    let mut draft =
        Draft::of(effects, widths, vec![anchors.chunks(8).map(<[Anchor]>::to_vec).collect()], camera(64, 48), 0);
    draft.voxel_size = VOXEL_SIZE;
    draft.heads = heads(widths, effects);
    let all = || draft.tiers[0].iter().flatten();
    let of = |step: f32, channels: std::ops::Range<usize>| {
        TableDraft::counting(step, [-64, 64], all().flat_map(|anchor| anchor.symbols[channels.clone()].to_vec()))
    };
    let tables = vec![of(1.0 / 16.0, 0..10), of(1.0 / 1024.0, 10..11), of(1.0 / 8.0, 11..n_channels)];
    let of_channel = (0..n_channels).map(|channel| u16::from(channel >= 10) + u16::from(channel >= 11)).collect();
    draft.coder = CoderDraft::Tables(tables, of_channel);
    draft
}

fn sample(name: &str, about: &str, draft: Draft, views: &[Camera]) -> Sample {
    let views = views.iter().map(|camera| (1, *camera)).collect();
    let anchors = draft.clone().anchors();
    Sample { name: name.to_owned(), about: about.to_owned(), anchors, bytes: draft.file(), views }
}

/// Turned about the axis of view by an angle whose half has this tangent in 16ths.
fn turned(tangent: i16) -> [i16; 4] {
    [16, 0, 0, tangent]
}

fn shapes_of_splats() -> Vec<Blob> {
    let mut blobs = Vec::new();
    for (at, [x, y]) in (0_i16..).zip([[-30, -20], [-10, -20], [10, -20], [30, -20], [-30, 0]]) {
        // Needles of ratios up to a million, in five directions.
        let log_scales = [-8, -16 - 16 * at, -20 - 16 * at];
        blobs.push(Blob {
            cell: [x, y, 80],
            log_scales,
            quaternion: turned(3 * at),
            colour: [32, 4 * at, -32],
            ..USUAL
        });
    }
    // Specks smaller than a pixel, one seen through dilation alone.
    blobs.push(Blob { cell: [10, 0, 80], log_scales: [-40; 3], ..USUAL });
    blobs.push(Blob { cell: [14, 0, 80], log_scales: [-90; 3], colour: [-32, 32, 32], ..USUAL });
    // Pancakes, face on, askew, edge on.
    for (at, quaternion) in (0..).zip([[16, 0, 0, 0], [16, 5, 3, 0], [16, 16, 0, 0]]) {
        let cell = [-30 + 20 * at, 20, 80];
        blobs.push(Blob { cell, log_scales: [-10, -10, -80], quaternion, colour: [-16, 24, -8], ..USUAL });
    }
    // Far larger than the frame, in front of everything and behind.
    blobs.push(Blob {
        cell: [40, 10, 60],
        log_scales: [32; 3],
        extent: 32,
        opacity: 200,
        colour: [-40, -40, 40],
        ..USUAL
    });
    blobs.push(Blob {
        cell: [-80, -40, 160],
        log_scales: [40, 20, 10],
        extent: 40,
        quaternion: [3, -9, 5, 7],
        ..USUAL
    });
    // A quaternion of length zero, and one whose largest number is negative.
    blobs.push(Blob { cell: [30, 20, 80], quaternion: [0; 4], log_scales: [-10, -20, -30], ..USUAL });
    blobs.push(Blob { cell: [36, 20, 90], quaternion: [2, -30, 4, 9], log_scales: [-10, -20, -30], ..USUAL });
    // Splats whose centres lie outside the frame, and whose rims reach into it or not.
    blobs.push(Blob { cell: [60, 0, 80], log_scales: [-10; 3], extent: 0, ..USUAL });
    blobs.push(Blob { cell: [-60, 30, 80], log_scales: [-30; 3], extent: 0, ..USUAL });
    // An anchor that the prefilter leaves out, of a Gaussian that would reach into the frame.
    blobs.push(Blob { cell: [0, 60, 80], log_scales: [0; 3], extent: -80, ..USUAL });
    blobs
}

fn near_and_behind() -> Vec<Blob> {
    let mut blobs = Vec::new();
    for (at, z) in (0..).zip([15, 16, 17, 18, 24]) {
        // z of 0.1875, 0.2 (not drawn), 0.2125, …
        let cell = [3 * at - 6, 2 * at - 5, z];
        blobs.push(Blob {
            cell,
            log_scales: [-40 + 2 * at as i16; 3],
            extent: -30,
            colour: [8 * at as i16, 16, -16],
            ..USUAL
        });
    }
    // Behind the camera, at it, and far away.
    blobs.push(Blob { cell: [0, 0, -40], log_scales: [16; 3], extent: 16, ..USUAL });
    blobs.push(Blob { cell: [0, 0, 0], log_scales: [0; 3], extent: 0, ..USUAL });
    blobs.push(Blob { cell: [1000, -600, 4000], log_scales: [20; 3], ..USUAL });
    blobs.push(Blob {
        cell: [100_000, 40_000, 400_000],
        log_scales: [60, 50, 40],
        extent: 60,
        colour: [16, 40, 8],
        ..USUAL
    });
    // Beside the frame near the camera: where the Jacobian's x/z and y/z are limited.
    blobs.push(Blob { cell: [60, 2, 20], log_scales: [-8, -24, -16], extent: 0, quaternion: [9, 2, 5, 1], ..USUAL });
    blobs.push(Blob { cell: [-3, -50, 22], log_scales: [-6, -20, -10], extent: 0, quaternion: [4, -2, 5, 8], ..USUAL });
    // A covariance whose determinant is beyond f32: not drawn.
    blobs.push(Blob { cell: [0, 0, 17], log_scales: [200, 200, 200], extent: 200, ..USUAL });
    blobs
}

fn layers() -> Vec<Blob> {
    let mut blobs = Vec::new();
    // Equal depths, over one another: the order of the file decides.
    for at in 0..6_i16 {
        let cell = [2 * i32::from(at) - 20, i32::from(at % 3) * 3 - 8, 80];
        blobs.push(Blob { cell, opacity: 900, colour: [40 * (at % 2), 40 - 16 * at, 24 * (at % 3) - 24], ..USUAL });
    }
    // Opaque ones over one another: the light ends after the second.
    for at in 0..5_i16 {
        let cell = [20 + i32::from(at), -10 + i32::from(at), 70 + 10 * i32::from(at)];
        blobs.push(Blob { cell, opacity: OPAQUE, log_scales: [-12; 3], colour: [16 * at, 40 - 16 * at, 8], ..USUAL });
    }
    // As faint as can be, a little fainter, and of an opacity below 0, in front of everything.
    let faint = [BARELY_VISIBLE, BARELY_INVISIBLE, -900, 0, 40];
    for (at, opacity) in (0..).zip(faint) {
        let cell = [-24 + 12 * at, 14, 60];
        blobs.push(Blob { cell, opacity, colour: [90, 90, 90], log_scales: [-14; 3], ..USUAL });
    }
    // Many faint ones in one place, each nearer than the one before.
    for at in 0..40 {
        blobs.push(Blob {
            cell: [-10, 2, 140 - at],
            opacity: 60 + 3 * at as i16,
            colour: [at as i16 - 20, 30, 60 - 3 * at as i16],
            ..USUAL
        });
    }
    blobs
}

/// The bundles.
pub fn samples() -> Vec<Sample> {
    let anisotropic = Effects { anisotropic: true, background: true, ..NO_EFFECT };
    let small = Camera { principal_px: [41.5, 17.25], focal_px: [50.0, 58.0], ..camera(71, 50) };
    // As large as the training images, with another lens.
    let turned = camera(48, 64);
    let baked = |mut draft: Draft| {
        draft.gaussians = true;
        draft
    };
    let compensated = Effects { dilation_compensation: true, ..anisotropic };
    let isotropic = Effects { anisotropic: false, ..anisotropic };
    vec![
        sample(
            "splats-of-all-shapes",
            "Needles, pancakes, specks, Gaussians larger than the frame, centres outside of it, and an anchor that the prefilter leaves out.",
            draft(&shapes_of_splats(), anisotropic),
            &[camera(64, 48), small],
        ),
        sample(
            "splats-compensated",
            "The same with dilation compensation.",
            draft(&shapes_of_splats(), compensated),
            &[camera(64, 48)],
        ),
        sample(
            "splats-isotropic",
            "The same as isotropic Gaussians of the first deviation.",
            draft(&shapes_of_splats(), isotropic),
            &[small, turned],
        ),
        sample(
            "splats-baked",
            "The same with a section gaussians: rounded, and without a prefilter.",
            baked(draft(&shapes_of_splats(), anisotropic)),
            &[camera(64, 48), small],
        ),
        sample(
            "splats-near",
            "Gaussians at the near plane, before and behind it, at and behind the camera, beside the frame, far away, and beyond f32.",
            draft(&near_and_behind(), anisotropic),
            &[camera(64, 48), small],
        ),
        sample(
            "splats-near-baked",
            "The same with a section gaussians: deviations beyond the largest half too.",
            baked(draft(&near_and_behind(), anisotropic)),
            &[camera(64, 48)],
        ),
        sample(
            "splats-in-layers",
            "Equal depths, opaque layers behind which the light ends, opacities about 1/255, 0 and below, and 40 layers in one place.",
            draft(&layers(), anisotropic),
            &[camera(64, 48), small],
        ),
    ]
}
