//! Needles, pancakes, specks and walls: the projection of Gaussians that are hardly three-dimensional.

use std::f64::consts::{FRAC_PI_4, FRAC_PI_8};

use glam::{DMat3, DQuat, DVec3};
use pocketsplat_capture::camera::Camera;
use pocketsplat_kernels::scene::{ModelShape, Scene};

use super::blobs::{Blob, Blobs};
use super::picture::{Figures, Picture, camera};
use super::{Case, Family, bounded, picture, unseen};

const ANSWER: &str = "\
Needles and pancakes of any ratio are drawn right: half a step of rounding, one step where a contribution of 1/255 is drawn in one
arithmetic and not in the other. Averaged over a tile, the error is at most 0.6 of a step.";

const ANALYSIS: &str = "\
A Gaussian of deviations σ₁ ≥ σ₂ px on the image has det Σ' ≈ (σ₁² + 0.3)(σ₂² + 0.3). For a needle at 45°, Σ'xx·Σ'yy − Σ'xy² is the
difference of two numbers of about σ₁⁴/4. In f32 that leaves an error of 6e-8·σ₁⁴/4 in 0.3·σ₁²: nothing is left beyond σ₁ = 4,000 px,
and a hundredth is wrong from 400 px on. So both renderers take |p × q|² for the determinant (Cauchy–Binet), whose terms are not
squared differences.

The same cancellation waits in dᵀΣ'⁻¹d at a distance d along the needle. Its terms are d²/0.6, so the conic's rounding alone moves the
exponent by 1e-7·d²: a fifth of a step of a channel at 100 px, the whole splat at 3,000 px. So both renderers draw rows with the square
completed, (dx − s·dy)²·Σ'yy/det Σ' + dy²/Σ'yy. Nothing cancels there. What is left is the rounding of s·dy, 6e-8·dy px, below a
hundredth of a deviation up to dy = 10⁵ px. That is why needles have the usual bounds.

Gradients in f32 have lost 1e-7·κ. Here κ is the number of its own widths by which a needle turns when its parameters change by
as much as themselves: up to 10⁴ for needles within the frame, hence 0.001, and 10⁵ for those that reach far beyond it.";

/// Along the image's diagonal: the x axis turned by 45° about the line of sight.
fn diagonal() -> [f32; 4] {
    [FRAC_PI_8.cos() as f32, 0.0, 0.0, FRAC_PI_8.sin() as f32]
}

fn turned(axis: DVec3, angle: f64) -> [f32; 4] {
    let q = DQuat::from_axis_angle(axis, angle);
    [q.w, q.x, q.y, q.z].map(|c| c as f32)
}

fn one(blob: Blob) -> Picture {
    Picture::of(Blobs::of([blob]).scene())
}

/// In front of something else, so that what is drawn twice or not at all shows.
fn over_a_ball(blob: Blob) -> Picture {
    let behind = Blob { position: [0.1, -0.05, 3.0], scale: [0.4; 3], colour: [0.1, 0.2, 0.9], ..Blob::default() };
    Picture::of(Blobs::of([blob, behind]).scene())
}

fn needle(long: f64, ratio: f64) -> Blob {
    Blob { scale: [long, long / ratio, long / ratio], quaternion: diagonal(), ..Blob::default() }
}

/// Needles of several directions through the frame, each with its centre `away` along its own direction.
fn passing(away: f64, long: f64, ratio: f64) -> impl Iterator<Item = Blob> {
    (0..5).map(move |i| {
        let angle = 0.3 + 0.27 * f64::from(i);
        let [x, y] = [away * angle.cos(), away * angle.sin() + 0.1 * f64::from(i) - 0.2];
        Blob {
            position: [x, y, 2.0 + f64::from(i) / 64.0],
            scale: [long, long / ratio, long / ratio],
            quaternion: turned(DVec3::Z, angle),
            colour: [0.9, 0.2 * f64::from(i) + 0.1, 0.1],
            ..Blob::default()
        }
    })
}

fn pancake(angle: f64) -> Blob {
    Blob { scale: [0.3, 0.3, 3e-7], quaternion: turned(DVec3::new(0.8, 0.6, 0.0), angle), ..Blob::default() }
}

fn compensated(blob: Blob) -> Picture {
    let effects = ModelShape { dilation_compensation: true, ..ModelShape::plain(1, 1) };
    Picture::of(Blobs { effects, ..Blobs::of([blob]) }.scene())
}

/// The same Gaussians in a scene that knows one deviation of each, the first.
fn isotropic(blobs: impl IntoIterator<Item = Blob>) -> Scene<f32> {
    Blobs { effects: ModelShape { anisotropic: false, ..ModelShape::plain(1, 1) }, ..Blobs::of(blobs) }.scene()
}

fn wall_of_specks() -> Picture {
    let speck = |i: i32, j: i32| Blob {
        position: [f64::from(i) / 64.0, f64::from(j) / 64.0, 2.0 + f64::from((i * 7 + j * 5).rem_euclid(11)) / 64.0],
        scale: [1e-5; 3],
        colour: if (i + j) % 2 == 0 { [0.9, 0.8, 0.1] } else { [0.1, 0.2, 0.8] },
        ..Blob::default()
    };
    Picture::of(Blobs::of((-24..24).flat_map(|i| (-16..16).map(move |j| speck(i, j)))).scene())
}

fn speck() -> Blob {
    Blob { scale: [1e-5; 3], ..Blob::default() }
}

fn wide(scale: f64) -> Blob {
    Blob { scale: [scale; 3], opacity_logit: 0.6, ..Blob::default() }
}

