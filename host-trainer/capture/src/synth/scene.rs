//! The scene: a striped box and a dotted, glossy ball on a tiled disk, fenced in by wire.

use std::f64::consts::TAU;

use glam::DVec3;

use super::SurfaceFinish;
use super::surface::{Ray, Surface};
use super::texture::Texture;

/// Everything there is to see; it fits in [−1.3, 1.3]³.
#[derive(Debug)]
pub(super) struct Scene {
    bodies: Vec<Body>,
    /// Direction to the light, length 1.
    to_light: DVec3,
    seed: u64,
}

#[derive(Debug)]
struct Body {
    surface: Surface,
    texture: Texture,
    highlight: Highlight,
}

/// Blinn's lobe around the direction that mirrors the light.
#[derive(Clone, Copy, Debug)]
struct Highlight {
    /// At its middle; 0 is matt.
    height: f64,
    /// Blinn's exponent: the lower, the wider.
    shininess: f64,
}

const GROUND_Z: f64 = -0.5;
/// Part of the light that comes from everywhere.
const AMBIENT: f64 = 0.45;
const MATT: Highlight = Highlight { height: 0.0, shininess: 1.0 };
/// About a fifth of the ball wide.
const ON_BALL: Highlight = Highlight { height: 0.8, shininess: 40.0 };
/// So wide that a quarter of all cameras see some of it on a plane.
const SHEEN: Highlight = Highlight { height: 0.6, shininess: 12.0 };

impl Scene {
    /// The scene with the noise of its textures drawn from `seed`.
    pub(super) fn new(seed: u64, finish: SurfaceFinish) -> Self {
        let (ball, solid) = match finish {
            SurfaceFinish::Matte => (MATT, MATT),
            SurfaceFinish::Mixed => (ON_BALL, MATT),
            SurfaceFinish::Glossy => (ON_BALL, SHEEN),
        };
        let matt = |surface, texture| Body { surface, texture, highlight: MATT };
        let wire = Texture::Plain(DVec3::new(0.72, 0.66, 0.52));
        let mut bodies = vec![
            Body {
                surface: Surface::Disk { centre: DVec3::new(0.0, 0.0, GROUND_Z), radius: 1.15 },
                texture: Texture::Tiles,
                highlight: solid,
            },
            Body {
                surface: Surface::Box {
                    centre: DVec3::new(-0.42, 0.25, -0.12),
                    half: DVec3::new(0.3, 0.3, 0.38),
                    yaw: 0.5,
                },
                texture: Texture::Stripes,
                highlight: solid,
            },
            Body {
                surface: Surface::Sphere { centre: DVec3::new(0.42, -0.22, -0.08), radius: 0.42 },
                texture: Texture::Dots,
                highlight: ball,
            },
            matt(Surface::Ring { centre: DVec3::new(0.0, 0.0, 0.1), radius: 1.05, wire_radius: 0.02 }, wire),
        ];
        let n_posts = 7;
        bodies.extend((0..n_posts).map(|i| {
            let (sin, cos) = (TAU * f64::from(i) / f64::from(n_posts)).sin_cos();
            let at = |z| DVec3::new(1.05 * cos, 1.05 * sin, z);
            matt(Surface::Rod { from: at(GROUND_Z), to: at(0.1), radius: 0.018 }, wire)
        }));
        Self { bodies, to_light: DVec3::new(0.45, -0.35, 0.82).normalize(), seed }
    }

    /// The colour a ray sees, each channel in [0, 1], or `None` where it meets nothing.
    ///
    /// Lambert's law plus Blinn's highlight, `ambient + (1 − ambient)·max(0, n·l)` times the texture plus
    /// `height·max(0, n·h)^shininess` (Blinn 1977) with h halfway between light and viewer; no shadows.
    pub(super) fn colour(&self, ray: &Ray) -> Option<DVec3> {
        let hits = self.bodies.iter().filter_map(|body| Some((body, body.surface.hit(ray)?)));
        let (body, hit) = hits.min_by(|(_, a), (_, b)| a.t.total_cmp(&b.t))?;
        let diffuse = AMBIENT + (1.0 - AMBIENT) * hit.normal.dot(self.to_light).max(0.0);
        let half_way = (self.to_light - ray.direction).normalize();
        let Highlight { height, shininess } = body.highlight;
        let highlight = height * hit.normal.dot(half_way).max(0.0).powf(shininess);
        let colour = body.texture.colour(hit.local, self.seed) * diffuse + DVec3::splat(highlight);
        Some(colour.clamp(DVec3::ZERO, DVec3::ONE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn colour_from(scene: &Scene, origin: DVec3, target: DVec3) -> Option<DVec3> {
        scene.colour(&Ray { origin, direction: (target - origin).normalize() })
    }

    #[test]
    fn rays_past_the_scene_meet_nothing() {
        let scene = Scene::new(1, SurfaceFinish::Mixed);
        for i in 0..64 {
            let (sin, cos) = (TAU * f64::from(i) / 64.0).sin_cos();
            // Straight down outside the cube that initial points fill.
            let outside = DVec3::new(1.3 * cos, 1.3 * sin, 0.0);
            assert_eq!(colour_from(&scene, outside + 4.0 * DVec3::Z, outside), None);
            assert_eq!(colour_from(&scene, DVec3::new(4.0 * cos, 4.0 * sin, 1.3), DVec3::new(0.0, 0.0, 1.3)), None);
        }
    }

    /// How far the colours of a point differ, seen from `left` and from the right.
    fn change(scene: &Scene, point: DVec3, left: DVec3) -> f64 {
        let right = DVec3::new(3.0, 1.2, 3.0);
        (colour_from(scene, left, point).expect("met") - colour_from(scene, right, point).expect("met")).length()
    }

    #[test]
    fn the_finish_decides_which_surfaces_change_with_the_view() {
        use SurfaceFinish::{Glossy, Matte, Mixed};
        for (finish, ball_changes, ground_changes) in
            [(Matte, false, false), (Mixed, true, false), (Glossy, true, true)]
        {
            let scene = Scene::new(1, finish);
            // The point of the ball that mirrors the light to the left, and a place to which the ground mirrors it.
            let (left, centre) = (DVec3::new(0.2, -2.2, 3.0), DVec3::new(0.42, -0.22, -0.08));
            let on_ball = centre + 0.42 * (scene.to_light + (left - centre).normalize()).normalize();
            let on_ground = DVec3::new(0.1, 0.6, GROUND_Z);
            let mirrored = on_ground + 3.0 * scene.to_light * DVec3::new(-1.0, -1.0, 1.0);
            let (ball, ground) = (change(&scene, on_ball, left), change(&scene, on_ground, mirrored));
            assert!(if ball_changes { ball > 0.1 } else { ball < 1e-9 }, "{finish:?} ball: {ball}");
            assert!(if ground_changes { ground > 0.1 } else { ground < 1e-9 }, "{finish:?} ground: {ground}");
        }
    }
}
