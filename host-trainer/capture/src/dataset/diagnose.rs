//! What may go wrong with a capture, told before time is spent on it.

use std::fmt;
use std::path::{Path, PathBuf};

use glam::DVec3;
use pocketsplat_files::shown;
use serde::{Serialize, Serializer};

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
pub use pixels::MaskedView;
pub(super) use pixels::doubts as doubts_of_pixels;
pub use views::MAX_FOCAL_RATIO;

/// What was found out about a capture; displays as lines to print, serialises for programs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Diagnosis {
    /// The folder.
    #[serde(serialize_with = "as_shown")]
    pub path: PathBuf,
    /// The layout it was read as, where one fits.
    pub layout: Option<Layout>,
    /// Views to train on that can be used.
    pub n_train: usize,
    /// Views held out that can be used.
    pub n_test: usize,
    /// Points the capture brings.
    pub n_points: usize,
    /// Views with masks, and how many pixels these leave out.
    pub masked: Vec<MaskedView>,
    /// What a person should know, the worst first.
    pub findings: Vec<Finding>,
}

/// Checks everything that [`load`](super::load) relies on, and decodes every image.
///
/// Missing, unreadable and unposed images, sizes, lenses, poses, scale, orientation, alpha, splits and points. Never
/// fails: what makes the capture unusable is a finding of severity [`Severity::Error`]. Takes as long as loading; one
/// image per thread is held.
pub fn diagnose(path: &Path, options: &LoadOptions) -> Diagnosis {
    let mut diagnosis = Diagnosis {
        path: path.to_owned(),
        layout: layout_of(path),
        n_train: 0,
        n_test: 0,
        n_points: 0,
        masked: Vec::new(),
        findings: Vec::new(),
    };
    let mut listing = match super::list(path, options) {
        Ok(listing) => listing,
        Err(error) => {
            diagnosis.findings.push(Finding::told(Severity::Error, error.code(), &error.to_string()));
            return diagnosis;
        }
    };
    let mut findings = Vec::new();
    diagnosis.masked = pixels::check(&mut listing, options, &mut findings);
    views::not_used(&listing, &mut findings);
    findings.extend(doubts(&listing, options));
    findings.extend(listing.notes.iter().map(|note| Finding::told(note.severity, note.code, &note.text)));
    // Stable, so that findings of one severity keep the order of the checks.
    findings.sort_by_key(|finding| finding.severity);
    diagnosis.findings = findings;
    diagnosis.n_train = listing.shots(Split::Train).count();
    diagnosis.n_test = listing.shots(Split::Test).count();
    diagnosis.n_points = listing.points.as_ref().map_or(0, |(_, points)| points.len());
    diagnosis
}

/// What a listing shows without its pixels, but for what a [report](super::LoadReport) names by itself: the views left out, the images
/// without a pose and the notes of the reader.
pub(super) fn doubts(listing: &Listing, options: &LoadOptions) -> Vec<Finding> {
    let mut findings = Vec::new();
    views::check(listing, options, &mut findings);
    let centres: Vec<DVec3> = listing.shots(Split::Train).map(|shot| shot.centre_world()).collect();
    poses::check(listing, &centres, &mut findings);
    points::check(listing, &centres, &mut findings);
    findings
}

/// A path in JSON, which holds no bytes that are no UTF-8.
fn as_shown<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&shown(path))
}

/// Paths in JSON, as [`as_shown`].
fn all_as_shown<S: Serializer>(paths: &[PathBuf], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(paths.iter().map(|path| shown(path)))
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
        let path = shown(&self.path);
        match self.layout {
            Some(layout) => writeln!(
                f,
                "{layout} capture `{path}`: {} views to train, {} to test, {} points",
                self.n_train, self.n_test, self.n_points
            )?,
            None => writeln!(f, "`{path}`")?,
        }
        let by_share = |a: &&MaskedView, b: &&MaskedView| a.share().total_cmp(&b.share());
        if let (Some(least), Some(most)) = (self.masked.iter().min_by(by_share), self.masked.iter().max_by(by_share)) {
            let (n_masked, n_all) =
                self.masked.iter().fold((0, 0), |(n, all), view| (n + view.n_masked_px, all + view.n_px));
            writeln!(
                f,
                "masks: {} views; of their pixels {:.1} % do not count (least {:.1} % of {}, most {:.1} % of {})",
                self.masked.len(),
                100.0 * n_masked as f64 / n_all.max(1) as f64,
                100.0 * least.share(),
                least.name,
                100.0 * most.share(),
                most.name
            )?;
        }
        for finding in &self.findings {
            writeln!(f, "{finding}")?;
        }
        let [errors, warnings, notes] = [Severity::Error, Severity::Warning, Severity::Note].map(|s| self.count(s));
        write!(f, "errors: {errors}, warnings: {warnings}, notes: {notes}")
    }
}
