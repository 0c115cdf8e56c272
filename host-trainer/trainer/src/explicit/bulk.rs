//! Where most of a scene is, whatever floats around it.

mod body;

use glam::DVec3;
use pocketsplat_gaussians::Gaussians;

use body::{Body, Cells};
use pocketsplat_kernels::ops::image::project::ALPHA_CUTOFF;
use pocketsplat_kernels::real::Real;

/// The place of most of what is opaque and large.
///
/// All of it comes from weighted medians and from what hangs together around them, so that a tenth of the weight, put anywhere, changes
/// it little. Weights are opacity times size, sizes being cut off at four times the median.
#[derive(Clone, Debug, PartialEq)]
pub struct Bulk {
    /// Middle of the 2nd to 98th percentiles along each axis.
    pub centre: DVec3,
    /// 99th percentile of the distances from there.
    pub radius: f64,
    /// Half the way from the 10th to the 90th percentile along each axis.
    pub half_range: DVec3,
    /// Gaussians that lie apart from it.
    pub n_apart: usize,
    /// Those of them that lie more than [`STRAY_RADII`] radii out.
    pub n_strays: usize,
    /// Distance of the farthest Gaussian from the centre.
    pub farthest: f64,
    cells: Cells,
}

/// Gaussians more than so many radii out are strays, where nothing begins: the lattice of a bundle has to reach them, and becomes coarse.
///
/// The far ground and sky of captures lie within 100 radii.
pub const STRAY_RADII: f64 = 100.0;

/// A Gaussian's size counts up to so many times that of the middle one, so that a few huge ones decide nothing.
const LARGEST_SIZE: f64 = 4.0;

/// Opacity times size of each Gaussian: the geometric mean of its deviations, cut off. What is too faint to be drawn weighs nothing.
pub(super) fn weights(gaussians: &Gaussians) -> Vec<f64> {
    let size = |s: &[f32; 3]| (s.iter().map(|s| f64::from(*s)).sum::<f64>() / 3.0).exp();
    let sizes: Vec<f64> = gaussians.log_scales.iter().map(size).collect();
    let mut sorted = sizes.clone();
    sorted.sort_by(f64::total_cmp);
    let most = LARGEST_SIZE * sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    let drawn = |opacity: f64| if opacity < ALPHA_CUTOFF { 0.0 } else { opacity };
    let opacities = gaussians.opacity_logits.iter().map(|logit| drawn(f64::from(logit.sigmoid())));
    sizes.into_iter().zip(opacities).map(|(size, opacity)| size.min(most) * opacity).collect()
}

/// Whether no Gaussian is opaque enough to be drawn.
pub fn shows_nothing(gaussians: &Gaussians) -> bool {
    weights(gaussians).iter().all(|weight| *weight == 0.0)
}

impl Bulk {
    /// `None` where nothing is opaque, or all of it is in one point.
    pub fn of(gaussians: &Gaussians) -> Option<Self> {
        let weights = weights(gaussians);
        let centres: Vec<DVec3> = gaussians.centres.iter().map(|c| DVec3::from(c.map(f64::from))).collect();
        let Body { members, cells } = Body::of(&centres, &weights)?;
        let weights_of_body: Vec<f64> = members.iter().map(|i| weights[*i]).collect();
        let range = |[low, high]: [f64; 2]| {
            [0, 1, 2].map(|axis: usize| {
                let along: Vec<f64> = members.iter().map(|i| centres[*i][axis]).collect();
                [low, high].map(|share| percentile(&along, &weights_of_body, share))
            })
        };
        let centre = DVec3::from(range([0.02, 0.98]).map(|[low, high]| 0.5 * (low + high)));
        let half_range = DVec3::from(range([0.1, 0.9]).map(|[low, high]| 0.5 * (high - low)));
        let from_centre: Vec<f64> = members.iter().map(|i| centres[*i].distance(centre)).collect();
        let radius = percentile(&from_centre, &weights_of_body, 0.99);
        if !(radius > 0.0 && radius.is_finite() && centre.is_finite()) {
            return None;
        }
        let distances = || centres.iter().map(|c| c.distance(centre));
        Some(Self {
            centre,
            radius,
            half_range,
            n_apart: centres.len() - members.len(),
            n_strays: distances().filter(|distance| *distance > STRAY_RADII * radius).count(),
            farthest: distances().fold(0.0, f64::max),
            cells,
        })
    }

    /// Whether a point of the splats' frame is a stray's.
    pub fn is_stray(&self, point: DVec3) -> bool {
        !(point.distance(self.centre) <= STRAY_RADII * self.radius)
    }

    /// Whether next to nothing of the bulk is within an eighth of its median distance: a camera may stand there.
    pub fn is_free(&self, place: DVec3) -> bool {
        self.cells.is_free(place)
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
pub(super) mod tests;
