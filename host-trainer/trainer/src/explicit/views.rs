//! Cameras for a scene that came without: around its bulk, or inside it.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DMat3, DVec3};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{EXTENT, Normalisation};

use super::bulk::Bulk;
use super::up::Up;

/// Field of view along the shorter side, around a bulk and inside it, radians.
const FIELD_AROUND: f64 = 0.7;
pub(super) const FIELD_INSIDE: f64 = 1.3;

/// Distances around a bulk: from this share of the one at which it fills the picture to the other.
const DISTANCES: [f64; 2] = [0.85, 1.15];

/// How far inside a room cameras leave its centre, share of the way to its walls.
const INSIDE_SHARE: f64 = 0.45;
/// Places that are tried for each camera inside until one is free.
const TRIES: usize = 16;

/// Height of the first camera around a bulk above its middle, as an angle: nearly level, radians.
const FIRST_RISE: f64 = 0.15;
/// Sine of the least height of cameras above the ground.
const ABOVE_GROUND: f64 = 0.1;

/// From which side a scene is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// As an object.
    Around,
    /// As a room.
    Inside,
}

/// Where cameras stand, and how they are held.
#[derive(Clone, Debug, PartialEq)]
pub struct Stand {
    /// What they look at, or stand in.
    pub bulk: Bulk,
    /// Pictures are upright to it.
    pub up: Up,
    /// Around the bulk or inside it.
    pub side: Side,
    /// Whether none stands below the middle of the bulk, because its ground hides what is on it.
    pub above_ground: bool,
    /// Angle about the up axis at which the first camera stands, radians.
    pub front: f64,
}

impl Stand {
    /// `n` cameras that see the bulk from all sides, or from its inside all around; the first ones of more are the same.
    ///
    /// The very first one is upright, nearly level, and outside the ground; around a bulk it has all of it in its picture. The others'
    /// directions and places follow the additive recurrence of Roberts (2018), whose every beginning is spread evenly.
    ///
    /// * `size_px`: width and height.
    pub fn cameras(&self, n: usize, size_px: [u32; 2]) -> Vec<Camera> {
        (0..n)
            .map(|i| match (self.side, i) {
                (_, 0) => self.turned(0.0, size_px),
                (Side::Around, _) => self.around(i, size_px),
                (Side::Inside, _) => self.inside(i, size_px),
            })
            .collect()
    }

    /// The first camera, carried around the up axis through the middle of the bulk.
    ///
    /// * `angle`: radians; counter-clockwise from above.
    pub fn turned(&self, angle: f64, size_px: [u32; 2]) -> Camera {
        let azimuth = self.front + angle;
        match self.side {
            Side::Around => {
                let direction = direction(self.up, FIRST_RISE.sin(), azimuth);
                around_at(&self.bulk, self.up, direction, DISTANCES[1], size_px)
            }
            Side::Inside => {
                let across = self.up.upright().transpose() * self.bulk.half_range;
                let reach = INSIDE_SHARE * across.abs().truncate().min_element();
                let out = direction(self.up, 0.0, azimuth);
                camera(self.bulk.centre + out * reach, -out, self.up, FIELD_INSIDE, size_px)
            }
        }
    }

    /// The frame in which a bulk is drawn by itself: its middle at the origin, the farthest camera of its own at [`EXTENT`].
    pub fn normalisation(bulk: &Bulk) -> Normalisation {
        let farthest = bulk.radius / (0.5 * FIELD_AROUND).sin() * DISTANCES[1];
        Normalisation { centre: bulk.centre, scale: EXTENT / farthest }
    }

    fn around(&self, i: usize, size_px: [u32; 2]) -> Camera {
        let [a, b, c, ..] = spread(i);
        let [nearest, farthest] = DISTANCES;
        let lowest = if self.above_ground { ABOVE_GROUND } else { -1.0 };
        let direction = direction(self.up, 1.0 - (1.0 - lowest) * a, TAU * b);
        around_at(&self.bulk, self.up, direction, nearest + (farthest - nearest) * c, size_px)
    }

    fn inside(&self, i: usize, size_px: [u32; 2]) -> Camera {
        let [a, b, ..] = spread(i);
        let place = inside_place(&self.bulk, i);
        camera(place, direction(self.up, 1.0 - 2.0 * a, TAU * b), self.up, FIELD_INSIDE, size_px)
    }
}

