//! What loading found: for the person who gave the capture.

use std::fmt;

use super::error::FAULTS_SPELT_OUT;
use super::{Background, ViewFault};

/// The part of a capture a view belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Split {
    /// Views to train on.
    Train,
    /// Views held out.
    Test,
}

impl fmt::Display for Split {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Train => "train",
            Self::Test => "test",
        })
    }
}

/// A view that was left out.
#[derive(Debug)]
pub struct SkippedView {
    /// Where the capture lists it.
    pub split: Split,
    /// Its name there.
    pub name: String,
    /// Why it cannot be used, with the remedy.
    pub fault: ViewFault,
}

impl fmt::Display for SkippedView {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.name, self.fault)
    }
}

/// What was loaded, what was left out and why; displays as lines to print.
#[derive(Debug)]
pub struct LoadReport {
    /// The layout the capture was read as.
    pub layout: &'static str,
    /// What transparent pixels were composited on.
    pub background: Background,
    /// Views to train on.
    pub n_train: usize,
    /// Views held out.
    pub n_test: usize,
    /// Width and height of the images in the capture, pixels.
    pub source_size_px: (u32, u32),
    /// Width and height they were loaded at, pixels.
    pub size_px: (u32, u32),
    /// Initial points.
    pub n_points: usize,
    /// Views left out, in the capture's order, training views first.
    pub skipped: Vec<SkippedView>,
    /// Everything else worth knowing, each with its remedy where there is one.
    pub notes: Vec<String>,
}

impl fmt::Display for LoadReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (width_px, height_px) = self.size_px;
        write!(
            f,
            "{} capture: {} views to train, {} to test, {width_px}×{height_px} px",
            self.layout, self.n_train, self.n_test
        )?;
        if self.size_px != self.source_size_px {
            write!(f, " (area-averaged from {}×{})", self.source_size_px.0, self.source_size_px.1)?;
        }
        write!(f, ", on {}, {} initial points", self.background, self.n_points)?;
        for split in [Split::Train, Split::Test] {
            let of_split = || self.skipped.iter().filter(move |view| view.split == split);
            let n_skipped = of_split().count();
            if n_skipped > 0 {
                write!(f, "\n{split} views left out: {n_skipped}")?;
                for view in of_split().take(FAULTS_SPELT_OUT) {
                    write!(f, "\n  {view}")?;
                }
                if n_skipped > FAULTS_SPELT_OUT {
                    write!(f, "\n  … and {} more", n_skipped - FAULTS_SPELT_OUT)?;
                }
            }
        }
        for note in &self.notes {
            write!(f, "\nnote: {note}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_few_skipped_views_are_named_and_the_rest_counted() {
        let skipped = (0..5)
            .map(|i| SkippedView {
                split: Split::Train,
                name: format!("train/r_{i}"),
                fault: ViewFault::Missing { path: format!("/capture/train/r_{i}").into() },
            })
            .collect();
        let report = LoadReport {
            layout: "Blender",
            background: Background::Black,
            n_train: 7,
            n_test: 0,
            source_size_px: (8, 6),
            size_px: (4, 3),
            n_points: 10,
            skipped,
            notes: vec!["no test views".to_owned()],
        };
        let text = report.to_string();
        assert!(text.starts_with("Blender capture: 7 views to train, 0 to test, 4×3 px (area-averaged from 8×6)"));
        assert!(text.contains("train views left out: 5\n  train/r_0: image missing"), "{text}");
        assert!(text.contains("train/r_2") && !text.contains("train/r_3"), "{text}");
        assert!(text.ends_with("… and 2 more\nnote: no test views"), "{text}");
    }
}
