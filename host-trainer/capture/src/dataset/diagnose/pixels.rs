//! Findings that need the pixels.

use std::path::PathBuf;

use rayon::prelude::*;

use super::{Finding, Severity};
use crate::dataset::listing::Listing;
use crate::dataset::report::first_few;
use crate::dataset::{LoadOptions, ViewFault};

/// A view of which less than this share counts hardly constrains anything.
const MIN_COUNTED_SHARE: f64 = 0.1;

/// What a decoded view looks like.
enum Look {
    Sound,
    Flat,
    MostlyMasked,
}

/// Decodes every image; views that fail become faults of the listing.
pub(super) fn check(listing: &mut Listing, options: &LoadOptions, findings: &mut Vec<Finding>) {
    let looks: Vec<Option<Result<Look, ViewFault>>> = listing
        .views
        .par_iter()
        .map(|listed| {
            let shot = listed.shot.as_ref().ok()?;
            Some(shot.read(&listed.name, options).map(|view| {
                let first = &view.image.rgb[..3];
                let counted_share = view.mask.map_or(1.0, |mask| mask.n_valid() as f64 / mask.valid.len() as f64);
                if view.image.rgb.chunks_exact(3).all(|pixel| pixel == first) {
                    Look::Flat
                } else if counted_share < MIN_COUNTED_SHARE {
                    Look::MostlyMasked
                } else {
                    Look::Sound
                }
            }))
        })
        .collect();
    let (mut flat, mut masked) = (Vec::new(), Vec::new());
    for (listed, look) in listing.views.iter_mut().zip(looks) {
        let Ok(shot) = &listed.shot else { continue };
        match look {
            Some(Ok(Look::Flat)) => flat.push((listed.name.clone(), shot.path.clone())),
            Some(Ok(Look::MostlyMasked)) => masked.push((listed.name.clone(), shot.path.clone())),
            Some(Err(fault)) => listed.shot = Err(fault),
            Some(Ok(Look::Sound)) | None => {}
        }
    }
    let mut push = |code, views: Vec<(String, PathBuf)>, what: &str, remedy: &str| {
        if views.is_empty() {
            return;
        }
        let (names, files): (Vec<String>, Vec<PathBuf>) = views.into_iter().unzip();
        let n = names.len();
        let message = format!("{what}: {n} ({})", first_few(&names));
        findings.push(Finding::new(Severity::Warning, code, message, remedy).files(files).number("views", n as f64));
    };
    push(
        "flat-image",
        flat,
        "images of a single colour",
        "check that they were exported whole and are not wholly transparent, or take them out",
    );
    push(
        "mostly-masked",
        masked,
        &format!("images of which less than {} % counts", 100.0 * MIN_COUNTED_SHARE),
        "check the distortion coefficients and the masks",
    );
}
