//! Scenes whose right side is known: surfaces of flat, opaque Gaussians with z up.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};
use pocketsplat_capture::camera::Camera;
use pocketsplat_gaussians::{Degree, Gaussians};

use super::bulk::Bulk;
use super::up::Up;
use super::views::{Side, Stand, camera};

/// Small opaque ones at these places.
pub(super) fn at(places: impl IntoIterator<Item = DVec3>) -> Gaussians {
    let centres: Vec<[f32; 3]> = places.into_iter().map(|p| p.as_vec3().to_array()).collect();
    let n = centres.len();
    Gaussians {
        centres,
        log_scales: vec![[-3.0; 3]; n],
        rotations: vec![[1.0, 0.0, 0.0, 0.0]; n],
        opacity_logits: vec![2.0; n],
        harmonics: vec![[0.5; 3]; n],
        ..Gaussians::default()
    }
}

/// Cameras around these.
pub(super) fn stand_around(gaussians: &Gaussians) -> Stand {
    let bulk = Bulk::of(gaussians).expect("something opaque");
    Stand { bulk, up: Up::PLUS_Z, side: Side::Around, above_ground: false, front: 0.0 }
}

/// A scene, how it was made to be seen, and the cameras that saw it.
pub(super) struct TestScene {
    pub(super) name: &'static str,
    pub(super) gaussians: Gaussians,
    pub(super) side: Side,
    /// Whether a ground hides it from below.
    pub(super) has_ground: bool,
    pub(super) cameras: Vec<Camera>,
}

const VIEW_PX: u32 = 64;
const N_VIEWS: u32 = 48;

/// Collects surfaces.
#[derive(Default)]
struct Painter(Gaussians);

impl Painter {
    /// `n` Gaussians of one size on a surface of this area; `point` has a place and a normal for each (u, v) in 0..1.
    fn surface(&mut self, n: u32, area: f64, point: impl Fn(f64, f64) -> (DVec3, DVec3)) {
        let deviation = 0.6 * (area / f64::from(n)).sqrt();
        for i in 0..n {
            // Roberts' sequence.
            let [u, v] = [0.754_877_666_2, 0.569_840_290_998].map(|step: f64| (0.5 + step * f64::from(i)).fract());
            let (place, normal) = point(u, v);
            let turn = DQuat::from_rotation_arc(DVec3::Z, normal.normalize());
            let check = (3.0 * place.x).sin() * (3.0 * place.y).sin() * (3.0 * place.z + 0.7).sin();
            let colour = DVec3::new(0.8 * check, 0.4 * (place.z + place.x).sin(), 0.5 * place.y.cos());
            let scene = &mut self.0;
            scene.centres.push(place.as_vec3().to_array());
            scene.log_scales.push([deviation, deviation, 0.1 * deviation].map(|s| s.ln() as f32));
            scene.rotations.push([turn.w, turn.x, turn.y, turn.z].map(|part| part as f32));
            scene.opacity_logits.push(4.0);
            scene.harmonics.push(colour.as_vec3().to_array());
        }
    }

    fn ellipsoid(&mut self, n: u32, centre: DVec3, half: DVec3, highest: f64) {
        let area = TAU * 2.0 * (half.x * half.y * half.z).powf(2.0 / 3.0);
        self.surface(n, area, |u, v| {
            let z = -1.0 + (1.0 + highest) * u;
            let (sin, cos) = (TAU * v).sin_cos();
            let unit = DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
            (centre + half * unit, unit / half)
        });
    }

    fn tube(&mut self, n: u32, from: DVec3, along: DVec3, radius: f64) {
        let (side, front) = along.normalize().any_orthonormal_pair();
        self.surface(n, TAU * radius * along.length(), |u, v| {
            let (sin, cos) = (TAU * v).sin_cos();
            let out = side * cos + front * sin;
            (from + along * u + out * radius, out)
        });
    }

    fn quad(&mut self, n: u32, corner: DVec3, a: DVec3, b: DVec3) {
        let normal = a.cross(b);
        self.surface(n, normal.length(), |u, v| (corner + a * u + b * v, normal));
    }

    /// * `n`: Gaussians of a unit of area. * `has_lid`: whether it is closed above.
    fn block(&mut self, n: f64, low: DVec3, high: DVec3, has_lid: bool) {
        let size = high - low;
        let [x, y, z] = [DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z];
        for (corner, a, b) in [(low, y, x), (low, x, z), (low, z, y), (low + y, z, x), (low + x, y, z), (low + z, x, y)]
        {
            if has_lid || corner != low + z {
                self.quad((n * a.cross(b).length()).ceil() as u32, corner, a, b);
            }
        }
    }

    fn disc(&mut self, n: u32, radius: f64, z: f64) {
        self.surface(n, 0.5 * TAU * radius * radius, |u, v| {
            let (sin, cos) = (TAU * v).sin_cos();
            (DVec3::new(cos, sin, 0.0) * radius * u.sqrt() + DVec3::Z * z, DVec3::Z)
        });
    }

    fn figure(&mut self) {
        for x in [-0.15, 0.15] {
            self.tube(250, DVec3::new(x, 0.0, 0.0), DVec3::Z * 0.8, 0.1);
            self.tube(150, DVec3::new(2.0 * x, 0.0, 1.3), DVec3::new(x, 0.0, -0.5), 0.07);
        }
        self.ellipsoid(700, DVec3::Z * 1.1, DVec3::new(0.3, 0.2, 0.4), 1.0);
        self.ellipsoid(300, DVec3::Z * 1.65, DVec3::new(0.17, 0.17, 0.2), 1.0);
    }