/// A place within a bulk, the first of some that is free; the middle one of them if none is.
pub(super) fn inside_place(bulk: &Bulk, i: usize) -> DVec3 {
    let place = |try_: usize| {
        let [_, _, x, y, z] = spread(i * TRIES + try_);
        bulk.centre + bulk.half_range * INSIDE_SHARE * (2.0 * DVec3::new(x, y, z) - 1.0)
    };
    (0..TRIES).map(place).find(|place| bulk.is_free(*place)).unwrap_or_else(|| place(0))
}

/// A camera that looks at the middle of a bulk.
///
/// * `direction`: unit vector from the middle. * `distance`: share of the one at which the bulk fills the picture.
pub(super) fn around_at(bulk: &Bulk, up: Up, direction: DVec3, distance: f64, size_px: [u32; 2]) -> Camera {
    let distance = bulk.radius / (0.5 * FIELD_AROUND).sin() * distance;
    camera(bulk.centre + direction * distance, -direction, up, FIELD_AROUND, size_px)
}

/// Five numbers in 0..1: the fractions of (i + ½)·φ⁻ᵏ, where φ⁶ = φ + 1.
fn spread(i: usize) -> [f64; 5] {
    const PHI: f64 = 1.134_724_138_401_519_5;
    [1, 2, 3, 4, 5].map(|k| ((i as f64 + 0.5) * PHI.powi(-k)).fract())
}

/// A unit vector.
///
/// * `rise`: sine of its height. * `azimuth`: angle about the up axis, radians.
pub(super) fn direction(up: Up, rise: f64, azimuth: f64) -> DVec3 {
    let reach = (1.0 - rise * rise).max(0.0).sqrt();
    let (sin, cos) = azimuth.sin_cos();
    up.upright() * DVec3::new(reach * cos, reach * sin, rise)
}

/// A camera that is held upright; OpenCV axes: x right, y down, z forward.
///
/// * `field`: of view along the shorter side, radians.
pub(super) fn camera(place: DVec3, forward: DVec3, up: Up, field: f64, [width_px, height_px]: [u32; 2]) -> Camera {
    let upright = up.upright();
    // Straight up and down any other direction does.
    let above = if forward.dot(upright.z_axis).abs() < 0.999 { upright.z_axis } else { upright.y_axis };
    let focal = 0.5 * f64::from(width_px.min(height_px)) / (0.5 * field).tan();
    let lens = Camera {
        rotation: DMat3::IDENTITY,
        translation: DVec3::ZERO,
        focal_px: [focal; 2],
        principal_px: [0.5 * f64::from(width_px), 0.5 * f64::from(height_px)],
        width_px,
        height_px,
    };
    lens.looking_at(place, place + forward, above)
}

/// Six pictures that show all there is around a place.
pub(super) fn all_around(place: DVec3, up: Up, side_px: u32) -> [Camera; 6] {
    let upright = up.upright();
    [upright.x_axis, -upright.x_axis, upright.y_axis, -upright.y_axis, upright.z_axis, -upright.z_axis]
        .map(|forward| camera(place, forward, up, FRAC_PI_2, [side_px; 2]))
}

/// Cameras farther out than so many times the median distance do not count for the frame.
const FAR_OUT: f64 = 10.0;

/// The frame in which these cameras are trained from: `centre`, or else their mean, at the origin, 1.1 × the largest distance from it
/// [`EXTENT`]. Cameras that stand more than ten median distances from the median place do not count.
///
/// `None` where they all stand in one point.
pub fn normalisation_of(cameras: &[Camera], centre: Option<DVec3>) -> Option<Normalisation> {
    let places: Vec<DVec3> = cameras.iter().map(Camera::centre_world).collect();
    let median = DVec3::from([0, 1, 2].map(|axis| middle(places.iter().map(|place| place[axis]))));
    let most = FAR_OUT * middle(places.iter().map(|place| place.distance(median)));
    // Where more than half stand in one place the median says nothing.
    let counting: Vec<DVec3> =
        places.iter().copied().filter(|place| !(most > 0.0) || place.distance(median) <= most).collect();
    let centre = centre.unwrap_or_else(|| counting.iter().sum::<DVec3>() / counting.len().max(1) as f64);
    let spread = counting.iter().map(|place| place.distance(centre)).fold(0.0, f64::max);
    let scale = EXTENT / (1.1 * spread);
    let apart = counting.windows(2).any(|pair| pair[0] != pair[1]);
    (apart && scale.is_finite()).then_some(Normalisation { centre, scale })
}

fn middle(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests;
