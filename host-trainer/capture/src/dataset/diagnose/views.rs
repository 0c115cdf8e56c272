//! Findings about views: which cannot be used, and what is unusual about the others.

use std::collections::BTreeMap;
use std::path::PathBuf;

use pocketsplat_files::shown;

use super::Finding;
use crate::dataset::error::{MIN_TRAIN_VIEWS, first_few, more_training_views};
use crate::dataset::lens::USUAL_FOCAL_LENGTHS;
use crate::dataset::listing::{ListedView, Listing, commonest};
use crate::dataset::{LoadOptions, Severity, Split};

/// With fewer views than this, most places are seen from too few sides to be more than guessed.
const FEW_TRAIN_VIEWS: usize = 20;

/// Pixels of photographs are square: focal lengths along x and y that differ by more than this factor are of an image that was stretched, or
/// of a lens that was fitted badly, together with poses that are wrong too.
pub const MAX_FOCAL_RATIO: f64 = 1.05;

/// What a report on loading names by itself.
pub(super) fn not_used(listing: &Listing, findings: &mut Vec<Finding>) {
    left_out(listing, findings);
    unposed(listing, findings);
}

pub(super) fn check(listing: &Listing, options: &LoadOptions, findings: &mut Vec<Finding>) {
    counts(listing, listing.n_held_out_by(options.test_every), findings);
    own_split(listing, options.test_every, findings);
    repeated_names(listing, findings);
    lenses(listing, findings);
    alpha(listing, findings);
    depth_maps(listing, findings);
    orientation(listing, findings);
    colours(listing, findings);
    sizes(listing, findings);
}

/// One finding for each kind of fault, told by the first view that has it.
fn left_out(listing: &Listing, findings: &mut Vec<Finding>) {
    let mut by_code: BTreeMap<&'static str, Vec<&ListedView>> = BTreeMap::new();
    for view in &listing.views {
        if let Err(fault) = &view.shot {
            by_code.entry(fault.code()).or_default().push(view);
        }
    }
    let n_listed = listing.views.len();
    for (code, views) in by_code {
        let Some(Err(first)) = views.first().map(|view| &view.shot) else { continue };
        let names: Vec<String> = views.iter().map(|view| view.name.clone()).collect();
        let text =
            format!("views left out: {} of {n_listed} ({}); the first: {first}", names.len(), first_few(&names, ", "));
        let paths = views.iter().filter_map(|view| view.shot.as_ref().err()?.path().map(PathBuf::from));
        let finding = Finding::told(Severity::Warning, code, &text).files(paths);
        findings.push(finding.number("views", names.len() as f64).number("listed", n_listed as f64));
    }
}

/// * `held_out`: views that could be trained on but for `--test-every`.
fn counts(listing: &Listing, held_out: usize, findings: &mut Vec<Finding>) {
    let (usable, listed) = (listing.shots(Split::Train).count(), listing.n_listed(Split::Train));
    let (severity, code, needed, remedy) = if usable < MIN_TRAIN_VIEWS {
        (Severity::Error, "too-few-views", MIN_TRAIN_VIEWS, more_training_views(usable, held_out))
    } else if usable < FEW_TRAIN_VIEWS {
        let remedy = "take more photographs from other places, overlapping by half".to_owned();
        (Severity::Warning, "few-views", FEW_TRAIN_VIEWS, remedy)
    } else {
        return;
    };
    let message = format!(
        "`{}`: {usable} of {listed} training views can be used, needed: at least {needed}{}",
        shown(&listing.source),
        if severity == Severity::Error { "" } else { " for a good scene" }
    );
    let finding = Finding::new(severity, code, message, &remedy).files([listing.source.clone()]);
    findings.push(finding.number("usable", usable as f64).number("needed", needed as f64));
}

fn unposed(listing: &Listing, findings: &mut Vec<Finding>) {
    let n = listing.unposed.len();
    if n > 0 {
        let message = format!("images without a pose: {n} ({})", first_few(&listing.unposed, ", "));
        let remedy = "they are not used; reconstruct again with more matches if they are needed";
        let files = listing.unposed.iter().map(PathBuf::from);
        let finding = Finding::new(Severity::Warning, "unposed-image", message, remedy).files(files);
        findings.push(finding.number("images", n as f64).number("posed", listing.views.len() as f64));
    }
}

fn repeated_names(listing: &Listing, findings: &mut Vec<Finding>) {
    // By the file that was found: two names can mean one.
    let file =
        |view: &ListedView| view.shot.as_ref().map_or_else(|_| PathBuf::from(&view.name), |shot| shot.path.clone());
    let mut files: Vec<(PathBuf, &str)> = listing.views.iter().map(|view| (file(view), view.name.as_str())).collect();
    files.sort_unstable();
    let repeated: Vec<String> = files
        .chunk_by(|a, b| a.0 == b.0)
        .filter(|same| same.len() > 1)
        .filter_map(|same| same.first().map(|(_, name)| (*name).to_owned()))
        .collect();
    if !repeated.is_empty() {
        let message = format!("images listed more than once: {} ({})", repeated.len(), first_few(&repeated, ", "));
        let remedy = "list each image once; the copies weigh more in training and may be in both splits";
        let finding = Finding::new(Severity::Warning, "repeated-image", message, remedy);
        findings.push(finding.number("images", repeated.len() as f64).files(repeated.iter().map(PathBuf::from)));
    }
}

