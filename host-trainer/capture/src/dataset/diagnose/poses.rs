//! Findings about where the cameras stand.

use std::path::PathBuf;

use glam::DVec3;

use super::{Finding, Severity};
use crate::dataset::listing::{Listing, Shot};
use crate::dataset::report::first_few;
use crate::dataset::{DatasetError, Normalisation};

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
    let sound: Vec<(&str, &Shot)> =
        listing.views.iter().filter_map(|view| Some((view.name.as_str(), view.shot.as_ref().ok()?))).collect();
    let centres: Vec<DVec3> = sound.iter().map(|(_, shot)| shot.centre_world()).collect();
    let middle = middle(&centres);
    let median_distance = median(centres.iter().map(|centre| centre.distance(middle)).collect());
    let ratio = |centre: &DVec3| centre.distance(middle) / median_distance;
    let far: Vec<usize> = (0..sound.len()).filter(|&i| ratio(&centres[i]) > OUTLIER_RATIO).collect();
    if far.is_empty() || median_distance == 0.0 {
        return;
    }
    let names: Vec<String> = far.iter().map(|&i| sound[i].0.to_owned()).collect();
    let farthest = far.iter().map(|&i| ratio(&centres[i])).fold(0.0, f64::max);
    let message = format!(
        "cameras far from the others: {} ({}); the farthest stands {farthest:.0} times the median distance from the \
         middle of all",
        names.len(),
        first_few(&names)
    );
    let remedy = "take these views out: their poses are probably wrong, and all others shrink to make room for them";
    let finding = Finding::new(Severity::Warning, "pose-outlier", message, remedy)
        .files(far.iter().map(|&i| sound[i].1.path.clone()))
        .number("views", names.len() as f64)
        .number("farthest_ratio", farthest)
        .number("median_distance", median_distance);
    findings.push(finding);
}

fn repeated(listing: &Listing, findings: &mut Vec<Finding>) {
    let mut poses: Vec<([u64; 12], &str, PathBuf)> = Vec::new();
    for view in &listing.views {
        if let Ok(shot) = &view.shot {
            let mut bits = [0; 12];
            let numbers = shot.rotation.to_cols_array().into_iter().chain(shot.translation.to_array());
            bits.iter_mut().zip(numbers).for_each(|(bits, number)| *bits = number.to_bits());
            poses.push((bits, &view.name, shot.path.clone()));
        }
    }
    poses.sort_unstable();
    let same: Vec<_> = poses.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() > 1).flatten().collect();
    if same.is_empty() {
        return;
    }
    let names: Vec<String> = same.iter().map(|(_, name, _)| (*name).to_owned()).collect();
    let message = format!("views that share their pose with another: {} ({})", names.len(), first_few(&names));
    let remedy = "check that they were taken from one place; if not, their poses were not estimated but copied";
    let finding = Finding::new(Severity::Warning, "repeated-pose", message, remedy);
    findings.push(finding.number("views", names.len() as f64).files(same.iter().map(|(_, _, path)| path.clone())));
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
