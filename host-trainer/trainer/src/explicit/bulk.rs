//! Where most of a scene is, whatever floats around it.

use glam::DVec3;
use pocketsplat_gaussians::Gaussians;

use crate::real::Real;

/// The place of most of what is opaque and large.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bulk {
    /// Middle of the 10th to 90th percentiles along each axis.
    pub centre: DVec3,
    /// 95th percentile of the distances from there.
    pub radius: f64,
    /// Half the way from the 10th to the 90th percentile along each axis.
    pub half_range: DVec3,
    /// Whether it lies all around its centre and leaves that empty, as the walls of a room do.
    pub surrounds: bool,
}

/// A Gaussian's size counts up to so many times that of the middle one, so that a few huge ones decide nothing.
const LARGEST_SIZE: f64 = 4.0;

/// A bulk surrounds its centre where less than this share of it is nearer than [`NEAR`] of the median distance …
const EMPTY_SHARE: f64 = 0.02;
/// … of which share is meant …
const NEAR: f64 = 0.4;
/// … and each of the six directions along the axes has this share of it at least.
const SIDE_SHARE: f64 = 0.04;

/// Opacity times size of each Gaussian: the geometric mean of its deviations, cut off.
pub(super) fn weights(gaussians: &Gaussians) -> Vec<f64> {
    let size = |s: &[f32; 3]| (s.iter().map(|s| f64::from(*s)).sum::<f64>() / 3.0).exp();
    let sizes: Vec<f64> = gaussians.log_scales.iter().map(size).collect();
    let mut sorted = sizes.clone();
    sorted.sort_by(f64::total_cmp);
    let most = LARGEST_SIZE * sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    let opacities = gaussians.opacity_logits.iter().map(|logit| f64::from(logit.sigmoid()));
    sizes.into_iter().zip(opacities).map(|(size, opacity)| size.min(most) * opacity).collect()
}

impl Bulk {
    /// `None` where nothing is opaque, or all of it is in one point.
    pub fn of(gaussians: &Gaussians) -> Option<Self> {
        let weights = weights(gaussians);
        let centres: Vec<DVec3> = gaussians.centres.iter().map(|c| DVec3::from(c.map(f64::from))).collect();
        let range = [0, 1, 2].map(|axis: usize| {
            let along: Vec<f64> = centres.iter().map(|c| c[axis]).collect();
            [0.1, 0.9].map(|share| percentile(&along, &weights, share))
        });
        let centre = DVec3::from(range.map(|[low, high]| 0.5 * (low + high)));
        let half_range = DVec3::from(range.map(|[low, high]| 0.5 * (high - low)));
        let distances: Vec<f64> = centres.iter().map(|c| c.distance(centre)).collect();
        let radius = percentile(&distances, &weights, 0.95);
        if !(radius > 0.0 && radius.is_finite() && centre.is_finite()) {
            return None;
        }
        let near = NEAR * percentile(&distances, &weights, 0.5);
        let total: f64 = weights.iter().sum();
        let mut sides = [0.0; 6];
        let mut inner = 0.0;
        for ((place, distance), weight) in centres.iter().zip(&distances).zip(&weights) {
            inner += if *distance < near { *weight } else { 0.0 };
            let v = *place - centre;
            let axis = [0, 1, 2].into_iter().max_by(|a: &usize, b: &usize| v[*a].abs().total_cmp(&v[*b].abs()))?;
            sides[2 * axis + usize::from(v[axis] > 0.0)] += weight;
        }
        let surrounds = inner < EMPTY_SHARE * total && sides.iter().all(|side| *side > SIDE_SHARE * total);
        Some(Self { centre, radius, half_range, surrounds })
    }
}

/// The value below which `share` of all weight lies; NaN without weight.
fn percentile(values: &[f64], weights: &[f64], share: f64) -> f64 {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let target = share * weights.iter().sum::<f64>();
    let mut sum = 0.0;
    for i in order {
        sum += weights[i];
        if sum >= target && sum > 0.0 {
            return values[i];
        }
    }
    f64::NAN
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::finite_difference::random;

    /// Small opaque ones at these places.
    pub(in crate::explicit) fn at(places: impl IntoIterator<Item = DVec3>) -> Gaussians {
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

    fn cube(n: usize) -> impl Iterator<Item = DVec3> {
        random(5, 3 * n).chunks_exact(3).map(|v| DVec3::new(v[0], v[1], v[2])).collect::<Vec<_>>().into_iter()
    }

    #[test]
    fn far_floaters_and_a_huge_sky_move_nothing() {
        let place = DVec3::new(3.0, -1.0, 2.0);
        let mut gaussians =
            at(cube(4000).map(|p| place + p).chain((0..40).map(|i| DVec3::splat(100.0 + f64::from(i)))));
        for i in 4000..4040 {
            gaussians.log_scales[i] = [6.0; 3];
        }
        let bulk = Bulk::of(&gaussians).unwrap();
        assert!(bulk.centre.distance(place) < 0.15, "{bulk:?}");
        assert!(bulk.radius > 1.0 && bulk.radius < 2.0, "{bulk:?}");
        assert!(!bulk.surrounds);
    }

    #[test]
    fn walls_surround_and_solid_things_do_not() {
        let walls = cube(4000).map(|p| {
            let axis =
                [0, 1, 2].into_iter().max_by(|a: &usize, b: &usize| p[*a].abs().total_cmp(&p[*b].abs())).unwrap();
            let mut p = p;
            p[axis] = p[axis].signum();
            p
        });
        assert!(Bulk::of(&at(walls)).unwrap().surrounds);
        // A floor alone leaves five sides open.
        assert!(!Bulk::of(&at(cube(4000).map(|p| DVec3::new(p.x, -1.0, p.z)))).unwrap().surrounds);
    }

    #[test]
    fn nothing_has_no_bulk() {
        assert_eq!(Bulk::of(&Gaussians::default()), None);
        assert_eq!(Bulk::of(&at([DVec3::ONE; 5])), None);
    }
}
