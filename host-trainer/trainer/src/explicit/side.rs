//! From which side a scene was made to be seen: as an object from around it, or as a room from its inside.
//!
//! What is opaque in a scene was seen by whoever made it; the rest is not there, or is thin. So small pictures are taken from around the
//! bulk, at the heights of someone who walks around it, from below, and from free places inside. What is seen from inside alone was seen
//! from there.

mod seen;

use std::f64::consts::TAU;

use glam::DVec3;
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::Normalisation;
use pocketsplat_gaussians::Gaussians;

use super::bulk::{Bulk, weights};
use super::frame;
use super::up::Up;
use super::views::{FIELD_INSIDE, Side, all_around, around_at, camera, direction, inside_place};
use seen::{Looker, Sight};

/// Width and height of the pictures, px.
const SIDE_PX: u32 = 64;
/// Of those that only tell whether anything is there.
const COARSE_PX: u32 = 16;
/// Cameras of each height around the bulk.
const N_AROUND: usize = 8;
/// Sines of the heights of someone who walks around.
const WALKING: [f64; 2] = [0.1, 0.5];
/// Places inside that are tried, and those that are looked from.
const N_PLACES: usize = 24;
const N_INSIDE: usize = 4;
/// Directions of each place inside.
const N_TURNS: usize = 6;
/// Radius of the bulk in the frame of the pictures, where what is nearer than 0.2 is not drawn.
const RADIUS: f64 = 5.0;
/// What is farther out than so many radii is left out: a sky encloses everything.
const OUTERMOST: f64 = 1.2;

/// A place inside is enclosed where so much of all directions is blocked.
const ENCLOSED: f64 = 0.6;
/// The inside is the right side where so much of the scene is seen from there alone, and so much more of all of it.
const LEAD: f64 = 0.04;
/// A scene is hollow where from inside at least this share is seen of what is seen from around: cavities of an object show little.
const WHOLE: f64 = 0.8;
/// A ground hides a scene where cameras below miss this share of what those on their level see.
const GROUND: f64 = 0.3;

/// What the pictures show.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Evidence {
    /// Share of all directions that something blocks, as seen from the most enclosed free place inside; 0 without one.
    pub enclosed: f64,
    /// Share of the bulk that is seen from around it, and from inside.
    pub seen_around: f64,
    /// See [`Self::seen_around`].
    pub seen_inside: f64,
    /// Share that is seen from inside alone, less what is seen from around alone; of both only what is not seen from below, as
    /// the floor is under furniture.
    pub content: f64,
    /// Share of what is seen on the level that is not seen from below.
    pub hidden_from_below: f64,
    /// Angle about the up axis from which most is seen, radians.
    pub front: f64,
}

impl Evidence {
    /// The side from which the scene was made to be seen.
    pub fn side(&self) -> Side {
        let lead = self.content.min(self.seen_inside - self.seen_around);
        if self.is_hollow() && lead > LEAD { Side::Inside } else { Side::Around }
    }

    /// Whether it is hollow, and no more of it is seen from inside: so are an empty room, a tube and the shell of an object.
    pub fn could_be_either(&self) -> bool {
        self.is_hollow() && self.side() == Side::Around
    }

    fn is_hollow(&self) -> bool {
        self.enclosed >= ENCLOSED && self.seen_inside >= WHOLE * self.seen_around
    }

    /// Whether cameras below would see the underside of a ground and little else.
    pub fn has_ground(&self) -> bool {
        self.hidden_from_below > GROUND
    }

    /// Cost: some 200 small pictures.
    ///
    /// * `compensation`: whether the file asks for it.
    pub fn of(gaussians: &Gaussians, compensation: bool, bulk: &Bulk, up: Up) -> Self {
        let near = |i: &usize| {
            DVec3::from(gaussians.centres[*i].map(f64::from)).distance(bulk.centre) <= OUTERMOST * bulk.radius
        };
        let chosen: Vec<usize> = (0..gaussians.len()).filter(near).collect();
        let mut normalised = gaussians.clone();
        let all = weights(gaussians);
        let weights: Vec<f64> = chosen.iter().map(|i| all[*i]).collect();
        let normalisation = Normalisation { centre: bulk.centre, scale: RADIUS / bulk.radius };
        frame::to_normalised(&mut normalised, &normalisation);
        let looker = Looker::new(&normalised, compensation, &chosen, weights);
        let look = |cameras: &[Camera]| -> Vec<Sight> {
            cameras.iter().map(|camera| looker.look(&normalisation.camera(camera))).collect()
        };
        let ring = |rise: f64| -> Vec<Camera> {
            let azimuth = |i: usize| TAU * i as f64 / N_AROUND as f64;
            (0..N_AROUND).map(|i| around_at(bulk, up, direction(up, rise, azimuth(i)), 1.0, [SIDE_PX; 2])).collect()
        };
        let [low, high] = WALKING.map(|rise| look(&ring(rise)));
        let shown = |i: usize| looker.share(&low[i]) + looker.share(&high[i]);
        let front = (0..N_AROUND)
            .max_by(|a, b| shown(*a).total_cmp(&shown(*b)))
            .map_or(0.0, |i| TAU * i as f64 / N_AROUND as f64);
        let (level, below) = (looker.best(&low), looker.best(&look(&ring(-WALKING[1]))));
        let around = looker.best(&low.into_iter().chain(high).collect::<Vec<_>>());

        let mut places: Vec<(f64, DVec3)> = (0..N_PLACES)
            .map(|i| inside_place(bulk, i))
            .filter(|place| bulk.is_free(*place))
            .map(|place| {
                let cameras = all_around(place, up, COARSE_PX).map(|camera| normalisation.camera(&camera));
                (looker.blocked(&cameras), place)
            })
            .collect();
        places.sort_by(|a, b| b.0.total_cmp(&a.0));
        let enclosed = places.first().map_or(0.0, |(share, _)| *share);
        let turned = |place: DVec3| {
            (0..N_TURNS).flat_map(move |i| {
                [0.5, -0.5].map(|rise| {
                    let forward = direction(up, rise, TAU * i as f64 / N_TURNS as f64);
                    camera(place, forward, up, FIELD_INSIDE, [SIDE_PX; 2])
                })
            })
        };
        let cameras: Vec<Camera> = places.iter().take(N_INSIDE).flat_map(|(_, place)| turned(*place)).collect();
        let inside = looker.best(&look(&cameras));
        let more =
            inside.iter().zip(&around).zip(&below).map(|((inside, around), below)| (1.0 - below) * (inside - around));
        let weighted = |seen: &[f64]| looker.weighted(seen.iter().copied());
        let hidden = looker.weighted(level.iter().zip(&below).map(|(level, below)| level * (1.0 - below)));
        Self {
            enclosed,
            seen_around: weighted(&around),
            seen_inside: weighted(&inside),
            content: looker.weighted(more),
            hidden_from_below: hidden / weighted(&level).max(f64::MIN_POSITIVE),
            front,
        }
    }
}

#[cfg(test)]
mod tests;
