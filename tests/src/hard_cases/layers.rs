//! Order and transmittance: equal depths, hundreds of opaque layers, thousands of faint ones.

use glam::{DMat3, DVec3};
use pocketsplat_capture::camera::Camera;

use super::blobs::{Blob, Blobs, logit_of_opacity};
use super::picture::{Figures, Picture, camera};
use super::{Case, Family, bounded, picture, unseen};

const ANSWER: &str = "\
Thousands of layers are drawn right. The exceptions are pixels where the stop rule decides: there the last of many opaque layers may be
drawn in one arithmetic and not in the other, which is 2.5 steps at most, over a whole tile if the layers cover it.";

const ANALYSIS: &str = "\
Front to back, C = Σ cᵢαᵢTᵢ. The weights αᵢTᵢ sum to 1 at most, so an error δ of every alpha changes C by at most max δ/α times the
contrast of neighbouring layers. The logarithm of an opacity keeps 2⁻¹² in the decoder's memory, 0.13 % of an alpha of 1/200. So
thousands of faint layers err by a third of a step, and f32's sums by 3,000·6e-8 besides. The stop rule keeps transmittance at 10⁻⁴ or
more, so it never comes near the subnormals, however many layers there are.

The stop rule is a jump. A splat that is the first to be dropped in one arithmetic and drawn in the other has a weight of at most 0.99·T
with T(1 − 0.99) = 10⁻⁴, that is 0.0099, or 2.5 steps. Two layers at the limit of 0.99 meet that point exactly: f32 and f64 round 0.01²
to different sides of 10⁻⁴. So opaque stacks have a bound of 2.5 steps more, and a tile of them as much on average. Layers of opacity 0.9
meet the same point with the fourth, whose weight is 0.0009: a quarter step. Gradients follow the stop rule too. In such stacks one layer
has a gradient in one arithmetic and none in the other, so they are judged against the larger bound of 1.

Where depths are equal, all three renderers keep the order of the file. Where they are equal but for rounding, no f32 renderer can know
the order; the decoder's picture then has to be that of a camera turned by 10⁻⁶ one way or the other. An opacity within 0.13 % of
1/255 may draw its splat or not, which is a step in all of a tile.";

const COLOURS: [[f64; 3]; 3] = [[0.95, 0.1, 0.1], [0.1, 0.9, 0.2], [0.05, 0.1, 0.95]];

/// Layers one behind the other, wide enough to cover the frame evenly.
fn layers(n: usize, opacity_logit: f32, spacing: f64) -> Picture {
    let layer = |i: usize| Blob {
        position: [0.0, 0.0, 1.5 + spacing * i as f64],
        scale: [20.0, 20.0, 1e-3],
        opacity_logit,
        colour: COLOURS[i % 3],
        ..Blob::default()
    };
    Picture::of(Blobs { voxel_size: 1.0 / 4096.0, ..Blobs::of((0..n).map(layer)) }.scene())
}

/// One of many narrow layers, each of them somewhere else: every pixel has its own stack.
fn scattered_layer(i: usize, opacity_logit: f32) -> Blob {
    Blob {
        position: [(i * 37 % 64) as f64 / 80.0 - 0.4, (i * 23 % 48) as f64 / 80.0 - 0.3, 1.5 + i as f64 / 512.0],
        scale: [0.12, 0.08, 0.1],
        opacity_logit,
        colour: COLOURS[i % 3],
        ..Blob::default()
    }
}

fn scattered(n: usize, opacity_logit: f32) -> Picture {
    Picture::of(Blobs::of((0..n).map(|i| scattered_layer(i, opacity_logit))).scene())
}

/// Faint and opaque ones.
pub(super) fn hardest() -> Vec<Blob> {
    let opacity_logit = |i: usize| if i.is_multiple_of(5) { 40.0 } else { 0.01 };
    (0..120).map(|i| scattered_layer(i, opacity_logit(i))).collect()
}

fn coincident() -> Picture {
    let blob = |i: usize| Blob { colour: COLOURS[i], scale: [0.2; 3], ..Blob::default() };
    Picture::of(Blobs { per_anchor: 3, ..Blobs::of((0..3).map(blob)) }.scene())
}

