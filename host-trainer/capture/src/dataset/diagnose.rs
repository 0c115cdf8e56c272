//! What may go wrong with a capture, told before time is spent on it.

use std::fmt;
use std::path::{Path, PathBuf};

use glam::DVec3;
use serde::Serialize;

use super::detect::layout_of;
use super::listing::Listing;
use super::{Layout, LoadOptions, Severity, Split};

mod finding;
mod pixels;
mod points;
mod poses;
mod readings;
mod views;

pub use finding::Finding;
pub(super) use pixels::{Look, doubts as doubts_of_pixels};

/// What was found out about a capture; displays as lines to print, serialises for programs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Diagnosis {
    /// The folder.
    pub path: PathBuf,
    /// The layout it was read as, where one fits.
    pub layout: Option<Layout>,
    /// Views to train on that can be used.
    pub n_train: usize,
    /// Views held out that can be used.
    pub n_test: usize,
    /// Points the capture brings.
    pub n_points: usize,
    /// Whether the pixels of all images were decoded, too.
    pub decoded: bool,
    /// What a person should know, the worst first.
    pub findings: Vec<Finding>,
}

/// Checks everything that [`load`](super::load) relies on, and decodes every image.
///
/// Missing, unreadable and unposed images, sizes, lenses, poses, scale, orientation, alpha, splits and points. Never
/// fails: what makes the capture unusable is a finding of severity [`Severity::Error`]. Takes as long as loading; one
/// image per thread is held.
pub fn diagnose(path: &Path, options: &LoadOptions) -> Diagnosis {
    check(path, options, true)
}

/// [`diagnose`] without decoding images: headers, poses, lenses and points; takes milliseconds per hundred views.
pub fn diagnose_cheaply(path: &Path, options: &LoadOptions) -> Diagnosis {
    check(path, options, false)
}

fn check(path: &Path, options: &LoadOptions, decode: bool) -> Diagnosis {
    let mut diagnosis = Diagnosis {
        path: path.to_owned(),
        layout: layout_of(path),
        n_train: 0,
        n_test: 0,
        n_points: 0,
        decoded: decode,
        findings: Vec::new(),
    };
    let mut listing = match super::list(path, options) {
        Ok(listing) => listing,
        Err(error) => {
            diagnosis.findings.push(Finding::told(Severity::Error, error.code(), &error.to_string()));
            return diagnosis;
        }
    };
    let findings = &mut diagnosis.findings;
    if decode {
        pixels::check(&mut listing, options, findings);
    }
    views::not_used(&listing, findings);
    findings.extend(doubts(&listing));
    findings.extend(listing.notes.iter().map(|note| Finding::told(note.severity, note.code, &note.text)));
    // Stable, so that findings of one severity keep the order of the checks.
    findings.sort_by_key(|finding| finding.severity);
    let n_points = |listing: &Listing| listing.points.as_ref().map_or(0, |(_, points)| points.len());
    diagnosis.n_train = listing.shots(Split::Train).count();
    diagnosis.n_test = listing.shots(Split::Test).count();
    diagnosis.n_points = n_points(&listing);
    diagnosis
}

/// What a listing shows without its pixels, but for what a [report](super::LoadReport) names by itself: the views left out, the images
/// without a pose and the notes of the reader.
pub(super) fn doubts(listing: &Listing) -> Vec<Finding> {
    let mut findings = Vec::new();
    views::check(listing, &mut findings);
    let centres: Vec<DVec3> = listing.shots(Split::Train).map(|shot| shot.centre_world()).collect();
    poses::check(listing, &centres, &mut findings);
    points::check(listing, &centres, &mut findings);
    findings
}

impl Diagnosis {
    /// How many findings have this severity.
    pub fn count(&self, severity: Severity) -> usize {
        self.findings.iter().filter(|finding| finding.severity == severity).count()
    }

    /// Whether the capture cannot be trained on.
    pub fn has_errors(&self) -> bool {
        self.count(Severity::Error) > 0
    }
}

impl fmt::Display for Diagnosis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let path = self.path.display();
        match self.layout {
            Some(layout) => writeln!(
                f,
                "{layout} capture `{path}`: {} views to train, {} to test, {} points",
                self.n_train, self.n_test, self.n_points
            )?,
            None => writeln!(f, "`{path}`")?,
        }
        for finding in &self.findings {
            writeln!(f, "{finding}")?;
        }
        let [errors, warnings, notes] = [Severity::Error, Severity::Warning, Severity::Note].map(|s| self.count(s));
        write!(f, "errors: {errors}, warnings: {warnings}, notes: {notes}")?;
        if !self.decoded {
            write!(f, " (pixels not decoded)")?;
        }
        Ok(())
    }
}
