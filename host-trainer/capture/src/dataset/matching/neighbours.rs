//! Which photographs show the same from a little aside.

use glam::DVec3;

use super::Scene;

/// So many photographs are searched for what one shows.
const NEIGHBOURS: usize = 6;
/// The angle, radians, that two rays to one point are best apart: less fixes no depth, more shows another side.
const BEST_PARALLAX: f64 = 0.12;
/// Cameras that look this far apart, radians, show nothing alike.
const WIDEST_TURN: f64 = 1.0;
const LEAST_PARALLAX: f64 = 0.02;

/// The photographs to search for what photograph `i` shows at a distance, best first.
///
/// Each is judged by the angle at that point and by how far its camera is turned; one that stands like another before it counts less.
pub(super) fn neighbours(scene: &Scene, i: usize, distance: f64) -> Vec<usize> {
    let own = &scene.pictures[i].camera;
    let axis = |j: usize| scene.pictures[j].camera.rotation.row(2);
    let centre = own.centre_world();
    let target = centre + distance * axis(i);
    let angle = |a: DVec3, b: DVec3| a.angle_between(b);
    let cost = |j: usize| {
        let other = scene.pictures[j].camera.centre_world();
        let parallax = angle(centre - target, other - target);
        let turn = angle(axis(i), axis(j));
        let seen = scene.pictures[j].camera.rotation * (target - other);
        let usable = j != i && parallax > LEAST_PARALLAX && turn < WIDEST_TURN && seen.z > 0.0;
        usable.then(|| (parallax / BEST_PARALLAX).ln().abs() + turn)
    };
    let mut by_cost: Vec<(f64, usize)> = (0..scene.pictures.len()).filter_map(|j| Some((cost(j)?, j))).collect();
    by_cost.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    by_cost.into_iter().take(NEIGHBOURS).map(|(_, j)| j).collect()
}
