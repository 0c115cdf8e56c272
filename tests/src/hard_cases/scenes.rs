//! Scenes that have no volume, or no anchor.

use pocketsplat_codec::bundle::{self, WriteOptions};
use pocketsplat_format::Bundle;
use pocketsplat_kernels::scene::Scene;

use super::blobs::{Blob, Blobs};
use super::picture::{Picture, camera};
use super::{Case, Family, error, picture, unseen};
use crate::frame::{BACKGROUND, draw, info_for, to_core};

const ANSWER: &str = "\
Flat, collinear, lonely and empty scenes are drawn right. Where nothing is in the scene, the picture is the background to the bit.";

const ANALYSIS: &str = "\
Nothing here is inexact. What is flat, collinear or alone has boxes, tries and tables of zero width, and the question is whether
something divides by one. So the bounds are the usual ones. A tier or a chunk without anchors takes no place in the file
and changes no pixel.";

fn grid(cell: impl Fn(i32, i32) -> [f64; 3], n: i32) -> Blobs {
    let blob = |i: i32, j: i32| Blob {
        position: cell(i, j),
        scale: [0.05, 0.03, 0.02],
        colour: [[0.9, 0.2, 0.1], [0.1, 0.8, 0.9]][(i + j).rem_euclid(2) as usize],
        ..Blob::default()
    };
    Blobs::of((-n..n).flat_map(|i| (-n..n).map(move |j| (i, j))).map(|(i, j)| blob(i, j)))
}

fn one_anchor() -> Scene<f32> {
    Blobs::default().scene()
}

fn masked() -> Scene<f32> {
    let mut scene = Blobs { per_anchor: 2, ..Blobs::of([Blob::default(); 4]) }.scene();
    // Distinct cells, of which none is drawn.
    scene.anchors.lattice[1][0] += 1;
    scene.anchors.mask_logits.fill(-20.0);
    scene
}

/// Channels of the frame that differ from the background's.
fn not_background(bytes: &[u8]) -> f64 {
    let bundle = Bundle::parse(bytes).expect("the writer's bundle is sound");
    let (frame, _) = draw(&bundle, &to_core(&camera())).expect("drawn");
    let expected = BACKGROUND.into_iter().cycle();
    frame.rgb.iter().zip(expected).filter(|(found, expected)| *found != expected).count() as f64
}

fn write(scene: &Scene<f32>, options: &WriteOptions) -> Vec<u8> {
    bundle::write(scene, &info_for(&camera()), options).expect("a scene to be written").bytes
}

/// Pixels of a scene of few anchors in more tiers than it has anchors, against the same in one tier.
fn empty_tiers() -> f64 {
    // At depths of their own: those of equal depth are drawn in the file's order, and tiers change that.
    let scene = grid(|i, j| [f64::from(i) / 8.0, f64::from(j) / 8.0, 2.0 + f64::from(2 * i + j) / 16.0], 1).scene();
    let importance = Some((0..scene.anchors.len()).map(|i| i as f32).collect());
    let [one, many] = [vec![0.0], vec![0.99, 0.98, 0.97, 0.5, 0.4, 0.0]].map(|pruning_rates| {
        let bytes = write(
            &scene,
            &WriteOptions {
                importance: importance.clone(),
                pruning_rates,
                chunk_anchors: 1,
                ..WriteOptions::default()
            },
        );
        draw(&Bundle::parse(&bytes).expect("sound"), &to_core(&camera())).expect("drawn").0.rgb
    });
    one.iter().zip(&many).filter(|(a, b)| a != b).count() as f64
}

pub(super) fn family() -> Family {
    let cases: Vec<Case> = vec![
        picture("one anchor", "a single Gaussian", || Picture::of(one_anchor())),
        picture("flat, face on", "64 anchors in a plane across the view", || {
            Picture::of(grid(|i, j| [f64::from(i) / 8.0, f64::from(j) / 8.0, 2.0], 4).scene())
        }),
        picture("flat, edge on", "64 anchors in a plane through the camera", || {
            Picture::of(grid(|i, j| [f64::from(i) / 8.0, 0.0, 2.0 + f64::from(j) / 8.0], 4).scene())
        }),
        picture("collinear, across", "anchors on a line across the view", || {
            Picture::of(grid(|i, j| [f64::from(8 * i + j) / 64.0, 0.0, 2.0], 4).scene())
        }),
        picture("collinear, along the view", "anchors on a line through the camera", || {
            Picture::of(grid(|i, j| [0.0, 0.0, 3.0 + f64::from(8 * i + j) / 32.0], 4).scene())
        }),
        picture("one cell apart", "neighbours 10⁻⁷ apart around z = 0.8", || {
            let voxel_size = 1e-7;
            let blobs = grid(|i, j| [f64::from(i) * 1e-7, f64::from(j) * 1e-7, 0.8], 2);
            Picture::of(Blobs { voxel_size, ..blobs }.scene())
        }),
        picture("ends of the lattice", "anchors 2²¹ cells apart", || {
            let far = f64::from(1 << 20) / f64::from(1 << 20);
            let blob = |x: f64, z: f64| Blob { position: [x, 0.1 * x, z], ..Blob::default() };
            Picture::of(
                Blobs {
                    voxel_size: 1.0 / f64::from(1 << 20),
                    ..Blobs::of([blob(-far, 2.9), blob(0.0, 2.0), blob(0.999_999, 2.9)])
                }
                .scene(),
            )
        }),
        unseen("everything masked", "every offset switched off", || Picture::of(masked())),
        error("no anchor", "a scene without any", "channels that are not the background's", 0.0, || {
            let mut scene = one_anchor();
            scene.anchors = pocketsplat_kernels::scene::Anchors::default();
            not_background(&write(&scene, &WriteOptions::default()))
        }),
        error(
            "nothing drawn",
            "a scene whose masks are all closed",
            "channels that are not the background's",
            0.0,
            || not_background(&write(&masked(), &WriteOptions::default())),
        ),
        error(
            "empty tiers",
            "six tiers of four anchors in chunks of one",
            "channels that differ from one tier's",
            0.0,
            empty_tiers,
        ),
    ];
    Family { title: "Scenes", answer: ANSWER, analysis: ANALYSIS, cases }
}
