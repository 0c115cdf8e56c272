//! Findings about where the cameras stand.

use glam::DVec3;

use super::Finding;
use crate::dataset::listing::{Listing, Shot};
use crate::dataset::{DatasetError, Normalisation, Severity};

/// A camera this many median distances from the middle of all is no part of the capture.
const OUTLIER_RATIO: f64 = 10.0;

/// Coordinates this many times the spread of the cameras lose that many digits of it.
const FAR_RATIO: f64 = 1e5;

/// * `centres`: of the training cameras that can be used, capture units.
pub(super) fn check(listing: &Listing, centres: &[DVec3], findings: &mut Vec<Finding>) {
    if centres.is_empty() {
        return;
    }
    outliers(listing, findings);
    repeated(listing, findings);
    match Normalisation::of_cameras(centres) {
        Err(spread) => {
            let error = DatasetError::NoBaseline { path: listing.source.clone(), spread };
            findings.push(Finding::told(Severity::Error, error.code(), &error.to_string()).number("spread", spread));
        }
        Ok(normalisation) => far_from_origin(&normalisation, findings),
    }
}

/// The median of each coordinate, which a few outliers do not move.
fn middle(centres: &[DVec3]) -> DVec3 {
    DVec3::from_array([0, 1, 2].map(|axis| median(centres.iter().map(|centre| centre[axis]).collect())))
}

/// The upper median; 0 for no values.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

fn outliers(listing: &Listing, findings: &mut Vec<Finding>) {
    let centres: Vec<DVec3> = listing.sound().map(|(_, shot)| shot.centre_world()).collect();
    let middle = middle(&centres);
    let median_distance = median(centres.iter().map(|centre| centre.distance(middle)).collect());
    let ratio = |shot: &Shot| shot.centre_world().distance(middle) / median_distance;
    let far: Vec<(&str, &Shot)> = listing.sound().filter(|(_, shot)| ratio(shot) > OUTLIER_RATIO).collect();
    let remedy = "take these views out: their poses are probably wrong, and all others shrink to make room for them";
    let finding = Finding::about(&far, Severity::Warning, "pose-outlier", "cameras far from the others", remedy);
    if let Some(mut finding) = finding.filter(|_| median_distance > 0.0) {
        let farthest = far.iter().map(|(_, shot)| ratio(shot)).fold(0.0, f64::max);
        finding.message +=
            &format!("; the farthest stands {farthest:.0} times the median distance from the middle of all");
        findings.push(finding.number("farthest_ratio", farthest).number("median_distance", median_distance));
    }
}

fn repeated(listing: &Listing, findings: &mut Vec<Finding>) {
    let pose = |shot: &Shot| -> Vec<u64> {
        let numbers = shot.rotation.to_cols_array().into_iter().chain(shot.translation.to_array());
        numbers.map(f64::to_bits).collect()
    };
    let mut views: Vec<(&str, &Shot)> = listing.sound().collect();
    views.sort_by_cached_key(|(name, shot)| (pose(shot), *name));
    let same = views.chunk_by(|a, b| pose(a.1) == pose(b.1)).filter(|same| same.len() > 1);
    let same: Vec<(&str, &Shot)> = same.flatten().copied().collect();
    let remedy = "check that they were taken from one place; if not, their poses were not estimated but copied";
    let what = "views that share their pose with another";
    findings.extend(Finding::about(&same, Severity::Warning, "repeated-pose", what, remedy));
}

fn far_from_origin(normalisation: &Normalisation, findings: &mut Vec<Finding>) {
    let spread = super::super::EXTENT / (1.1 * normalisation.scale);
    let distance = normalisation.centre.length();
    if distance > FAR_RATIO * spread {
        let message = format!(
            "the cameras stand within {spread:.3e} of each other but {distance:.3e} from the origin, so their coordinates \
             hold few digits of where they are"
        );
        let remedy = "subtract a common offset from all poses and points, as for coordinates of a map";
        let finding = Finding::new(Severity::Warning, "far-from-origin", message, remedy);
        findings.push(finding.number("spread", spread).number("distance", distance));
    }
}
