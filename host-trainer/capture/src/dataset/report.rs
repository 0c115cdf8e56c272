//! What loading found: for the person who gave the capture.

use std::fmt;

use super::error::first_few;
use super::{Background, Finding, Layout, PointsOrigin, SceneKind, Split, ViewFault};

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
    pub layout: Layout,
    /// What transparent pixels were composited on.
    pub background: Background,
    /// The colour behind the object in photographs without transparent pixels, 8-bit RGB; the scene begins with it behind.
    pub backdrop: Option<[u8; 3]>,
    /// What the capture was taken for.
    pub scene: SceneKind,
    /// Why, where the user has not said what it shows.
    pub because: Option<String>,
    /// Views to train on.
    pub n_train: usize,
    /// Views held out.
    pub n_test: usize,
    /// Width and height of most training images in the capture, pixels.
    pub source_size_px: (u32, u32),
    /// Width and height these were loaded at, pixels.
    pub size_px: (u32, u32),
    /// How many different sizes the images have.
    pub n_sizes: usize,
    /// Initial points.
    pub n_points: usize,
    /// Where they come from.
    pub points_origin: PointsOrigin,
    /// What it took to make them, where this load did.
    pub points_seconds: Option<f64>,
    /// Views left out, in the capture's order, training views first.
    pub skipped: Vec<SkippedView>,
    /// Images that lie with the others but have no pose, by name; they are not read.
    pub unposed: Vec<String>,
    /// What makes the result worse, or another one than was meant.
    pub warnings: Vec<Finding>,
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
        if self.n_sizes > 1 {
            write!(f, " and {} other sizes", self.n_sizes - 1)?;
        }
        let random = if self.points_origin == PointsOrigin::Random { "random " } else { "" };
        match (self.backdrop, self.backdrop.and_then(Background::of_rgb8)) {
            (Some([r, g, b]), None) => write!(f, ", on {r},{g},{b}")?,
            (_, own) => write!(f, ", on {}", own.unwrap_or(self.background))?,
        }
        // None were asked for where nothing is trained.
        if self.n_points > 0 {
            write!(f, ", {} {random}initial points", self.n_points)?;
        }
        let made = match self.points_origin {
            PointsOrigin::Capture | PointsOrigin::Random => None,
            PointsOrigin::DepthMaps => Some("of its depth maps"),
            PointsOrigin::Matched => Some("matched between the photographs"),
        };
        match (made, self.points_seconds) {
            (Some(how), Some(seconds)) => write!(f, " {how} in {seconds:.1} s")?,
            (Some(how), None) => write!(f, " {how} by an earlier run")?,
            (None, _) => {}
        }
        for split in [Split::Train, Split::Test] {
            let of_split: Vec<&SkippedView> = self.skipped.iter().filter(|view| view.split == split).collect();
            if !of_split.is_empty() {
                write!(f, "\n{split} views left out: {}\n  {}", of_split.len(), first_few(&of_split, "\n  "))?;
            }
        }
        if !self.unposed.is_empty() {
            write!(
                f,
                "\nimages without a pose, not used: {} ({})",
                self.unposed.len(),
                first_few(&self.unposed, ", ")
            )?;
        }
        if let Some(because) = &self.because {
            let (taken, other) = match self.scene {
                SceneKind::Object => ("an object on nothing", SceneKind::Room),
                SceneKind::Room => ("a room", SceneKind::Object),
            };
            write!(f, "\ntaken for {taken}, for {because}; --scene {other} says otherwise")?;
        }
        for warning in &self.warnings {
            write!(f, "\n{}", warning.in_line())?;
        }
        for note in &self.notes {
            write!(f, "\nnote: {note}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::Severity;
    use super::*;

    #[test]
    fn the_first_few_skipped_views_are_named_and_the_rest_counted() {
        let skipped = (0..5)
            .map(|i| SkippedView {
                split: Split::Train,
                name: format!("train/r_{i}"),
                fault: ViewFault::Missing { path: format!("/capture/train/r_{i}").into(), listed_in: "the capture" },
            })
            .collect();
        let report = LoadReport {
            layout: Layout::Blender,
            background: Background::Black,
            backdrop: None,
            scene: SceneKind::Room,
            because: Some("the photographs show something up to their borders".to_owned()),
            n_train: 7,
            n_test: 0,
            source_size_px: (8, 6),
            size_px: (4, 3),
            n_sizes: 2,
            n_points: 10,
            points_origin: PointsOrigin::Random,
            points_seconds: None,
            skipped,
            unposed: ["a.jpg", "b.jpg", "c.jpg", "d.jpg"].map(str::to_owned).to_vec(),
            warnings: vec![Finding::told(Severity::Warning, "x", "few views; take more")],
            notes: vec!["no test views".to_owned()],
        };
        let text = report.to_string();
        assert!(text.starts_with("Blender capture: 7 views to train, 0 to test, 4×3 px (area-averaged from 8×6)"));
        assert!(text.contains(" and 1 other sizes, on black, 10 random initial points\n"), "{text}");
        assert!(text.contains("images without a pose, not used: 4 (a.jpg, b.jpg, c.jpg, … and 1 more)"), "{text}");
        assert!(text.contains("train views left out: 5\n  train/r_0: image missing"), "{text}");
        assert!(text.contains("train/r_2") && !text.contains("train/r_3"), "{text}");
        assert!(text.contains("\ntaken for a room, for the photographs show something up to their borders; --scene object says otherwise\n"));
        assert!(text.contains("\nwarning: few views; take more\n"), "{text}");
        assert!(text.contains("\n  … and 2 more\n") && text.ends_with("\nnote: no test views"), "{text}");
    }
}
