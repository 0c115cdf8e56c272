//! Where training starts: the points of the capture without its strays, or random ones where the cameras look.

use glam::DVec3;

use super::apart::quantile;
use super::normalise::random_points_world;
use super::points::Points;
use super::{EXTENT, LoadOptions, Normalisation, SceneKind, frusta};
use crate::camera::Camera;

/// Points are never strays within so many extents of the cameras: there, cameras at both ends of the capture see a point under a degree,
/// and mappers triangulate from about 1.5 degrees on.
const NEAR_EXTENTS: f64 = 100.0;
/// Nor within so many times the distance within which three quarters of the points lie, as of a scene that is far away as a whole.
const NEAR_QUARTILES: f64 = 30.0;
/// Beyond so many extents no point is believed, whatever the others do: of a handful, one stray is a quarter.
const FAR_EXTENTS: f64 = 1e6;

/// The points worth starting from, normalised, and what is to be said of the others.
///
/// A stray point costs the lattice its resolution, for a bundle spans 2²¹ cells. Which points are strays is told by the upper quartile of
/// their distances, which a fifth of the points do not move wherever they lie.
pub(super) fn kept(points_world: &Points, normalisation: &Normalisation) -> (Points, Option<String>) {
    let points: Points = points_world.each().map(|(point, rgb)| (normalisation.point(point), rgb)).collect();
    let finite = points.at.iter().filter(|point| point.is_finite());
    let quartile = quantile(finite.map(|point| point.length()), 0.75);
    let farthest = (NEAR_QUARTILES * quartile).clamp(NEAR_EXTENTS * EXTENT, FAR_EXTENTS * EXTENT);
    let kept: Points = points.each().filter(|(point, _)| point.length() <= farthest).collect();
    let note = (kept.len() < points.len()).then(|| {
        format!(
            "points left out: {} of {}; they are not finite, or farther away than {:.0} times the extent of the cameras",
            points.len() - kept.len(),
            points.len(),
            farthest / EXTENT
        )
    });
    (kept, note)
}

/// Random points for a capture that brings none, by what it shows.
///
/// An object fills a cube: that of Synthetic-NeRF, ±1.3 around the origin, where the cameras look at it as those do, so that published
/// scenes start as published; else one of the same share of what they see. A room goes on behind.
///
/// * `cameras`: normalised, at least one.
pub(super) fn random(
    cameras: &[&Camera],
    kind: SceneKind,
    normalisation: &Normalisation,
    options: &LoadOptions,
) -> Vec<DVec3> {
    let (n, seed) = (options.n_random_points, options.seed);
    if kind == SceneKind::Object {
        let [centre, corner] =
            [DVec3::ZERO, DVec3::splat(super::normalise::RANDOM_CUBE_HALF)].map(|p| normalisation.point(p));
        if frusta::look_at_cube(cameras, centre, (corner - centre).x) {
            return random_points_world(n, seed).into_iter().map(|point| normalisation.point(point)).collect();
        }
    }
    frusta::random_points(cameras, kind, n, seed)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Normalisation = Normalisation { centre: DVec3::new(1.0, 2.0, 3.0), scale: 0.5 };

    /// Points within ±1 of the origin, in capture units within ±2 of the centre.
    fn cloud(n: usize) -> Vec<DVec3> {
        random_points_world(n, 3).into_iter().map(|point| FRAME.centre + 2.0 * point / 1.3).collect()
    }

    /// What is kept of a cloud with these strays, and how many of these.
    fn kept_of(n: usize, strays: &[DVec3]) -> (usize, usize) {
        let far = |point: &&DVec3| point.length() > 50.0;
        // A colour that says which point it is of.
        let named = |(i, at): (usize, DVec3)| (at, Some([(i / 256) as u8, (i % 256) as u8, 7]));
        let points: Points = [cloud(n), strays.to_vec()].concat().into_iter().enumerate().map(named).collect();
        let (kept, note) = kept(&points, &FRAME);
        assert_eq!(note.is_some(), kept.len() < points.len());
        for (at, rgb) in kept.each() {
            let [high, low, _] = rgb.expect("a colour").map(usize::from);
            assert_eq!(at, FRAME.point(points.at[256 * high + low]), "a point keeps its colour");
        }
        let n_far = kept.at.iter().filter(far).count();
        (kept.len() - n_far, n_far)
    }

    #[test]
    fn strays_go_wherever_they_lie_and_up_to_a_tenth_of_the_points() {
        assert_eq!(kept_of(1000, &[]), (1000, 0));
        assert_eq!(kept_of(1000, &[DVec3::NAN, DVec3::splat(f64::INFINITY), DVec3::X * 1e6]), (1000, 0));
        let directions = random_points_world(100, 5);
        // Far: 10⁴ to 10¹² units away. One-sided: all along an axis. Clustered: all in one place.
        let far: Vec<DVec3> = (0..100).map(|i| directions[i].normalize() * 10f64.powf(4.0 + 0.08 * i as f64)).collect();
        let one_sided: Vec<DVec3> = (0..100).map(|i| DVec3::X * (5e3 + 1e3 * i as f64)).collect();
        let clustered: Vec<DVec3> = directions.iter().map(|d| DVec3::Y * 2e5 + *d).collect();
        for strays in [far, one_sided, clustered] {
            assert_eq!(kept_of(900, &strays), (900, 0));
        }
        // Moderate: within what cameras can triangulate, a point is a part of the scene.
        let moderate: Vec<DVec3> = directions.iter().map(|d| d.normalize() * 600.0).collect();
        assert_eq!(kept_of(900, &moderate), (900, 100));
    }

    #[test]
    fn a_scene_that_is_far_away_as_a_whole_stays() {
        let ridge: Points = cloud(1000).iter().map(|p| (DVec3::Z * 5e4 + *p * 1e3, None)).collect();
        assert_eq!(kept(&ridge, &FRAME).0.len(), 1000);
    }
}