    fn furniture(&mut self) {
        self.block(120.0, DVec3::new(-0.6, -0.4, 0.0), DVec3::new(0.6, 0.4, 0.7), true);
        self.block(120.0, DVec3::new(-1.9, 0.5, 0.0), DVec3::new(-1.5, 1.4, 1.8), true);
        self.block(120.0, DVec3::new(1.0, -1.4, 0.0), DVec3::new(1.9, -0.8, 0.5), true);
        self.ellipsoid(300, DVec3::new(0.1, 0.0, 0.95), DVec3::splat(0.25), 1.0);
    }
}

/// From around: `n` cameras that look at the middle.
fn from_around(middle: DVec3, distance: f64, rises: [f64; 2]) -> Vec<Camera> {
    (0..N_VIEWS)
        .map(|i| {
            let share = f64::from(i) / f64::from(N_VIEWS);
            let rise = rises[0] + (rises[1] - rises[0]) * (7.0 * share).fract();
            let (sin, cos) = (TAU * share).sin_cos();
            let reach = (1.0 - rise * rise).sqrt();
            let out = DVec3::new(reach * cos, reach * sin, rise);
            camera(middle + out * distance, -out, Up::PLUS_Z, 0.7, [VIEW_PX; 2])
        })
        .collect()
}

/// From places in a row or a room, looking all around.
fn from_inside(place: impl Fn(f64) -> DVec3) -> Vec<Camera> {
    (0..N_VIEWS)
        .map(|i| {
            let share = (f64::from(i) + 0.5) / f64::from(N_VIEWS);
            let (sin, cos) = (TAU * 5.0 * share).sin_cos();
            let rise = 0.6 * (TAU * 11.0 * share).sin();
            camera(place(share), DVec3::new(cos, sin, rise).normalize(), Up::PLUS_Z, 1.3, [VIEW_PX; 2])
        })
        .collect()
}

fn walk(share: f64) -> DVec3 {
    let (sin, cos) = (TAU * share).sin_cos();
    DVec3::new(1.2 * cos, 0.75 * sin, 1.5)
}

/// All of them.
pub(super) fn all() -> Vec<TestScene> {
    let mut scenes = Vec::new();
    let mut add = |name, side, has_ground, cameras, paint: &dyn Fn(&mut Painter)| {
        let mut painter = Painter(Gaussians { degree: Degree::Zero, ..Gaussians::default() });
        paint(&mut painter);
        scenes.push(TestScene { name, gaussians: painter.0, side, has_ground, cameras });
    };
    let (low, high) = (DVec3::new(-2.0, -1.5, 0.0), DVec3::new(2.0, 1.5, 2.5));
    use Side::{Around, Inside};
    add("hollow ball", Around, false, from_around(DVec3::ZERO, 3.0, [-0.8, 0.9]), &|p| {
        p.ellipsoid(3000, DVec3::ZERO, DVec3::ONE, 1.0);
    });
    add("vase, open above", Around, false, from_around(DVec3::ZERO, 3.0, [-0.4, 0.9]), &|p| {
        p.ellipsoid(3000, DVec3::ZERO, DVec3::new(0.7, 0.7, 1.0), 0.75);
    });
    add("figure", Around, false, from_around(DVec3::Z * 0.9, 3.0, [-0.1, 0.8]), &Painter::figure);
    add("figure on a ground", Around, true, from_around(DVec3::Z * 0.5, 6.0, [0.1, 0.8]), &|p| {
        p.figure();
        p.disc(2500, 3.5, 0.0);
    });
    add("things on a plane", Around, true, from_around(DVec3::Z * 0.3, 7.0, [0.15, 0.9]), &|p| {
        p.quad(3000, low, DVec3::X * 4.0, DVec3::Y * 3.0);
        p.furniture();
    });
    add("furnished room", Inside, true, from_inside(walk), &|p| {
        p.block(60.0, low, high, true);
        p.furniture();
    });
    add("the same without ceiling", Inside, true, from_inside(walk), &|p| {
        p.block(60.0, low, high, false);
        p.furniture();
    });
    add("empty room", Inside, false, from_inside(walk), &|p| p.block(60.0, low, high, true));
    add("tube", Inside, false, from_inside(|share| DVec3::X * (4.0 * share - 2.0)), &|p| {
        p.tube(3000, DVec3::X * -2.5, DVec3::X * 5.0, 0.5);
    });
    add("garden within a hedge", Inside, true, from_around(DVec3::Z * 0.7, 3.0, [0.1, 0.5]), &|p| {
        p.disc(3500, 6.0, 0.0);
        p.tube(3500, DVec3::ZERO, DVec3::Z * 3.0, 6.0);
        p.block(150.0, DVec3::new(-0.8, -0.5, 0.0), DVec3::new(0.8, 0.5, 0.8), true);
        p.ellipsoid(400, DVec3::Z * 1.1, DVec3::splat(0.3), 1.0);
    });
    let facing = (0..N_VIEWS).map(|i| {
        let [x, z] = [f64::from(i % 8) / 7.0 - 0.5, f64::from(i / 8) / 5.0 + 0.5];
        camera(DVec3::new(x, -3.0, z), DVec3::Y, Up::PLUS_Z, 0.9, [VIEW_PX; 2])
    });
    add("seen from one side", Around, false, facing.collect(), &|p| {
        p.quad(2000, DVec3::new(-2.0, 1.5, -0.5), DVec3::X * 4.0, DVec3::Z * 3.0);
        p.quad(1000, DVec3::new(-2.0, -0.5, 0.0), DVec3::X * 4.0, DVec3::Y * 2.0);
        p.ellipsoid(500, DVec3::new(-0.6, 0.5, 0.5), DVec3::splat(0.5), 1.0);
        p.block(150.0, DVec3::new(0.3, 0.2, 0.0), DVec3::new(1.0, 0.8, 1.3), true);
    });
    scenes
}
