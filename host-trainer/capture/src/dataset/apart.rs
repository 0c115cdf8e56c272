//! Cameras that stand so far from all others that their poses are probably wrong.
//!
//! Everything here is measured by medians and quartiles, which a fifth of the cameras do not move wherever they stand.

use glam::DVec3;

use super::listing::Listing;
use super::{Split, ViewFault};

/// Within so many quartile distances of the middle no camera is apart. A camera 12 of them out costs a scene nothing that could be
/// measured, one 20 out 0.6 dB, one 30 out all of it (`docs/experiments/2026-11-27-one-camera-far-away.md`).
const NEAR: f64 = 10.0;
/// A camera within so many quartile distances of one that belongs to the rest belongs to it, too: a walk, a flight or a few overviews
/// from above keep all of their cameras, however far they lead.
const REACH: f64 = 5.0;

/// Sets aside the views whose cameras stand apart from those to train on: a view like that governs the scale of the scene if it is
/// believed, and its photograph contradicts all others.
pub(super) fn set_aside(listing: &mut Listing) {
    let centres: Vec<DVec3> = listing.shots(Split::Train).map(|shot| shot.centre_world()).collect();
    let spread = Spread::of(&centres);
    for view in &mut listing.views {
        if let Ok(shot) = &view.shot
            && spread.is_apart(shot.centre_world())
        {
            view.shot = Err(ViewFault::Apart { median_distances: spread.ratio(shot.centre_world()) });
        }
    }
}

/// Where the cameras of a capture stand, or its points.
#[derive(Clone, Debug)]
pub(super) struct Spread {
    /// The median of each coordinate.
    middle: DVec3,
    /// Median distance from it.
    pub(super) median_distance: f64,
    /// Upper quartile of the distances from it.
    quartile: f64,
    /// The cameras that are not apart.
    body: Vec<DVec3>,
}

impl Spread {
    /// Of these centres, capture units.
    ///
    /// Work: a distance for every pair of cameras of which one is far, at worst.
    pub(super) fn of(centres: &[DVec3]) -> Self {
        let middle = DVec3::from_array([0, 1, 2].map(|axis| quantile(centres.iter().map(|c| c[axis]), 0.5)));
        let distances = || centres.iter().map(|centre| centre.distance(middle));
        let (median_distance, quartile) = (quantile(distances(), 0.5), quantile(distances(), 0.75));
        let mut spread = Self { middle, median_distance, quartile, body: Vec::new() };
        let (near, mut far): (Vec<DVec3>, Vec<DVec3>) = centres.iter().partition(|centre| spread.is_near(**centre));
        spread.body = near.clone();
        // Whoever was reached last may reach others.
        let mut reached = near;
        while !reached.is_empty() {
            let (next, rest) = far.iter().partition(|centre| spread.is_reached(**centre, &reached));
            (reached, far) = (next, rest);
            spread.body.extend(&reached);
        }
        spread
    }

    /// Whether a camera stands apart: farther than ten times the upper quartile of the distances from the middle, and more than five
    /// times that from every camera that is not apart.
    ///
    /// Where three quarters of the cameras stand in one point there is no length to tell by, and none is apart.
    pub(super) fn is_apart(&self, centre: DVec3) -> bool {
        !self.is_near(centre) && !self.is_reached(centre, &self.body)
    }

    /// Median distances from the middle.
    pub(super) fn ratio(&self, centre: DVec3) -> f64 {
        self.distance(centre) / self.median_distance
    }

    /// Distance from the middle.
    pub(super) fn distance(&self, centre: DVec3) -> f64 {
        centre.distance(self.middle)
    }

    fn is_near(&self, centre: DVec3) -> bool {
        let has_length = self.quartile > 0.0 && self.quartile.is_finite();
        !has_length || centre.distance(self.middle) <= NEAR * self.quartile
    }

    fn is_reached(&self, centre: DVec3, from: &[DVec3]) -> bool {
        from.iter().any(|from| centre.distance(*from) <= REACH * self.quartile)
    }
}