fn equal_depths() -> Picture {
    let blob = |i: i32| Blob {
        position: [f64::from(i - 4) / 32.0, f64::from(i % 3) / 64.0, 2.0],
        scale: [0.15; 3],
        colour: COLOURS[(i % 3) as usize],
        ..Blob::default()
    };
    Picture::of(Blobs::of((0..9).map(blob)).scene())
}

/// Two splats in a plane that a turned camera faces exactly: which is nearer is a matter of the last bit.
fn equal_but_for_rounding() -> Picture {
    let turn = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(-0.4);
    // Both on the line that the camera's x axis follows through the pivot.
    let blob = |i: i32| {
        let position = turn.transpose() * DVec3::new(0.1 * f64::from(i), 0.0, 2.0);
        Blob { position: position.to_array(), scale: [0.2; 3], colour: COLOURS[(i + 1) as usize], ..Blob::default() }
    };
    let scene = Blobs { voxel_size: 1.0 / f64::from(1 << 21), ..Blobs::of([blob(-1), blob(1)]) }.scene();
    let turned = |angle: f64| Camera { rotation: DMat3::from_rotation_y(angle) * turn, ..camera() };
    Picture { nearby: vec![turned(1e-6), turned(-1e-6)], ..Picture::of(scene).through(turned(0.0)) }
}

/// A layer of weight 0.0099 more or less at the end of the stack.
const OPAQUE: Figures = Figures { decoder: 4.0, tile: 3.1, trainer: 3.6, rounding: 1.0, ..Figures::USUAL };
/// The same of weight 0.0009.
const STRONG: Figures = Figures { decoder: 2.0, tile: 0.85, trainer: 1.3, rounding: 1.0, ..Figures::USUAL };
/// The logarithms' rounding adds up to a third of a step.
const FAINT: Figures = Figures { decoder: 2.0, tile: 0.9, ..Figures::USUAL };
/// Rims of more than a hundred splats in a pixel: that three of them differ is rare.
const RIMS: Figures = Figures { decoder: 3.5, tile: 0.75, ..Figures::USUAL };
/// A whole splat of 1/255.
const CUTOFF: Figures = Figures { tile: 1.5, ..Figures::USUAL };

pub(super) fn family() -> Family {
    let cases: Vec<Case> = vec![
        picture("coincident", "three Gaussians of one anchor in one place", coincident),
        picture("equal depths", "nine overlapping splats at exactly the same depth", equal_depths),
        bounded(
            "equal but for rounding",
            "two splats whose depths differ by 10⁻⁸",
            Figures { rounding: 1.0, ..Figures::USUAL },
            equal_but_for_rounding,
        ),
        bounded("opaque layers", "300 layers that cover the frame at the limit of alpha", OPAQUE, || {
            layers(300, 40.0, 0.01)
        }),
        bounded("scattered opaque layers", "400 small splats at the limit of alpha", OPAQUE, || scattered(400, 40.0)),
        bounded("strong layers", "300 layers of opacity 0.9", STRONG, || layers(300, logit_of_opacity(0.9), 0.01)),
        bounded("faint layers", "3,000 layers of opacity 0.0045", FAINT, || layers(3000, 0.0045, 1e-3)),
        bounded("scattered faint layers", "2,000 small splats of opacity 0.02", RIMS, || scattered(2000, 0.02)),
        unseen("fainter than a step", "300 layers of opacity 0.0039, each below 1/255", || layers(300, 0.0039, 0.01)),
        bounded("at the cutoff", "an opacity one part in 10⁴ above 1/255", CUTOFF, || layers(1, 0.003_922, 0.01)),
        picture("opacity 1", "a logit of 40: tanh is 1, alpha stays at 0.99", || layers(1, 40.0, 0.01)),
        unseen("opacity 0", "a logit of 0", || layers(3, 0.0, 0.01)),
        unseen("opacity below 0", "a logit of −40,000", || layers(3, -40_000.0, 0.01)),
    ];
    Family { title: "Order and transmittance", answer: ANSWER, analysis: ANALYSIS, cases }
}
