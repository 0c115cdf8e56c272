//! The CSV of a group: a row for each planned run, with its figures once it is measured.

use std::path::PathBuf;

use anyhow::{Context as _, Result};
use serde::{Deserialize, Serialize, Serializer};

use super::in_repository;

/// A run; figures are missing where it is planned alone.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Row {
    /// Whose CSV it stands in.
    #[serde(skip)]
    pub(super) group: String,
    pub(super) run: String,
    pub(super) dataset: String,
    pub(super) scene: String,
    pub(super) size: String,
    pub(super) method: String,
    pub(super) rate: String,
    pub(super) seed: u64,
    pub(super) psnr_db: Option<f64>,
    pub(super) ssim: Option<f64>,
    pub(super) lpips: Option<f64>,
    #[serde(serialize_with = "whole")]
    pub(super) bytes: Option<f64>,
    #[serde(serialize_with = "whole")]
    pub(super) n_anchors: Option<f64>,
    #[serde(serialize_with = "whole")]
    pub(super) n_views: Option<f64>,
    #[serde(serialize_with = "whole")]
    pub(super) width_px: Option<f64>,
    #[serde(serialize_with = "whole")]
    pub(super) height_px: Option<f64>,
    /// Of one processor core, for training.
    pub(super) processor_minutes: Option<f64>,
    /// Most that training held.
    #[serde(serialize_with = "whole")]
    pub(super) memory_bytes: Option<f64>,
    /// Of the page that `view` writes.
    #[serde(serialize_with = "whole")]
    pub(super) page_bytes: Option<f64>,
    /// Of the slowest of four frames, counted on the group's emulated board.
    #[serde(serialize_with = "whole")]
    pub(super) instructions: Option<f64>,
    pub(super) program: String,
}

impl Row {
    pub(super) fn is_measured(&self) -> bool {
        self.psnr_db.is_some()
    }
}

/// A count, without a fraction.
#[expect(clippy::ref_option, reason = "as serde calls it")]
fn whole<S: Serializer>(count: &Option<f64>, to: S) -> Result<S::Ok, S::Error> {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
    let whole = count.map(|count| count.round() as u64);
    whole.serialize(to)
}

fn path(group: &str) -> PathBuf {
    in_repository(format!("docs/results/figures/{group}.csv"))
}

/// The rows of a group; none where it has no CSV yet.
pub(super) fn read(group: &str) -> Result<Vec<Row>> {
    let path = path(group);
    if !path.exists() {
        return Ok(Vec::new());
    }
    let rows = csv::Reader::from_path(&path)?.into_deserialize().collect::<Result<Vec<Row>, _>>();
    rows.with_context(|| format!("{} has no figures of runs", path.display()))
}

pub(super) fn write(group: &str, rows: &[Row]) -> Result<()> {
    let path = path(group);
    std::fs::create_dir_all(in_repository("docs/results/figures"))?;
    let mut table = csv::Writer::from_path(&path).with_context(|| format!("could not write {}", path.display()))?;
    rows.iter().try_for_each(|row| table.serialize(row))?;
    Ok(table.flush()?)
}
