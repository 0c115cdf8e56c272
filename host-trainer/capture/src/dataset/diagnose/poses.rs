//! Findings about where the cameras stand.

use glam::DVec3;

use super::Finding;
use super::readings::{self, Misread};
use crate::dataset::listing::{Listing, Shot};
use crate::dataset::{DatasetError, Normalisation, Severity, Split};

/// Coordinates this many times the spread of the cameras lose that many digits of it.
const FAR_RATIO: f64 = 1e5;

/// Rotations whose numbers differ by less are one.
const SAME_ROTATION: f64 = 1e-6;

/// * `centres`: of the training cameras that can be used, capture units.
pub(super) fn check(listing: &Listing, centres: &[DVec3], findings: &mut Vec<Finding>) {
    if centres.is_empty() {
        return;
    }
    repeated(listing, findings);
    turned_alike(listing, findings);
    misread(listing, findings);
    match Normalisation::of_cameras(centres) {
        Err(spread) => {
            let error = DatasetError::NoBaseline { path: listing.source.clone(), spread };
            findings.push(Finding::told(Severity::Error, error.code(), &error.to_string()).number("spread", spread));
        }
        Ok(normalisation) => far_from_origin(&normalisation, findings),
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

/// Photographs that were turned have rotations that differ.
fn turned_alike(listing: &Listing, findings: &mut Vec<Finding>) {
    let views: Vec<(&str, &Shot)> = listing.sound().collect();
    let Some((_, first)) = views.first() else { return };
    if views.iter().all(|(_, shot)| shot.rotation.abs_diff_eq(first.rotation, SAME_ROTATION)) {
        let remedy = "right for a row of cameras or a slider; if the photographs were turned, export the poses with their rotations";
        let what = "views that all have one and the same rotation";
        findings.extend(Finding::about(&views, Severity::Warning, "one-rotation", what, remedy));
    }
}

fn misread(listing: &Listing, findings: &mut Vec<Finding>) {
    let shots: Vec<&Shot> = listing.shots(Split::Train).collect();
    let Some(misread) = readings::misread(&shots) else { return };
    let (code, what, remedy) = match misread {
        Misread::Inverted => (
            "inverted-poses",
            "the cameras do not look at one thing, but they would if their poses were the inverse of what they are",
            "check which way the poses go: transforms.json, NSVF and Record3D take the camera to the world, COLMAP the world to the camera",
        ),
        Misread::Mirrored => (
            "mirrored-poses",
            "the cameras do not look at one thing, but they would if one coordinate of their places had the other sign",
            "export places and rotations in the same axes: left- and right-handed ones do not mix",
        ),
    };
    findings.push(Finding::new(Severity::Warning, code, what.to_owned(), remedy));
}
