//! Published results to stand beside ours.

use std::path::Path;

use anyhow::{Context, Result, bail};
use serde::Deserialize;

use crate::plot::{Named, ResultRow};

/// One published result, of a scene or the mean of a dataset.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub(super) struct PublishedRow {
    #[serde(rename = "Dataset")]
    pub(super) dataset: String,
    /// Empty for the mean.
    #[serde(rename = "Scene")]
    pub(super) scene: String,
    #[serde(rename = "Method")]
    pub(super) method: String,
    #[serde(rename = "Submethod")]
    pub(super) submethod: String,
    #[serde(rename = "PSNR")]
    pub(super) psnr_db: f64,
    #[serde(rename = "SSIM")]
    pub(super) ssim: Option<f64>,
    #[serde(rename = "LPIPS")]
    pub(super) lpips: Option<f64>,
    #[serde(rename = "Size [Bytes]")]
    pub(super) size_bytes: Option<f64>,
    #[serde(rename = "#Gaussians")]
    n_gaussians: Option<f64>,
    /// Where it stands.
    #[serde(rename = "Source")]
    source: String,
}

impl PublishedRow {
    /// Reads a table of them.
    pub(super) fn read_all(path: &Path) -> Result<Vec<Self>> {
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(path);
        let reader = reader.as_mut().map_err(|error| anyhow::anyhow!("{error}"));
        let rows = reader.and_then(|reader| Ok(reader.deserialize().collect::<Result<Vec<Self>, _>>()?));
        let rows = rows.with_context(|| format!("could not read the published results {}", path.display()))?;
        match rows.iter().find(|row| row.source.is_empty()) {
            Some(row) => {
                bail!("{}: {} on {} has no Source; say where it is published", path.display(), row.method, row.dataset)
            }
            None => Ok(rows),
        }
    }

    /// As it is called where one name has to do.
    pub(super) fn name(&self) -> String {
        if self.submethod.is_empty() { self.method.clone() } else { format!("{} {}", self.method, self.submethod) }
    }

    fn result(&self) -> Option<ResultRow> {
        Some(ResultRow {
            submethod: self.submethod.clone(),
            psnr_db: self.psnr_db,
            ssim: self.ssim,
            lpips: self.lpips,
            size_bytes: self.size_bytes?,
            n_gaussians: self.n_gaussians,
        })
    }
}

/// Methods whose backbones can be trained here: their curves are always shown.
const BACKBONES: [&str; 4] = ["Scaffold-GS", "HAC", "HAC++", "ContextGS"];

/// Published curves of a scene, or with an empty name of a dataset's mean: those of the backbones, and whatever no other result beats.
pub(super) fn curves(rows: &[PublishedRow], dataset: &str, scene: &str) -> Vec<Named<Vec<ResultRow>>> {
    let here: Vec<&PublishedRow> = rows.iter().filter(|row| row.dataset == dataset && row.scene == scene).collect();
    let is_beaten = |row: &PublishedRow| {
        here.iter().any(|other| match (other.size_bytes, row.size_bytes) {
            (Some(theirs), Some(own)) => theirs < own && other.psnr_db > row.psnr_db,
            _ => true,
        })
    };
    let mut curves: Vec<Named<Vec<ResultRow>>> = Vec::new();
    for row in here.iter().filter(|row| BACKBONES.contains(&row.method.as_str()) || !is_beaten(row)) {
        let Some(point) = row.result() else { continue };
        let name = format!("{} (published)", row.method);
        match curves.iter_mut().find(|curve| curve.name == name) {
            Some(curve) => curve.what.push(point),
            None => curves.push(Named { name, what: vec![point] }),
        }
    }
    curves
}
