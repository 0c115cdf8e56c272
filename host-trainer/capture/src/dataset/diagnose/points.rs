//! Findings about initial points, and about cameras and points together.

use std::path::Path;

use glam::DVec3;

use pocketsplat_files::shown;

use super::Finding;
use crate::dataset::Severity;
use crate::dataset::apart::{Spread, quantile};
use crate::dataset::listing::{Listing, Shot};

/// Fewer points than this outline no scene.
const FEW_POINTS: usize = 100;

/// How many points are projected at most; enough for a share to a few per cent.
const N_PROJECTED: usize = 1000;

/// Triangulated points are all in some image; where fewer are, points and poses are not of one reconstruction.
const MIN_SEEN_SHARE: f64 = 0.5;

/// Points that span less than this share of an image, where a middling camera sees them, are in another unit than the poses.
const MIN_SPANNED: f64 = 0.02;

/// A scene this many times the cameras' spread away shows no parallax.
const MAX_DEPTH_RATIO: f64 = 50.0;

/// * `centres`: of the training cameras that can be used, capture units.
pub(super) fn check(listing: &Listing, centres: &[DVec3], findings: &mut Vec<Finding>) {
    let Some((path, points)) = listing.points.as_ref().filter(|(_, points)| !points.is_empty()) else { return };
    let points = &points.at;
    let finite: Vec<DVec3> = points.iter().copied().filter(|point| point.is_finite()).collect();
    if let Some(first) = points.iter().position(|point| !point.is_finite()) {
        let n_lost = points.len() - finite.len();
        let message = format!(
            "`{}`: {n_lost} of {} points have a coordinate that is no finite number, the first is point {first} (counted \
             from 0): {}, needed: finite numbers",
            shown(path),
            points.len(),
            points[first]
        );
        let remedy = "these points are left out; export the points again if many are";
        let finding = Finding::new(Severity::Warning, "non-finite-points", message, remedy).files([path.clone()]);
        findings.push(finding.number("points", points.len() as f64).number("not_finite", n_lost as f64));
    }
    let points = finite;
    if points.len() < FEW_POINTS {
        let message = format!(
            "`{}` holds {} points, needed: at least {FEW_POINTS} to outline a scene",
            shown(path),
            points.len()
        );
        let remedy = "reconstruct again with more matches, or take the file out, and training makes points";
        let finding = Finding::new(Severity::Warning, "few-points", message, remedy).files([path.clone()]);
        findings.push(finding.number("points", points.len() as f64).number("needed", FEW_POINTS as f64));
    }
    if centres.is_empty() || points.is_empty() {
        return;
    }
    let projected: Vec<DVec3> = points.iter().copied().step_by(points.len().div_ceil(N_PROJECTED)).collect();
    let shots: Vec<&Shot> = listing.views.iter().flat_map(|view| &view.shot).collect();
    let n_seen = projected.iter().filter(|point| shots.iter().any(|shot| sees(shot, **point))).count();
    let share = n_seen as f64 / projected.len() as f64;
    if share < MIN_SEEN_SHARE {
        let message = format!(
            "only {:.0} % of the points of `{}` fall into an image, needed: at least {:.0} %, so points and poses do not fit",
            100.0 * share,
            shown(path),
            100.0 * MIN_SEEN_SHARE
        );
        let remedy = "use points and poses of one reconstruction, in one frame and one unit";
        let finding = Finding::new(Severity::Warning, "points-unseen", message, remedy).files([path.clone()]);
        findings.push(finding.number("seen_share", share));
    }
    too_small(path, &projected, &shots, findings);
    let mean = centres.iter().sum::<DVec3>() / centres.len() as f64;
    let spread = centres.iter().map(|centre| centre.distance(mean)).fold(0.0, f64::max);
    let depth = quantile(projected.iter().map(|point| point.distance(mean)), 0.5);
    if spread > 0.0 && depth > MAX_DEPTH_RATIO * spread {
        let message = format!(
            "the cameras stand within {spread:.3e} of each other and the scene {depth:.3e} away, {:.0} times as far, so \
             there is hardly any parallax",
            depth / spread
        );
        let remedy = "take photographs from places farther apart, not only in other directions";
        let finding = Finding::new(Severity::Warning, "little-parallax", message, remedy);
        findings.push(finding.number("spread", spread).number("median_depth", depth));
    }
}

/// Tells where all points lie in a spot: seen by every camera, but in another unit.
fn too_small(path: &Path, points: &[DVec3], shots: &[&Shot], findings: &mut Vec<Finding>) {
    let cloud = Spread::of(points);
    let span = |shot: &&Shot| {
        let (width_px, focal_px) = (f64::from(shot.lens.size_px.0), shot.lens.focal_px[0]);
        2.0 * cloud.median_distance * focal_px / (cloud.distance(shot.centre_world()) * width_px)
    };
    let spanned = quantile(shots.iter().map(span), 0.5);
    if spanned < MIN_SPANNED && cloud.median_distance > 0.0 {
        let message = format!(
            "half of the points of `{}` span {:.2} % of an image's width, needed: at least {:.0} %, so points and poses are in \
             different units",
            path.display(),
            100.0 * spanned,
            100.0 * MIN_SPANNED
        );
        let remedy = "use points and poses of one reconstruction, in one frame and one unit";
        let finding = Finding::new(Severity::Warning, "points-small", message, remedy).files([path.to_owned()]);
        findings.push(finding.number("spanned_share", spanned));
    }
}

/// Whether a point falls into the undistorted image.
fn sees(shot: &Shot, point_world: DVec3) -> bool {
    let cam = shot.rotation * point_world + shot.translation;
    let [u, v] = shot.lens.pixel([cam.x / cam.z, cam.y / cam.z]);
    let (width_px, height_px) = shot.lens.size_px;
    cam.z > 0.0 && (0.0..=f64::from(width_px)).contains(&u) && (0.0..=f64::from(height_px)).contains(&v)
}
