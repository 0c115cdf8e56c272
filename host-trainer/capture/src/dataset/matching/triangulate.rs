//! The point that several photographs show.

use glam::{DMat3, DVec2, DVec3};

use super::Scene;
use super::search::Sighting;
use crate::camera::{Camera, nearest_to_lines};

/// The point and its sightings miss each other by no more than this, pixels.
const MOST_MISS_PX: f64 = 1.5;
/// Photographs that must show a point.
const LEAST_SIGHTINGS: usize = 3;
/// Two of the rays meet at this angle at least, radians (1.5 degrees, as mappers ask for): less fixes no depth.
const LEAST_PARALLAX: f64 = 0.026;

/// The point nearest to all rays, moved once down the squared misses in the images; sightings that miss it go, the worst first.
/// `None` where too few stay or their rays are almost parallel.
pub(super) fn point(scene: &Scene, mut sightings: Vec<Sighting>) -> Option<DVec3> {
    loop {
        if sightings.len() < LEAST_SIGHTINGS {
            return None;
        }
        let point = refined(scene, &sightings, nearest_to_rays(scene, &sightings)?)?;
        let misses = sightings.iter().map(|sighting| Some(miss(scene, sighting, point)?.0.length()));
        let misses: Vec<f64> = misses.collect::<Option<_>>()?;
        let worst = (0..misses.len()).fold(0, |worst, i| if misses[i] > misses[worst] { i } else { worst });
        if misses[worst] <= MOST_MISS_PX {
            return (parallax(scene, &sightings, point) >= LEAST_PARALLAX).then_some(point);
        }
        sightings.remove(worst);
    }
}

fn parallax(scene: &Scene, sightings: &[Sighting], point: DVec3) -> f64 {
    let rays: Vec<DVec3> =
        sightings.iter().map(|sighting| scene.pictures[sighting.view].camera.centre_world() - point).collect();
    let pairs = rays.iter().enumerate().flat_map(|(i, a)| rays[..i].iter().map(move |b| a.angle_between(*b)));
    pairs.fold(0.0, f64::max)
}

fn nearest_to_rays(scene: &Scene, sightings: &[Sighting]) -> Option<DVec3> {
    let ray = |sighting: &Sighting| {
        let centre = scene.pictures[sighting.view].camera.centre_world();
        (centre, (scene.point(sighting.view, sighting.at.into(), 1.0) - centre).normalize())
    };
    nearest_to_lines(sightings.iter().map(ray), 0.0).filter(|point| point.is_finite())
}

/// How far the point is seen from a sighting, pixels, and the derivative of its two parts by the point; `None` behind the camera.
fn miss(scene: &Scene, sighting: &Sighting, point: DVec3) -> Option<(DVec2, [DVec3; 2])> {
    miss_of(&scene.pictures[sighting.view].camera, sighting.at, point)
}

/// The same of a camera that sees it at `at`.
pub(super) fn miss_of(camera: &Camera, at: DVec2, point: DVec3) -> Option<(DVec2, [DVec3; 2])> {
    let seen = camera.rotation * point + camera.translation;
    if seen.z <= 0.0 {
        return None;
    }
    let on_plane = seen.truncate() / seen.z;
    let [focal, principal] = [camera.focal_px, camera.principal_px].map(DVec2::from);
    let by =
        |axis: usize| (camera.rotation.row(axis) - on_plane[axis] * camera.rotation.row(2)) * (focal[axis] / seen.z);
    Some((focal * on_plane + principal - at, [by(0), by(1)]))
}

/// One step of Gauss and Newton.
fn refined(scene: &Scene, sightings: &[Sighting], point: DVec3) -> Option<DVec3> {
    let (mut normal, mut right) = (DMat3::ZERO, DVec3::ZERO);
    for sighting in sightings {
        let (miss, by) = miss(scene, sighting, point)?;
        for (miss, by) in miss.to_array().into_iter().zip(by) {
            normal += DMat3::from_cols(by * by.x, by * by.y, by * by.z);
            right += miss * by;
        }
    }
    let moved = point - normal.inverse() * right;
    moved.is_finite().then_some(moved)
}