fn lenses(listing: &Listing, findings: &mut Vec<Finding>) {
    let n_distorted = listing.sound().filter(|(_, shot)| !shot.lens.is_pinhole()).count();
    if n_distorted > 0 {
        let shift_px = listing.sound().map(|(_, shot)| shot.lens.largest_shift_px()).fold(0.0, f64::max);
        let message = format!(
            "images with lens distortion: {n_distorted}; it moves pixels by up to {shift_px:.1} px and is undone on loading"
        );
        let finding = Finding::new(Severity::Note, "distortion", message, "");
        findings.push(finding.number("views", n_distorted as f64).number("largest_shift_px", shift_px));
    }
    let unequal = |focal_px: [f64; 2]| focal_px[0].max(focal_px[1]) > MAX_FOCAL_RATIO * focal_px[0].min(focal_px[1]);
    let stretched: Vec<_> = listing.sound().filter(|(_, shot)| unequal(shot.lens.focal_px)).collect();
    findings.extend(Finding::about(
        &stretched,
        Severity::Warning,
        "focal-lengths",
        &format!(
            "images whose focal lengths along x and y differ by more than {:.0} %",
            100.0 * (MAX_FOCAL_RATIO - 1.0)
        ),
        "pixels of photographs are square: if the images were stretched, nothing is wrong; else check the focal lengths (fl_x and fl_y), and \
         if they were found together with the poses, find both anew",
    ));
    let outside: Vec<_> = listing
        .sound()
        .filter(|(_, shot)| {
            let ([x, y], (width_px, height_px)) = (shot.lens.principal_px, shot.lens.size_px);
            let is_inside = (0.0..=f64::from(width_px)).contains(&x) && (0.0..=f64::from(height_px)).contains(&y);
            let is_at_corner = x.max(y) <= 1.0 && width_px.max(height_px) > 4;
            !is_inside || is_at_corner
        })
        .collect();
    findings.extend(Finding::about(
        &outside,
        Severity::Warning,
        "principal-point",
        "images whose principal point lies outside them or in their corner",
        "check cx and cy: they are pixels from the image's corner, for the size that the intrinsics give, and no shares of it",
    ));
    let absurd: Vec<_> = listing.sound().filter(|(_, shot)| !shot.lens.has_usual_field_of_view()).collect();
    findings.extend(Finding::about(
        &absurd,
        Severity::Warning,
        "field-of-view",
        &format!(
            "images whose focal length is not {} to {} times their longer side",
            USUAL_FOCAL_LENGTHS[0], USUAL_FOCAL_LENGTHS[1]
        ),
        "check fl_x and fl_y, or camera_angle_x: a focal length is in pixels, for the size that the intrinsics give, and an angle in radians",
    ));
}

/// Tells of the photographs with an alpha channel, or of those without where most have one.
fn alpha(listing: &Listing, findings: &mut Vec<Finding>) {
    let (with, without): (Vec<_>, Vec<_>) = listing.sound().partition(|(_, shot)| shot.header.has_alpha);
    let finding = if with.len() > without.len() && !without.is_empty() {
        Finding::about(
            &without,
            Severity::Note,
            "no-alpha",
            "images without an alpha channel, whose background is trained as part of the scene",
            "export RGBA to have the chosen background there",
        )
    } else {
        Finding::about(
            &with,
            Severity::Note,
            "alpha",
            "photographs with an alpha channel, which are composited on the chosen background: what is transparent is \
             trained as empty",
            "to leave transparent pixels out of training instead, give them as masks",
        )
    };
    findings.extend(finding);
}

fn depth_maps(listing: &Listing, findings: &mut Vec<Finding>) {
    let like: Vec<_> = listing.sound().filter(|(_, shot)| shot.header.is_depth_like).collect();
    findings.extend(Finding::about(
        &like,
        Severity::Warning,
        "depth-map",
        "images of one channel of 16 bit, as depth maps are",
        "put the photographs in their place, if they are depth maps",
    ));
}

fn orientation(listing: &Listing, findings: &mut Vec<Finding>) {
    let turned: Vec<_> = listing.sound().filter(|(_, shot)| shot.header.exif_orientation != 1).collect();
    findings.extend(Finding::about(
        &turned,
        Severity::Warning,
        "exif-orientation",
        "images with an EXIF orientation, which is not applied: pixels are taken as they are stored",
        "if the poses were made from upright images, store the pixels upright and remove the tag",
    ));
}

fn colours(listing: &Listing, findings: &mut Vec<Finding>) {
    let other: Vec<_> = listing.sound().filter(|(_, shot)| shot.header.has_other_primaries).collect();
    findings.extend(Finding::about(
        &other,
        Severity::Warning,
        "colour-profile",
        "images with a colour profile other than sRGB, as Display P3; their values are taken for sRGB, so the scene is drawn paler than they are",
        "convert them to sRGB, as `jpgicc -q95 IN.jpg OUT.jpg` of Little CMS does (package liblcms2-utils); their sizes must stay",
    ));
}

/// Where the capture has a split of its own, `--test-every` says nothing.
fn own_split(listing: &Listing, test_every: u32, findings: &mut Vec<Finding>) {
    if test_every != LoadOptions::default().test_every && !listing.is_split_by(test_every) {
        let message = format!("the capture has a split of its own, so `--test-every {test_every}` holds out nothing");
        let remedy = "leave it out, or take the split out of the capture";
        findings.push(Finding::new(Severity::Warning, "own-split", message, remedy));
    }
}

fn sizes(listing: &Listing, findings: &mut Vec<Finding>) {
    let Some(common_px) = commonest(listing.sound().map(|(_, shot)| shot.header.size_px)) else { return };
    let other: Vec<_> = listing.sound().filter(|(_, shot)| shot.header.size_px != common_px).collect();
    let what = format!("images of another size than the {}×{} px of most", common_px.0, common_px.1);
    findings.extend(Finding::about(&other, Severity::Note, "mixed-sizes", &what, ""));
}
