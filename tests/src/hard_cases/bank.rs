//! Features that the view mixes: weights at their ends, logits beyond halves, a camera at the anchor.

use glam::{DMat3, DVec3};
use pocketsplat_capture::camera::Camera;
use pocketsplat_trainer::ops::{Pinhole, feature_bank};
use pocketsplat_trainer::scene::{Head, ModelShape, Scene};

use super::blobs::{Blob, Blobs};
use super::picture::{Picture, camera};
use super::{Case, Family, error, n_not_finite, picture, refusal};
use crate::frame::info_for;

const ANALYSIS: &str = "\
Three weights, softmax of a small head's outputs, mix three copies of a feature. The largest output is taken off all before the
exponential, so none overflows however large they are, the sum lies between 1 and 3, and a weight of nothing is 10⁻³⁸ in
the decoder, whose exponential ends at −87, and 0 in the oracle: times a feature that is no difference to any picture. A
derivative of a saturated softmax is w·(1 − w) and vanishes as it should. Outputs of 10⁹ have a rounding of 64 in f32, so which of two
is the larger is only known where they are farther apart than that; here they are. At the camera itself there is no direction,
and all of it is 0. The bounds are the usual ones.";

/// Four anchors of four colours, whose features differ, and a bank of weights that `edit` sets.
fn banked(edit: impl Fn(&mut Head<f32>)) -> Picture {
    let blob = |i: i32| Blob {
        position: [f64::from(i % 2) / 3.0 - 0.2, f64::from(i / 2) / 4.0 - 0.1, 1.5 + f64::from(i) / 5.0],
        scale: [0.2, 0.1, 0.15],
        colour: [[0.9, 0.2, 0.1], [0.1, 0.8, 0.3], [0.2, 0.3, 0.9], [0.8, 0.7, 0.2]][i as usize],
        ..Blob::default()
    };
    let effects = ModelShape { feature_bank: true, ..ModelShape::plain(1, 1) };
    let mut scene = Blobs { effects, ..Blobs::of((0..4).map(blob)) }.scene();
    if let Some(bank) = &mut scene.heads.bank {
        for (i, weight) in bank.w1.iter_mut().chain(&mut bank.w2).enumerate() {
            *weight = ((i * 7 + 3) % 11) as f32 / 11.0 - 0.35;
        }
        bank.b1 = vec![0.3, -0.2, 0.4, 0.1];
        edit(bank);
    }
    Picture::of(scene)
}

/// A weight of 1 and two of nothing, the outputs being up to 3·10⁹.
fn saturated(of: usize) -> Picture {
    banked(|bank| {
        bank.w1.fill(0.0);
        bank.b1.fill(60_000.0);
        bank.w2.fill(-16_000.0);
        bank.w2[4 * of..4 * of + 4].fill(16_000.0);
    })
}

/// Numbers of mixed features that are not finite, seen from the anchor itself, one ulp from it and 10¹⁵ units away.
fn at_the_camera() -> f64 {
    let Scene { heads, .. } = banked(|bank| bank.w2.iter_mut().for_each(|weight| *weight *= 1e5)).scene;
    let bank = heads.bank.expect("the scene has one");
    let eye = DVec3::new(0.3, -0.2, 0.7);
    let turn = DMat3::from_rotation_y(0.4);
    let pinhole = Pinhole::<f32>::new(&Camera { rotation: turn, translation: -(turn * eye), ..camera() });
    let [x, y, z] = pinhole.centre_world;
    let positions = [[x, y, z], [x.next_up(), y, z], [x, y + 1e-23, z], [x, y, 1e15]];
    let features = [1.0, -2.0, 0.5, 3.0].repeat(positions.len());
    let (mut kept, mut mixed) = (feature_bank::Kept::default(), Vec::new());
    feature_bank::forward(&bank, &pinhole, &positions, &features, &mut kept, &mut mixed);
    let (mut d_features, mut d_bank) = (vec![0.0; features.len()], bank.map(|_| 0.0));
    feature_bank::backward(&bank, &features, &kept, &mixed, &mut d_features, &mut d_bank);
    n_not_finite(mixed.into_iter().chain(d_features).chain(d_bank.groups().concat()))
}

/// What the writer says to a scene of `n` features and a bank.
fn writing(n: usize) -> String {
    let blob =
        |i: usize| Blob { position: [0.1 * i as f64, 0.0, 2.0], colour: [0.1 + 0.1 * i as f64; 3], ..Blob::default() };
    let effects = ModelShape { feature_bank: true, ..ModelShape::plain(1, 1) };
    let scene = Blobs { effects, ..Blobs::of((0..n).map(blob)) }.scene();
    let written = pocketsplat_trainer::bundle::write(&scene, &info_for(&camera()), &Default::default());
    written.map_or_else(|error| error.to_string(), |_| "accepted".to_owned())
}

pub(super) fn family() -> Family {
    let cases: Vec<Case> = vec![
        picture("features mixed by the view", "four anchors, each with weights of its own", || banked(|_| ())),
        picture("all weight on the whole", "outputs of ±3·10⁹, features stay as they are", || saturated(2)),
        picture("all weight on the fourth", "the same for one number in four", || saturated(0)),
        picture("even weights", "a head of zeros behind its first layer", || banked(|bank| bank.w2.fill(0.0))),
        error(
            "a camera at the anchor",
            "distance 0, one ulp, and 10¹⁵",
            "features or gradients that are not finite",
            0.0,
            at_the_camera,
        ),
        refusal(
            "a feature without a fourth",
            "six features and a bank",
            "the bundle's writer",
            "a multiple of 4",
            || writing(6),
        ),
    ];
    Family { title: "Feature bank", analysis: ANALYSIS, cases }
}
