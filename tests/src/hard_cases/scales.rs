//! Sizes at both ends of half precision and beyond, and quaternions that are none.

use super::blobs::{Blob, Blobs};
use super::picture::{Figures, Picture};
use super::{Case, Family, bounded, picture, unseen};

const ANSWER: &str = "\
Sizes from 10⁻⁴⁵ to 10⁸ px and quaternions of any length are drawn right. A Gaussian beyond 4·10⁹ px is not drawn: a rule of the format,
because nothing that a capture shows comes within six orders of it.";

const ANALYSIS: &str = "\
Sizes are exponentials of coded logarithms, so their relative error is that of the exponential, 2e-7, at any size. Arguments beyond −87
and 88 are clamped in decoder and oracle, where eˣ leaves the normal numbers. On the image a size appears only squared beside
the dilation (0.3 px² at the training size): below 10⁻⁴ px there is the dilation alone. At the other end Σ' grows with the square of a deviation and det Σ' with its fourth
power, which leaves f32 at 4·10⁹ px. The decoder keeps inverse variances with eleven bits and six of exponent, down to
deviations of 1.5·10⁹ px. Halves would end at 60,000 px, and a splat as large whose rim crosses the frame would come out as another one.

A quaternion is divided by its norm or by 10⁻¹², whichever is larger. Products of components above 10⁻¹² are normal f32, so no norm
underflows on the way. Below the floor the rotation comes out as the identity, except for terms of the size of the quotient. At the
floor a gradient is that of a quotient by 10⁻¹². It is large, and no finite difference can check it: a step of 10⁻¹⁰, which f64 can
still tell from none, already turns the Gaussian.";

fn one(blob: Blob) -> Picture {
    let behind = Blob { position: [0.1, -0.05, 3.0], scale: [0.4; 3], colour: [0.1, 0.2, 0.9], ..Blob::default() };
    Picture::of(Blobs::of([blob, behind]).scene())
}

fn sized(scale: f64) -> Picture {
    one(Blob { scale: [scale; 3], opacity_logit: 0.7, ..Blob::default() })
}

/// An ellipsoid of distinct axes, so that its rotation shows.
fn turned(quaternion: [f32; 4]) -> Blob {
    Blob { scale: [0.3, 0.1, 0.03], quaternion, ..Blob::default() }
}

/// The same with weights of the covariance head as small as `gain` lets.
fn rotated(quaternion: [f32; 4], gain: f32) -> Picture {
    Picture::of(Blobs { gains: [1.0, gain, 1.0], ..Blobs::of([turned(quaternion)]) }.scene())
}

/// Of all sizes and rotations.
pub(super) fn hardest() -> Vec<Blob> {
    let sized = [1e-20, 65_504.0, 3e6].map(|scale| Blob { scale: [scale; 3], opacity_logit: 0.05, ..Blob::default() });
    let quaternions = [[0.0; 4], [6e-7, 6e-7, 0.0, -6e-7], [4e4, -3e4, 1e4, 2e4], [0.0, 0.6, 0.8, 0.0]];
    sized.into_iter().chain(quaternions.map(turned)).collect()
}

/// No differences: nothing is smooth there.
const FLOOR: Figures = Figures { differences: f64::INFINITY, ..Figures::USUAL };

pub(super) fn family() -> Family {
    let cases: Vec<Case> = vec![
        picture("smallest half", "a size of 6·10⁻⁸", || sized(6e-8)),
        picture("below the smallest half", "a size of 10⁻²⁰", || sized(1e-20)),
        picture("below the smallest float", "a size of 10⁻⁴⁵: the exponential is clamped", || sized(1e-45)),
        picture("largest half", "a size of 65,504: 2·10⁶ px", || sized(65_504.0)),
        picture("beyond the largest half", "a size of 3·10⁶: 10⁸ px, its inverse square below every half", || {
            sized(3e6)
        }),
        unseen("beyond f32", "a size of 10⁹: 3·10¹⁰ px, whose determinant no f32 holds", || {
            Picture::of(Blobs::of([Blob { scale: [1e9; 3], ..Blob::default() }]).scene())
        }),
        picture("one axis beyond", "10⁵ by 10⁻² by 10⁻²", || {
            one(Blob { scale: [1e5, 1e-2, 1e-2], ..Blob::default() })
        }),
        picture("one axis below", "0.3 by 0.1 by 10⁻³⁰", || {
            one(Blob { scale: [0.3, 0.1, 1e-30], ..Blob::default() })
        }),
        bounded("zero quaternion", "no rotation at all", FLOOR, || rotated([0.0; 4], 1.0)),
        bounded("denormal quaternion", "weights of 6·10⁻⁸, the smallest half, on units of as much", FLOOR, || {
            rotated([4e-15, 2e-15, 1e-15, -3e-15], 6e-8)
        }),
        picture("tiny quaternion", "a length of 10⁻⁶", || rotated([6e-7, 6e-7, 0.0, -6e-7], 1.0)),
        picture("huge quaternion", "components of 40,000", || rotated([4e4, -3e4, 1e4, 2e4], 1.0)),
        picture("negative quaternion", "−q instead of q", || rotated([-0.7, 0.3, -0.2, 0.5], 1.0)),
        picture("half a turn", "w = 0, where the sign of the axis is free", || rotated([0.0, 0.6, 0.8, 0.0], 1.0)),
    ];
    Family { title: "Sizes and rotations", answer: ANSWER, analysis: ANALYSIS, cases }
}
