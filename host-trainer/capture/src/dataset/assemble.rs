//! From a listing to a capture: pixels decoded, cameras and points in the common frame.

use std::collections::BTreeSet;

use glam::DVec3;

use super::error::MIN_TRAIN_VIEWS;
use super::framing::Framing;
use super::listing::{Listing, commonest};
use super::normalise::random_points_world;
use super::storage::{LoadedView, load_views};
use super::{
    Capture, DatasetError, EXTENT, Layout, LoadOptions, LoadReport, Normalisation, PointsOrigin, SkippedView, Split,
    frusta,
};

/// Points farther from the cameras than this many extents show no parallax and only cost precision.
const MAX_POINT_EXTENTS: f64 = 1000.0;

/// Decodes the views of a listing and brings all of it to the common frame.
///
/// # Errors
/// [`DatasetError::TooFewViews`] or [`DatasetError::NoBaseline`], and those of a cache.
pub(super) fn assemble(listing: Listing, options: &LoadOptions) -> Result<(Capture, LoadReport), DatasetError> {
    let sizes_px = |split| listing.shots(split).map(|shot| shot.header.size_px);
    let source_size_px = commonest(sizes_px(Split::Train)).unwrap_or_default();
    let n_sizes = sizes_px(Split::Train).chain(sizes_px(Split::Test)).collect::<BTreeSet<_>>().len();
    let shots = || listing.views.iter().flat_map(|view| &view.shot);
    let n_without_alpha = shots().filter(|shot| !shot.header.has_alpha).count();
    let n_with_alpha = shots().count() - n_without_alpha;
    let listed = listing.n_listed(Split::Train);
    let held_out = listing.n_held_out_by(options.test_every);
    // Before decoding anything, if that many are already known not to do.
    if listing.shots(Split::Train).count() < MIN_TRAIN_VIEWS {
        let faults = listing.views.iter().filter(|view| view.split == Split::Train);
        let faults = faults.filter_map(|view| Some(format!("{}: {}", view.name, view.shot.as_ref().err()?)));
        return Err(too_few_views(&listing, listed, held_out, faults.collect()));
    }
    let Listing { layout, source, views, points, unposed, notes } = listing;
    let mut notes: Vec<String> = notes.into_iter().map(|note| note.text).collect();
    let (mut train, mut test, mut skipped) = (Vec::new(), Vec::new(), Vec::new());
    let mut sum_shown = 0.0;
    for LoadedView { split, name, view } in load_views(views, options)? {
        match (view, split) {
            (Ok((view, shown)), Split::Train) => {
                train.push(view);
                sum_shown += shown;
            }
            (Ok((view, _)), Split::Test) => test.push(view),
            (Err(fault), split) => skipped.push(SkippedView { split, name, fault }),
        }
    }
    // The sort keeps the capture's order within each split.
    skipped.sort_by_key(|view| view.split);
    if train.len() < MIN_TRAIN_VIEWS {
        let faults = skipped.iter().filter(|view| view.split == Split::Train).map(ToString::to_string).collect();
        return Err(DatasetError::TooFewViews {
            path: source,
            usable: train.len(),
            listed,
            held_out,
            needed: MIN_TRAIN_VIEWS,
            faults,
        });
    }
    let centres: Vec<DVec3> = train.iter().map(|view| view.camera.centre_world()).collect();
    let normalisation =
        Normalisation::of_cameras(&centres).map_err(|spread| DatasetError::NoBaseline { path: source, spread })?;
    for view in train.iter_mut().chain(&mut test) {
        view.camera = normalisation.camera(&view.camera);
    }
    if layout == Layout::Blender && n_without_alpha > 0 {
        notes.push(format!(
            "images without an alpha channel: {n_without_alpha}; what they show behind the object is trained as part \
             of it; export RGBA to have the background {} there",
            options.background
        ));
    }
    if layout != Layout::Blender && n_with_alpha > 0 {
        notes.push(format!(
            "photographs with an alpha channel: {n_with_alpha}; what is transparent is trained as {} background; give masks \
             to leave it out of training instead",
            options.background
        ));
    }
    let n_masked = train.iter().chain(&test).filter(|view| view.has_mask()).count();
    if n_masked > 0 {
        notes
            .push(format!("images with pixels that do not count (no source in the photograph, or masked): {n_masked}"));
    }
    let given = points.map(|(_, points)| kept_points(&points, &normalisation, &mut notes));
    let cameras: Vec<_> = train.iter().map(|view| &view.camera).collect();
    let where_cameras_look = || frusta::random_points(&cameras, options.n_random_points, options.seed);
    let (points, points_origin) = match given.filter(|points| !points.is_empty()) {
        Some(points) => (points, PointsOrigin::Capture),
        None if layout == Layout::Blender => {
            let cube = random_points_world(options.n_random_points, options.seed);
            let cube: Vec<_> = cube.into_iter().map(|point| normalisation.point(point)).collect();
            if frusta::are_seen(&cube, &cameras) {
                (cube, PointsOrigin::Random)
            } else {
                notes.push(
                    "the cameras do not look at the cube of ±1.3 around the origin, where scenes of Synthetic-NeRF lie; \
                     training starts from random points where they look"
                        .to_owned(),
                );
                (where_cameras_look(), PointsOrigin::Random)
            }
        }
        None => (where_cameras_look(), PointsOrigin::Random),
    };
    let report = LoadReport {
        layout,
        background: options.background,
        n_train: train.len(),
        n_test: test.len(),
        source_size_px,
        size_px: Framing::of(source_size_px, options).map_or(source_size_px, |framing| framing.size_px),
        n_sizes,
        n_points: points.len(),
        points_origin,
        skipped,
        unposed,
        notes,
    };
    let background = options.background.rgb();
    let shown = sum_shown / train.len() as f64;
    let capture = Capture { train, test, points, points_origin, normalisation, extent: EXTENT, background, shown };
    Ok((capture, report))
}

fn too_few_views(listing: &Listing, listed: usize, held_out: usize, faults: Vec<String>) -> DatasetError {
    let usable = listing.shots(Split::Train).count();
    DatasetError::TooFewViews {
        path: listing.source.clone(),
        usable,
        listed,
        held_out,
        needed: MIN_TRAIN_VIEWS,
        faults,
    }
}

/// The points worth starting from, normalised; says what was dropped.
fn kept_points(points_world: &[DVec3], normalisation: &Normalisation, notes: &mut Vec<String>) -> Vec<DVec3> {
    let points: Vec<DVec3> = points_world.iter().map(|&point| normalisation.point(point)).collect();
    let kept: Vec<DVec3> = points.iter().copied().filter(|p| p.length() <= MAX_POINT_EXTENTS * EXTENT).collect();
    if kept.len() < points.len() {
        notes.push(format!(
            "points left out: {} of {}; they are not finite or farther away than {MAX_POINT_EXTENTS} times the extent of \
             the cameras",
            points.len() - kept.len(),
            points.len()
        ));
    }
    kept
}
