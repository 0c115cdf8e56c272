//! The scene: a striped box and a dotted, glossy ball on a tiled disk, fenced in by wire.

use std::f64::consts::TAU;

use glam::DVec3;

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
    /// Height of the highlight; 0 is matt.
    gloss: f64,
}

const GROUND_Z: f64 = -0.5;
/// Part of the light that comes from everywhere.
const AMBIENT: f64 = 0.45;
/// Blinn's exponent: the highlight is about a fifth of the ball wide.
const SHININESS: f64 = 40.0;

impl Scene {
    /// The scene with the noise of its textures drawn from `seed`.
    pub(super) fn new(seed: u64) -> Self {
        let matt = |surface, texture| Body { surface, texture, gloss: 0.0 };
        let wire = Texture::Plain(DVec3::new(0.72, 0.66, 0.52));
        let mut bodies = vec![
            matt(Surface::Disk { centre: DVec3::new(0.0, 0.0, GROUND_Z), radius: 1.15 }, Texture::Tiles),
            matt(
                Surface::Box { centre: DVec3::new(-0.42, 0.25, -0.12), half: DVec3::new(0.3, 0.3, 0.38), yaw: 0.5 },
                Texture::Stripes,
            ),
            Body {
                surface: Surface::Sphere { centre: DVec3::new(0.42, -0.22, -0.08), radius: 0.42 },
                texture: Texture::Dots,
                gloss: 0.8,
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
    /// `gloss·max(0, n·h)^shininess` (Blinn 1977) with h halfway between light and viewer; no shadows.
    pub(super) fn colour(&self, ray: &Ray) -> Option<DVec3> {
        let hits = self.bodies.iter().filter_map(|body| Some((body, body.surface.hit(ray)?)));
        let (body, hit) = hits.min_by(|(_, a), (_, b)| a.t.total_cmp(&b.t))?;
        let diffuse = AMBIENT + (1.0 - AMBIENT) * hit.normal.dot(self.to_light).max(0.0);
        let half_way = (self.to_light - ray.direction).normalize();
        let highlight = body.gloss * hit.normal.dot(half_way).max(0.0).powf(SHININESS);
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
        let scene = Scene::new(1);
        for i in 0..64 {
            let (sin, cos) = (TAU * f64::from(i) / 64.0).sin_cos();
            // Straight down outside the cube that initial points fill.
            let outside = DVec3::new(1.3 * cos, 1.3 * sin, 0.0);
            assert_eq!(colour_from(&scene, outside + 4.0 * DVec3::Z, outside), None);
            assert_eq!(colour_from(&scene, DVec3::new(4.0 * cos, 4.0 * sin, 1.3), DVec3::new(0.0, 0.0, 1.3)), None);
        }
    }

    #[test]
    fn the_ball_changes_with_the_view_and_the_ground_does_not() {
        let scene = Scene::new(1);
        let (left, right) = (DVec3::new(0.2, -2.2, 3.0), DVec3::new(3.0, 1.2, 3.0));
        // The point of the ball that mirrors the light to the left.
        let centre = DVec3::new(0.42, -0.22, -0.08);
        let ball = centre + 0.42 * (scene.to_light + (left - centre).normalize()).normalize();
        let change =
            |p| (colour_from(&scene, left, p).expect("met") - colour_from(&scene, right, p).expect("met")).length();
        assert!(change(ball) > 0.1, "highlight: {}", change(ball));
        assert!(change(DVec3::new(0.1, 0.6, GROUND_Z)) < 1e-9, "ground");
    }
}