/// The value below which this share of the values lies, the upper of two; 0 without values.
pub(super) fn quantile(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a length")]
    let at = (share * values.len() as f64) as usize;
    values.get(at).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::super::{EXTENT, Normalisation};
    use super::*;

    /// `n` places on a ring of this radius and height.
    fn ring(n: usize, radius: f64, height: f64) -> Vec<DVec3> {
        let place = |i: usize| {
            let (sin, cos) = (TAU * i as f64 / n as f64).sin_cos();
            DVec3::new(radius * cos, radius * sin, height)
        };
        (0..n).map(place).collect()
    }

    fn n_apart(centres: &[DVec3]) -> usize {
        let spread = Spread::of(centres);
        let n = centres.iter().filter(|centre| spread.is_apart(**centre)).count();
        assert_eq!(spread.body.len() + n, centres.len());
        n
    }

    fn frame(centres: &[DVec3]) -> Normalisation {
        let spread = Spread::of(centres);
        let together: Vec<DVec3> = centres.iter().copied().filter(|centre| !spread.is_apart(*centre)).collect();
        Normalisation::of_cameras(&together).expect("a scale")
    }

    #[test]
    fn captures_that_spread_for_a_reason_keep_every_camera() {
        let dome = || (0..5).flat_map(|k| ring(20, 4.0 * (1.0 - 0.04 * f64::from(k * k)).sqrt(), 0.8 * f64::from(k)));
        let line = |n: u32, step: f64| (0..n).map(move |i| DVec3::X * (step * f64::from(i)));
        let flight = (0..200).map(|i| DVec3::new(20.0 * f64::from(i % 20), 30.0 * f64::from(i / 20), 80.0)).collect();
        let captures: [(&str, Vec<DVec3>); 8] = [
            ("a dome", dome().collect()),
            ("a flight over a field", flight),
            ("a flight along a river", line(300, 10.0).collect()),
            // Most photographs around a statue, then a walk of 15 distances away from it.
            ("a long walk", dome().chain(line(15, 4.0)).collect()),
            ("two rings", ring(60, 1.0, 0.0).into_iter().chain(ring(12, 5.0, 0.5)).collect()),
            ("inward and outward", ring(40, 3.0, 1.0).into_iter().chain(ring(10, 0.1, 1.0)).collect()),
            ("overviews from above", ring(60, 2.0, 1.0).into_iter().chain(ring(4, 3.0, 14.0)).collect()),
            // Half of a film on a tripod, half on a walk of any length.
            ("a tripod, then a walk", ring(100, 1e-3, 0.0).into_iter().chain(line(101, 1.0)).collect()),
        ];
        for (name, centres) in captures {
            assert_eq!(n_apart(&centres), 0, "{name}");
            assert_eq!(Ok(frame(&centres)), Normalisation::of_cameras(&centres), "{name}: the frame is as published");
        }
    }

    #[test]
    fn a_tenth_of_the_cameras_anywhere_moves_neither_centre_nor_scale() {
        let sound = [ring(45, 4.0, 1.0), ring(45, 3.0, 2.5)].concat();
        let as_it_is = frame(&sound);
        let directions = ring(10, 1.0, 0.7);
        let placed = |place: &dyn Fn(usize, DVec3) -> DVec3| -> Vec<DVec3> {
            directions.iter().enumerate().map(|(i, d)| place(i, *d)).collect()
        };
        for (name, wrong) in [
            ("far", placed(&|i, d| d * 10f64.powi(2 + i as i32))),
            ("so far that squares overflow", placed(&|_, d| d * 1e200)),
            ("one-sided", placed(&|i, _| DVec3::X * (100.0 + 10.0 * i as f64))),
            ("clustered", placed(&|_, d| DVec3::new(300.0, 200.0, 0.0) + d)),
            ("in one place", placed(&|_, _| DVec3::splat(-500.0))),
        ] {
            let all = [sound.clone(), wrong].concat();
            assert_eq!(n_apart(&all), 10, "{name}");
            assert_eq!(frame(&all), as_it_is, "{name}");
        }
        // Moderate: not told from cameras that spread for a reason, and not able to do more than these.
        let all = [sound, placed(&|i, d| d * (8.0 + 2.0 * i as f64))].concat();
        assert_eq!(n_apart(&all), 0);
        let moderate = frame(&all);
        assert!(moderate.scale > 0.1 * as_it_is.scale, "{} of {}", moderate.scale, as_it_is.scale);
        assert!((moderate.centre - as_it_is.centre).length() * as_it_is.scale < EXTENT, "{}", moderate.centre);
    }

    #[test]
    fn what_has_no_length_has_no_camera_apart() {
        assert_eq!(n_apart(&[]), 0);
        assert_eq!(n_apart(&[[DVec3::ONE; 9].as_slice(), &[DVec3::splat(1e9)]].concat()), 0);
        let spread = Spread::of(&[DVec3::X, -DVec3::X, DVec3::Y * 100.0, -DVec3::Y]);
        assert_eq!(spread.ratio(DVec3::Y * 100.0).round(), 100.0);
    }
}