/// 1e-7·κ of needles that are turned by more than the frame is wide; see the analysis.
const STIFF: Figures = Figures { rounding: 0.01, ..Figures::USUAL };

/// Some of each kind.
pub(super) fn hardest() -> Vec<Blob> {
    let needles = [needle(0.5, 1e3), needle(1.0, 1e6), needle(100.0, 1e6)];
    let pancakes = [pancake(0.0), pancake(FRAC_PI_4), pancake(2.0 * FRAC_PI_4)];
    needles.into_iter().chain(passing(68.0, 30.0, 1e6)).chain(pancakes).chain([speck(), wide(20.0)]).collect()
}

pub(super) fn family() -> Family {
    let cases: Vec<Case> = vec![
        picture("needle 1e3", "a needle of 15 px at 45°, ratio 10³", || one(needle(0.5, 1e3))),
        picture("needle 1e6", "a needle of 30 px at 45°, ratio 10⁶", || over_a_ball(needle(1.0, 1e6))),
        bounded("screen-long needle", "3,000 px at 45°, ratio 10⁶, through the middle", STIFF, || {
            over_a_ball(needle(100.0, 1e6))
        }),
        bounded("passing needles", "900 px, ratio 10⁶, centres 2,000 px outside, five directions", STIFF, || {
            Picture::of(Blobs::of(passing(68.0, 30.0, 1e6)).scene())
        }),
        bounded("passing needles, near", "120 px, ratio 10⁴, centres 250 px outside", STIFF, || {
            Picture::of(Blobs::of(passing(8.5, 4.0, 1e4)).scene())
        }),
        picture("needle along the view", "ratio 10⁶, seen end-on: a point with a tail in depth", || {
            one(Blob { scale: [1e-6, 1e-6, 1.0], ..Blob::default() })
        }),
        picture("needle, compensated", "90 px by 0.05 px at 45°, opacity scaled by its area", || {
            compensated(Blob { opacity_logit: 3.0, ..needle(3.0, 2e3) })
        }),
        unseen("needle, compensated away", "ratio 10⁶: compensation leaves less than 1/255", || {
            compensated(needle(0.3, 1e6))
        }),
        picture("pancake, face on", "ratio 10⁶", || one(pancake(0.0))),
        picture("pancake, oblique", "ratio 10⁶, turned by 45°", || one(pancake(FRAC_PI_4))),
        picture("pancake, grazing", "ratio 10⁶, a milliradian from its edge", || {
            one(pancake(2.0 * FRAC_PI_4 - 1e-3))
        }),
        picture("pancake, edge on", "ratio 10⁶", || one(pancake(2.0 * FRAC_PI_4))),
        picture("speck", "a deviation of 3·10⁻⁴ px: the dilation alone is seen", || over_a_ball(speck())),
        unseen("speck, compensated", "the same with opacity scaled by its area: nothing is left", || {
            compensated(speck())
        }),
        picture("dust", "1,536 specks, each its own pixel", wall_of_specks),
        picture("wide", "600 px in a frame of 48", || over_a_ball(wide(20.0))),
        picture("wide and far", "a deviation of 6,000 px around a centre 3,000 px outside", || {
            over_a_ball(Blob { position: [100.0, -40.0, 2.0], ..wide(200.0) })
        }),
        picture(
            "anchors like needles",
            "six of up to 72,000 px by 0.03 px askew, which the prefilter has to keep",
            || {
                let position = |i: i32| [f64::from(i) / 10.0 - 0.25, 0.0, 2.0 + f64::from(i) / 64.0];
                let mut scene = Blobs::of((0..6).map(|i| Blob { position: position(i), ..Blob::default() })).scene();
                for (i, log_scales) in scene.anchors.log_scales.chunks_exact_mut(6).enumerate() {
                    let long = 400.0 * (i as f32 + 1.0);
                    log_scales[..3].copy_from_slice(&[long.ln(), 1e-3_f32.ln(), 1e-3_f32.ln()]);
                }
                Picture::of(scene).through(Camera { rotation: DMat3::from_rotation_z(0.72), ..camera() })
            },
        ),
        picture("huge and far", "a deviation of 140,000 px around a centre 100,000 px outside", || {
            let camera = Camera { focal_px: [300.0; 2], ..camera() };
            Picture::of(Blobs::of([Blob { position: [200.0, 0.2, 0.6], ..wide(280.0) }]).scene()).through(camera)
        }),
        picture("isotropic specks", "five of 3·10⁻⁴ px, in an isotropic scene", || {
            let position = |i: i32| [f64::from(i) / 8.0, f64::from(i) / 16.0, 2.0];
            Picture::of(isotropic((-2..=2).map(|i| Blob { position: position(i), ..speck() })))
        }),
        picture("isotropic and wide", "600 px in a frame of 48, half of it from a centre 3,000 px outside", || {
            let beside = Blob { position: [100.0, -40.0, 2.0], ..wide(200.0) };
            Picture::of(isotropic([wide(20.0), beside]))
        }),
        picture(
            "no isotropic needle",
            "a needle and a pancake of ratio 10⁶ whose scene is isotropic: round Gaussians, of anchors like needles",
            || {
                let mut scene = isotropic([needle(0.1, 1e6), Blob { position: [0.2, 0.1, 2.5], ..pancake(FRAC_PI_4) }]);
                for log_scales in scene.anchors.log_scales.chunks_exact_mut(scene.shape.n_log_scales()) {
                    log_scales[..3].copy_from_slice(&[400_f32.ln(), 1e-3_f32.ln(), 1e-3_f32.ln()]);
                }
                Picture::of(scene)
            },
        ),
    ];
    Family { title: "Shapes of splats", answer: ANSWER, analysis: ANALYSIS, cases }
}
