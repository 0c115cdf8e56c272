//! Findings that need the pixels.

use std::path::PathBuf;

use rayon::prelude::*;
use serde::Serialize;

use super::Finding;
use crate::dataset::listing::{ListedView, Listing, Shot};
use crate::dataset::looks::{Look, Looks, MIN_COUNTED_SHARE};
use crate::dataset::{LoadOptions, Severity};

/// A view of which masks leave out some pixels.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MaskedView {
    /// As the capture names it.
    pub name: String,
    /// The files of its masks.
    #[serde(serialize_with = "super::all_as_shown")]
    pub masks: Vec<PathBuf>,
    /// Pixels that they leave out.
    pub n_masked_px: u64,
    /// All pixels of the photograph.
    pub n_px: u64,
}

impl MaskedView {
    /// Share of the pixels that are left out.
    pub(super) fn share(&self) -> f64 {
        self.n_masked_px as f64 / self.n_px.max(1) as f64
    }
}

/// A single mask may have nothing to hide; so many that hide nothing are no masks.
const MIN_EMPTY_MASKS: usize = 3;

/// Decodes every image; views that fail become faults of the listing. Returns the views with masks.
pub(super) fn check(listing: &mut Listing, options: &LoadOptions, findings: &mut Vec<Finding>) -> Vec<MaskedView> {
    let decode = |listed: &mut ListedView| {
        let shot = listed.shot.as_ref().ok()?;
        match shot.read(options) {
            Ok(photo) => {
                let n_px = u64::from(shot.header.size_px.0) * u64::from(shot.header.size_px.1);
                let masked = photo.n_masked_px.map(|n_masked_px| MaskedView {
                    name: listed.name.clone(),
                    masks: shot.masks.iter().map(|mask| mask.path.clone()).collect(),
                    n_masked_px,
                    n_px,
                });
                Some((photo.looks, masked))
            }
            Err(fault) => {
                listed.shot = Err(fault);
                None
            }
        }
    };
    // Of the sound views, in their order.
    let decoded: Vec<(Looks, Option<MaskedView>)> = listing.views.par_iter_mut().filter_map(decode).collect();
    let (looks, masked): (Vec<Looks>, Vec<Option<MaskedView>>) = decoded.into_iter().unzip();
    findings.extend(doubts(&listing.sound().zip(looks).collect::<Vec<_>>()));
    masked.into_iter().flatten().collect()
}

/// What the pixels of views make doubtful.
pub(in crate::dataset) fn doubts(views: &[((&str, &Shot), Looks)]) -> Vec<Finding> {
    let mut findings = Vec::new();
    let views_of = |look: Look| -> Vec<(&str, &Shot)> {
        views.iter().filter(|(_, looks)| looks.look == look).map(|(view, _)| *view).collect()
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
    let masked: Vec<_> = views.iter().filter(|((_, shot), _)| !shot.masks.is_empty()).collect();
    if masked.len() >= MIN_EMPTY_MASKS && masked.iter().all(|(_, looks)| !looks.leaves_out) {
        let message = format!("none of the masks of {} images leaves out a pixel", masked.len());
        let remedy = "make what does not count black or transparent in them, or take them out";
        let files = masked.iter().flat_map(|((_, shot), _)| shot.masks.iter().map(|mask| mask.path.clone()));
        findings.push(Finding::new(Severity::Warning, "empty-masks", message, remedy).files(files));
    }
    findings
}
