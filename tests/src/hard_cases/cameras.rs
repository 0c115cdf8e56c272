//! Where the camera stands: inside splats, on the near plane, very near, very far.

use glam::{DMat3, DVec3};
use pocketsplat_capture::camera::Camera;
use pocketsplat_kernels::scene::ModelShape;

use super::blobs::{Blob, Blobs};
use super::picture::{Figures, Picture, camera};
use super::{Case, Family, bounded, picture, unseen};

const ANSWER: &str = "\
Any camera is drawn right, inside a splat, beside it or far away through a long lens. Whether a centre on the near plane is drawn is
decided exactly, to one ulp.";

const ANALYSIS: &str = "\
The camera's transform is a sum of three products and a translation. A point comes out with an error of 2·6e-8·(|p| + |t|), which the
projection multiplies by f/z. Near the near plane, z = 0.2, that factor is 300 px per unit for a camera of 60 px, and the error is
negligible. A long lens far away is where it shows: 3·10⁴ px at distance 10³ move by 0.004 px.

The near plane is one comparison with the f32 nearest to 0.2, in the oracle too, so no tolerance is granted. Slopes beyond 0.15 image
sizes outside of the image are clamped, which keeps the Jacobian of centres beside the camera finite. The clamp is a kink, not a jump, so the usual bounds
hold. View direction and distance are computed only for anchors in front of the camera, at least 0.2 away. A distance of 0 is
therefore guarded in the trainer's operation alone (`distance 0`, under arithmetic).";

const EFFECTS: ModelShape =
    ModelShape { view_colour: true, view_geometry: true, view_distance: true, ..ModelShape::plain(1, 1) };

fn at(z: f64, scale: f64) -> Blob {
    Blob { position: [0.01, -0.02, z], scale: [scale; 3], ..Blob::default() }
}

fn with_background_ball(blob: Blob) -> Picture {
    let behind = Blob { position: [-0.2, 0.1, 3.0], scale: [0.3; 3], colour: [0.1, 0.8, 0.3], ..Blob::default() };
    Picture::of(Blobs { effects: EFFECTS, ..Blobs::of([blob, behind]) }.scene())
}

/// An anchor at the origin, seen by a camera that stands `depth` before it; an f32.
fn at_depth(depth: f32) -> Picture {
    let blob = Blob { position: [0.0; 3], scale: [0.02; 3], ..Blob::default() };
    let camera = Camera { translation: DVec3::new(0.0, 0.0, f64::from(depth)), ..camera() };
    // The heads see the view, so that the prefilter decides about the anchor; otherwise offsets are asked, and to move one that
    // lies on the plane has no derivative.
    Picture::of(Blobs { effects: EFFECTS, ..Blobs::of([blob]) }.scene()).through(camera)
}

/// The same lens looking from `eye` at the origin.
fn from(eye: DVec3, focal_px: f64) -> Camera {
    Camera { focal_px: [focal_px; 2], ..camera() }.looking_at(eye, DVec3::ZERO, DVec3::Z)
}

fn cluster() -> Blobs {
    let blob = |i: i32| Blob {
        position: [f64::from(i % 5) / 8.0 - 0.25, f64::from(i / 5 % 5) / 8.0 - 0.25, f64::from(i * 3 % 7) / 8.0 - 0.4],
        scale: [0.08, 0.03, 0.05],
        quaternion: [0.9, 0.1 * (i % 3) as f32, 0.3, -0.2],
        colour: [[0.9, 0.2, 0.1], [0.2, 0.8, 0.3], [0.3, 0.3, 0.9]][(i % 3) as usize],
        ..Blob::default()
    };
    Blobs::of((0..25).map(blob))
}

/// Half an ulp of 10³ moves the picture by 0.004 px, of splats as narrow as 1 px.
const FAR: Figures = Figures { decoder: 2.0, tile: 0.7, trainer: 1.5, ..Figures::USUAL };

pub(super) fn family() -> Family {
    let cases: Vec<Case> = vec![
        picture("inside a splat", "a centre 0.3 ahead, a deviation of 2", || with_background_ball(at(0.3, 2.0))),
        picture("inside, centre behind", "a deviation of 5 around a centre 1 behind: not drawn", || {
            with_background_ball(at(-1.0, 5.0))
        }),
        picture("grazing the near plane", "a centre 10⁻³ beyond it", || with_background_ball(at(0.201, 0.05))),
        picture("just beyond the near plane", "one ulp beyond it: drawn", || at_depth(0.2_f32.next_up())),
        unseen("on the near plane", "exactly on it: not drawn", || at_depth(0.2)),
        unseen("just before the near plane", "one ulp before it", || at_depth(0.2_f32.next_down())),
        unseen("at the camera", "an anchor where the camera stands, view distance 0", || {
            let blob = Blob { position: [0.0; 3], scale: [1.0; 3], ..Blob::default() };
            Picture::of(Blobs { effects: EFFECTS, ..Blobs::of([blob]) }.scene())
        }),
        picture("beside the camera", "a centre at slope 15, a deviation of 1.5", || {
            with_background_ball(Blob { position: [3.2, 0.4, 0.21], scale: [1.5; 3], ..Blob::default() })
        }),
        bounded("long lens", "30,000 px focal length at distance 1,000", FAR, || {
            Picture::of(cluster().scene()).through(from(DVec3::new(600.0, -700.0, 387.3), 3e4))
        }),
        picture("wide lens", "4 px focal length: 161° across", || {
            Picture::of(cluster().scene()).through(from(DVec3::new(0.4, -0.6, 0.3), 4.0))
        }),
        picture("principal point far outside", "2,400 px to the left, the scene as far to the right", || {
            let blob = Blob { position: [20.0, 0.0, 0.5], scale: [0.05; 3], ..Blob::default() };
            let camera = Camera { principal_px: [24.0 - 2400.0, 16.0], ..camera() };
            Picture::of(Blobs::of([blob]).scene()).through(camera)
        }),
        picture("looking straight down", "the line of sight along an axis of the lattice", || {
            let rotation = DMat3::from_cols(DVec3::X, -DVec3::Y, -DVec3::Z);
            Picture::of(cluster().scene()).through(Camera {
                rotation,
                translation: DVec3::new(0.0, 0.0, 2.0),
                ..camera()
            })
        }),
        unseen("a view that sees nothing", "the scene behind the camera", || {
            Picture::of(cluster().scene()).through(Camera { translation: DVec3::new(0.0, 0.0, -9.0), ..camera() })
        }),
        picture("one pixel", "a frame of 1 × 1", || {
            let camera = Camera { width_px: 1, height_px: 1, principal_px: [0.5, 0.5], ..camera() };
            Picture::of(Blobs::default().scene()).through(camera)
        }),
    ];
    Family { title: "Cameras", answer: ANSWER, analysis: ANALYSIS, cases }
}
