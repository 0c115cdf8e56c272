//! What was found: which photographs have poses, and which have none.

use std::fmt;
use std::path::{Path, PathBuf};

use pocketsplat_capture::dataset::Diagnosis;
use serde::Serialize;

use super::model::Model;
use super::taking::Taken;

/// Below this share of the photographs a capture has gaps.
pub(super) const USEFUL_SHARE: f64 = 0.6;
/// Names that are spelt out.
const N_NAMED: usize = 10;

/// What was found.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    pub(super) capture: PathBuf,
    pub(super) photographs: usize,
    /// How many of them have a pose, in the largest model.
    pub(super) with_pose: usize,
    pub(super) without_pose: Vec<String>,
    pub(super) points: usize,
    /// Mean over the points.
    pub(super) reprojection_error_px: Option<f64>,
    /// Photographs in each model, the largest first.
    pub(super) models: Vec<usize>,
    /// What `doctor` says of the capture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) diagnosis: Option<Diagnosis>,
}

impl Report {
    /// * `models`: the largest first, at least one.
    pub(super) fn new(capture: &Path, photographs: &[Taken], models: &[Model]) -> Self {
        let kept = models.first();
        let has_pose = |name: &String| kept.is_some_and(|model| model.names.binary_search(name).is_ok());
        let names = photographs.iter().map(|taken| &taken.name);
        Self {
            capture: capture.to_owned(),
            photographs: photographs.len(),
            with_pose: kept.map_or(0, |model| model.names.len()),
            without_pose: names.filter(|name| !has_pose(name)).cloned().collect(),
            points: kept.map_or(0, |model| model.n_points),
            reprojection_error_px: kept.and_then(|model| model.error_px),
            models: models.iter().map(|model| model.names.len()).collect(),
            diagnosis: None,
        }
    }

    /// What to do where too few photographs have poses.
    pub(super) fn warning(&self) -> Option<String> {
        let share = self.with_pose as f64 / self.photographs.max(1) as f64;
        (share < USEFUL_SHARE).then(|| {
            format!(
                "warning: {:.0} % of the photographs have poses, so parts of the scene are not seen; take more photographs between \
                 those that have none, with more overlap and of things with texture, and look for poses of all of them anew",
                100.0 * share
            )
        })
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { photographs, with_pose, points, .. } = self;
        write!(f, "{with_pose} of {photographs} photographs have poses; {points} points")?;
        if let Some(error_px) = self.reprojection_error_px {
            write!(f, ", each {error_px:.2} px off on average")?;
        }
        writeln!(f)?;
        if !self.without_pose.is_empty() {
            let more = self.without_pose.len().saturating_sub(N_NAMED);
            let names = self.without_pose[..self.without_pose.len() - more].join(", ");
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            writeln!(f, "without a pose: {names}{more}")?;
        }
        if self.models.len() > 1 {
            let each = self.models.iter().enumerate().map(|(i, n)| format!("{n} in sparse/{i}"));
            writeln!(
                f,
                "photographs that do not join, in models of their own: {}",
                each.collect::<Vec<_>>().join(", ")
            )?;
        }
        if let Some(diagnosis) = &self.diagnosis {
            writeln!(f, "\n{diagnosis}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(n: usize, n_posed: usize) -> Report {
        let names: Vec<String> = (0..n).map(|i| format!("{i:02}.jpg")).collect();
        Report {
            capture: PathBuf::from("cup"),
            photographs: n,
            with_pose: n_posed,
            without_pose: names[n_posed..].to_vec(),
            points: 900,
            reprojection_error_px: Some(0.692),
            models: vec![n_posed],
            diagnosis: None,
        }
    }

    #[test]
    fn photographs_without_poses_are_named_and_counted() {
        assert_eq!(
            report(3, 3).to_string(),
            "3 of 3 photographs have poses; 900 points, each 0.69 px off on average\n"
        );
        let said = report(30, 18).to_string();
        assert!(
            said.contains("\nwithout a pose: 18.jpg, 19.jpg, ") && said.ends_with(", 27.jpg and 2 more\n"),
            "{said}"
        );
        let several = Report { models: vec![18, 5], ..report(30, 18) }.to_string();
        assert!(several.ends_with("models of their own: 18 in sparse/0, 5 in sparse/1\n"), "{several}");
    }

    #[test]
    fn few_poses_are_warned_of() {
        assert_eq!(report(10, 6).warning(), None);
        let said = report(10, 5).warning().unwrap();
        assert!(
            said.starts_with("warning: 50 % of the photographs have poses") && said.contains("more overlap"),
            "{said}"
        );
    }
}
