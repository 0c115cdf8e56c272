//! What has no answer, and has to be refused by name.

use std::f32::consts::PI;

use glam::DVec3;
use pocketsplat_capture::dataset::{self, LoadOptions};
use pocketsplat_codec::bundle::{self, WriteOptions};
use pocketsplat_format::{Bundle, Rotation};
use pocketsplat_kernels::scene::Scene;

use super::blobs::{Blob, Blobs};
use super::picture::camera;
use super::{Case, Family, captures, refusal, training};
use crate::frame::{bundle_of, draw, info_for, to_core};

const ANSWER: &str = "\
A number that is not one, or that the format has no place for, is refused with its place and what was found.";

const ANALYSIS: &str = "\
Such a number can only come from damage or divergence, and there is no picture to bound. Photographs are bytes, so no pixel of one can
be such a number.";

fn scene() -> Scene<f32> {
    let blob = |i: i32| Blob { position: [f64::from(i) / 8.0, 0.0, 2.0], ..Blob::default() };
    Blobs::of((0..4).map(blob)).scene()
}

fn writing(edit: impl Fn(&mut Scene<f32>)) -> String {
    let mut scene = scene();
    edit(&mut scene);
    let written = bundle::write(&scene, &info_for(&camera()), &WriteOptions::default());
    written.map_or_else(|error| error.to_string(), |_| "accepted".to_owned())
}

fn drawing(edit: impl Fn(&mut pocketsplat_core::Camera)) -> String {
    let bytes = bundle_of(&scene(), &camera());
    let mut core = to_core(&camera());
    edit(&mut core);
    let drawn = draw(&Bundle::parse(&bytes).expect("the writer's bundle is sound"), &core);
    drawn.map_or_else(|error| error.to_string(), |_| "accepted".to_owned())
}

fn loading(edit: impl Fn(usize, [[f64; 4]; 4]) -> [[f64; 4]; 4]) -> String {
    let folder = tempfile::tempdir().expect("a temporary folder");
    captures::write(folder.path(), edit);
    dataset::load(folder.path(), &LoadOptions::default())
        .map_or_else(|error| error.to_string(), |_| "accepted".to_owned())
}

pub(super) fn family() -> Family {
    let writer = "the bundle's writer";
    let cases: Vec<Case> = vec![
        refusal("NaN in a weight", "a head that diverged", writer, "does not fit half precision", || {
            writing(|scene| scene.heads.colour.b2[0] = f32::NAN)
        }),
        refusal("infinite weight", "a weight beyond a half", writer, "does not fit half precision", || {
            writing(|scene| scene.heads.opacity.w2[0] = 70_000.0)
        }),
        refusal("NaN in an anchor", "a log-scale that diverged", writer, "is not finite", || {
            writing(|scene| scene.anchors.log_scales[7] = f32::NAN)
        }),
        refusal("infinite offset", "an offset that diverged", writer, "is not finite", || {
            writing(|scene| scene.anchors.offsets[4] = f32::NEG_INFINITY)
        }),
        refusal("symbol beyond 16 bits", "a feature at 32,768 steps", writer, "use a larger step", || {
            writing(|scene| scene.anchors.features[0] = 3276.8)
        }),
        refusal("two anchors in a cell", "a lattice cell taken twice", writer, "share the lattice cell", || {
            writing(|scene| scene.anchors.lattice[1] = scene.anchors.lattice[0])
        }),
        refusal("lattice too wide", "anchors 2²² cells apart", writer, "use a larger voxel size", || {
            writing(|scene| scene.anchors.lattice[1][0] += 1 << 22)
        }),
        refusal("NaN in a camera", "a pose that is none", "the decoder", "camera", || {
            drawing(|camera| {
                let mut rows = camera.rotation.to_array();
                rows[4] = f32::NAN;
                camera.rotation = Rotation::new_unchecked(rows);
            })
        }),
        refusal("negative focal length", "a lens that is none", "the decoder", "focal", || {
            drawing(|camera| camera.focal_px[1] = -PI)
        }),
        refusal(
            "NaN in the background",
            "a colour behind everything that is none",
            "the trainer",
            "the background became NaN",
            || training::diverging(|capture, _| capture.background[1] = f32::NAN),
        ),
        refusal("a learning rate of 10⁴", "a spike in the configuration", "the trainer", "needs 0 to 10", || {
            training::diverging(|_, config| config.rates.offset.start = 1e4)
        }),
        refusal("NaN in poses", "six poses of eight with a NaN", "the loader", "needed: finite numbers", || {
            loading(|index, mut rows| {
                if index > 1 {
                    rows[1][3] = f64::NAN;
                }
                rows
            })
        }),
        refusal("cameras in one place", "poses that give the scene no scale", "the loader", "no scale", || {
            loading(|_, mut rows| {
                for (row, x) in rows.iter_mut().zip(DVec3::ONE.to_array()) {
                    row[3] = x;
                }
                rows
            })
        }),
    ];
    Family { title: "Refusals", answer: ANSWER, analysis: ANALYSIS, cases }
}
