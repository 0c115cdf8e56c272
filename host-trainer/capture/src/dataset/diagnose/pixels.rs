//! Findings that need the pixels.

use rayon::prelude::*;

use super::Finding;
use crate::dataset::listing::{ListedView, Listing, Shot};
use crate::dataset::{LoadOptions, Photograph, Severity};

/// A view of which less than this share counts hardly constrains anything.
const MIN_COUNTED_SHARE: f64 = 0.1;

/// What a decoded view looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::dataset) enum Look {
    Sound,
    Flat,
    MostlyMasked,
}

impl Look {
    pub(in crate::dataset) fn of(photograph: &Photograph) -> Self {
        let first = &photograph.image.rgb[..3];
        let mask = photograph.mask.as_ref();
        let counted_share = mask.map_or(1.0, |mask| mask.n_valid() as f64 / mask.valid.len() as f64);
        if photograph.image.rgb.chunks_exact(3).all(|pixel| pixel == first) {
            Self::Flat
        } else if counted_share < MIN_COUNTED_SHARE {
            Self::MostlyMasked
        } else {
            Self::Sound
        }
    }
}

/// Decodes every image; views that fail become faults of the listing.
pub(super) fn check(listing: &mut Listing, options: &LoadOptions, findings: &mut Vec<Finding>) {
    let decode = |listed: &mut ListedView| match listed.shot.as_ref().ok()?.read(options) {
        Ok(photo) => Some(Look::of(&photo.photograph)),
        Err(fault) => {
            listed.shot = Err(fault);
            None
        }
    };
    // Of the sound views, in their order.
    let looks: Vec<Look> = listing.views.par_iter_mut().filter_map(decode).collect();
    findings.extend(doubts(&listing.sound().zip(looks).collect::<Vec<_>>()));
}

/// What decoded views look like.
pub(in crate::dataset) fn doubts(views: &[((&str, &Shot), Look)]) -> Vec<Finding> {
    let mut findings = Vec::new();
    let views_of = |look: Look| -> Vec<(&str, &Shot)> {
        views.iter().filter(|(_, found)| *found == look).map(|(view, _)| *view).collect()
    };
    findings.extend(Finding::about(
        &views_of(Look::Flat),
        Severity::Warning,
        "flat-image",
        "images of a single colour",
        "check that they were exported whole and are not wholly transparent, or take them out",
    ));
    findings.extend(Finding::about(
        &views_of(Look::MostlyMasked),
        Severity::Warning,
        "mostly-masked",
        &format!("images of which less than {} % counts", 100.0 * MIN_COUNTED_SHARE),
        "check the distortion coefficients and the masks",
    ));
    findings
}
