//! From a listing to a capture: pixels decoded, cameras and points in the common frame.

use std::collections::BTreeSet;
use std::path::Path;

use glam::DVec3;

use super::diagnose::{doubts, doubts_of_pixels};
use super::error::MIN_TRAIN_VIEWS;
use super::framing::Framing;
use super::listing::{ListedView, Listing, Shot, commonest};
use super::looks::Looks;
use super::points::Points;
use super::scene_kind::taken_for;
use super::storage::{LoadedView, load_views};
use super::{
    Capture, DatasetError, EXTENT, Finding, LoadOptions, LoadReport, Normalisation, PointsOrigin, Severity,
    SkippedView, Split, View, made_points, starting_points,
};

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
    let too_few_views = |path, usable, faults| DatasetError::TooFewViews {
        path,
        usable,
        listed,
        held_out,
        needed: MIN_TRAIN_VIEWS,
        faults,
    };
    // Before decoding anything, if what is known does not do.
    let usable = listing.shots(Split::Train).count();
    if usable < MIN_TRAIN_VIEWS {
        let faults = listing.views.iter().filter(|view| view.split == Split::Train);
        let faults = faults.filter_map(|view| Some(format!("{}: {}", view.name, view.shot.as_ref().err()?)));
        return Err(too_few_views(listing.source.clone(), usable, faults.collect()));
    }
    frame(listing.shots(Split::Train).map(Shot::centre_world), &listing.source)?;
    let mut warnings = doubts(&listing, options);
    warnings.retain(|finding| finding.severity == Severity::Warning);
    let Listing { layout, source, views, points, unposed, notes } = listing;
    let (doubtful, notes): (Vec<_>, Vec<_>) = notes.into_iter().partition(|note| note.severity != Severity::Note);
    warnings.extend(doubtful.iter().map(|note| Finding::told(note.severity, note.code, &note.text)));
    let mut notes: Vec<String> = notes.into_iter().map(|note| note.text).collect();

    let Decoded { mut train, shots, mut test, mut skipped, looks, doubts } = decoded(views, options)?;
    warnings.extend(doubts);
    // The sort keeps the capture's order within each split.
    skipped.sort_by_key(|view| view.split);
    if train.len() < MIN_TRAIN_VIEWS {
        let faults = skipped.iter().filter(|view| view.split == Split::Train).map(ToString::to_string).collect();
        return Err(too_few_views(source, train.len(), faults));
    }
    let normalisation = frame(train.iter().map(|view| view.camera.centre_world()), &source)?;
    for view in train.iter_mut().chain(&mut test) {
        view.camera = normalisation.camera(&view.camera);
    }
    if n_without_alpha > 0 && n_with_alpha > n_without_alpha {
        notes.push(format!(
            "images without an alpha channel: {n_without_alpha}; what they show behind the object is trained as part \
             of it; export RGBA to have the background {} there",
            options.background
        ));
    }
    if n_with_alpha > 0 && n_with_alpha <= n_without_alpha {
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
    let taken = taken_for(&looks, options.scene);
    let shown = looks.iter().map(|looks| looks.shown).sum::<f64>() / train.len() as f64;
    let brought = points.map(|(_, points)| points).filter(|points| !points.is_empty() && options.points.is_none());
    let (given, points_origin, points_seconds, made_points) = match brought {
        Some(points) if points.len() >= made_points::FEW_OWN_POINTS => {
            (Some(points), PointsOrigin::Capture, None, None)
        }
        own => {
            let n_own = own.as_ref().map_or(0, Points::len);
            match made_points::made(&shots, (taken.kind, shown), n_own, &normalisation, options, &mut notes) {
                Some(made) => (Some(made.points_world), made.origin, made.seconds, Some(made.file)),
                None => match own {
                    Some(points) => (Some(points), PointsOrigin::Capture, None, None),
                    None => (None, PointsOrigin::Random, None, None),
                },
            }
        }
    };
    let kept = given.map(|points| {
        let (points, note) = starting_points::kept(&points, &normalisation);
        notes.extend(note);
        points
    });
    let cameras: Vec<_> = train.iter().map(|view| &view.camera).collect();
    let (points, points_origin) = match kept.filter(|points| !points.is_empty()) {
        Some(points) => (points, points_origin),
        None => {
            let at = starting_points::random(&cameras, taken.kind, &normalisation, options);
            (Points { at, rgb: Vec::new() }, PointsOrigin::Random)
        }
    };
    let background = match taken.backdrop {
        Some(rgb8) => rgb8.map(|channel| f32::from(channel) / 255.0),
        None => options.background.rgb(),
    };
    let report = LoadReport {
        layout,
        background: options.background,
        backdrop: taken.backdrop,
        scene: taken.kind,
        because: taken.because,
        n_train: train.len(),
        n_test: test.len(),
        source_size_px,
        size_px: Framing::of(source_size_px, options).map_or(source_size_px, |framing| framing.size_px),
        n_sizes,
        n_points: points.len(),
        points_origin,
        points_seconds,
        skipped,
        unposed,
        warnings,
        notes,
    };
    let scene = taken.kind;
    let capture = Capture {
        train,
        test,
        points: points.at,
        point_colours: points.rgb,
        points_origin,
        made_points,
        scene,
        normalisation,
        extent: EXTENT,
        background,
        shown,
    };
    Ok((capture, report))
}

/// Views whose pixels were decoded.
#[derive(Default)]
struct Decoded {
    train: Vec<View>,
    /// Those of `train`.
    shots: Vec<Shot>,
    test: Vec<View>,
    skipped: Vec<SkippedView>,
    /// Of the views to train on.
    looks: Vec<Looks>,
    /// What the pixels make doubtful.
    doubts: Vec<Finding>,
}

fn decoded(views: Vec<ListedView>, options: &LoadOptions) -> Result<Decoded, DatasetError> {
    let mut decoded = Decoded::default();
    let shots: Vec<Option<Shot>> = views.iter().map(|view| view.shot.as_ref().ok().cloned()).collect();
    let mut seen = Vec::new();
    for (LoadedView { split, name, view }, shot) in load_views(views, options)?.into_iter().zip(shots) {
        match view {
            Ok((view, looks)) => {
                seen.extend(shot.clone().map(|shot| (name, shot, looks)));
                match split {
                    Split::Train => {
                        decoded.shots.extend(shot);
                        decoded.train.push(view);
                        decoded.looks.push(looks);
                    }
                    Split::Test => decoded.test.push(view),
                }
            }
            Err(fault) => decoded.skipped.push(SkippedView { split, name, fault }),
        }
    }
    let seen: Vec<_> = seen.iter().map(|(name, shot, looks)| ((name.as_str(), shot), *looks)).collect();
    decoded.doubts = doubts_of_pixels(&seen);
    Ok(decoded)
}

/// The common frame of training cameras with these centres.
fn frame(centres: impl Iterator<Item = DVec3>, source: &Path) -> Result<Normalisation, DatasetError> {
    let no_baseline = |spread| DatasetError::NoBaseline { path: source.to_owned(), spread };
    Normalisation::of_cameras(&centres.collect::<Vec<_>>()).map_err(no_baseline)
}
