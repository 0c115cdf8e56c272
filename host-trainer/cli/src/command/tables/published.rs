//! Published results to stand beside ours.

use std::path::Path;

use anyhow::{Context, Result, bail};
use serde::Deserialize;

use crate::plot::{Named, ResultRow, gathered, refuse_infinite, refused};

/// The column of sizes.
const SIZE: &str = "Size [Bytes]";
/// Columns that have to be finite where they are given.
const NUMBERS: [&str; 5] = ["PSNR", "SSIM", "LPIPS", SIZE, "#Gaussians"];

/// One published result, of a scene or the mean of a dataset.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub(in crate::command) struct PublishedRow {
    #[serde(rename = "Dataset")]
    pub(in crate::command) dataset: String,
    /// Empty for the mean.
    #[serde(rename = "Scene")]
    pub(in crate::command) scene: String,
    #[serde(rename = "Method")]
    pub(in crate::command) method: String,
    #[serde(rename = "Submethod")]
    pub(in crate::command) submethod: String,
    #[serde(rename = "PSNR")]
    pub(in crate::command) psnr_db: f64,
    #[serde(rename = "SSIM")]
    pub(in crate::command) ssim: Option<f64>,
    #[serde(rename = "LPIPS")]
    pub(in crate::command) lpips: Option<f64>,
    #[serde(rename = "Size [Bytes]")]
    pub(in crate::command) size_bytes: Option<f64>,
    #[serde(rename = "#Gaussians")]
    pub(in crate::command) n_gaussians: Option<f64>,
    /// Where it stands.
    #[serde(rename = "Source")]
    source: String,
}

impl PublishedRow {
    /// Reads a table of them.
    pub(in crate::command) fn read_all(path: &Path) -> Result<Vec<Self>> {
        let rows = Self::read_rows(path);
        let rows = rows.with_context(|| format!("could not read the published results {}", path.display()))?;
        match rows.iter().find(|row| row.source.is_empty()) {
            Some(row) => {
                bail!("{}: {} on {} has no Source; say where it is published", path.display(), row.method, row.dataset)
            }
            None => Ok(rows),
        }
    }

    fn read_rows(path: &Path) -> Result<Vec<Self>> {
        let reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(path);
        // Without its cause, which the text has already.
        let mut reader = reader.map_err(|error| anyhow::anyhow!("{error}"))?;
        let header = reader.headers()?.clone();
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record?;
            refuse_infinite(&header, &record, &NUMBERS)?;
            let row: Self = record.deserialize(Some(&header))?;
            if let Some(size) = row.size_bytes.filter(|size| *size <= 0.0) {
                return Err(refused(&record, SIZE, &size.to_string(), "more than 0 bytes"));
            }
            rows.push(row);
        }
        Ok(rows)
    }

    /// As it is called where one name has to do.
    pub(in crate::command) fn name(&self) -> String {
        if self.submethod.is_empty() { self.method.clone() } else { format!("{} {}", self.method, self.submethod) }
    }

    pub(in crate::command) fn result(&self) -> Option<ResultRow> {
        Some(ResultRow {
            submethod: self.submethod.clone(),
            psnr_db: self.psnr_db,
            ssim: self.ssim,
            lpips: self.lpips,
            size_bytes: self.size_bytes?,
            n_gaussians: self.n_gaussians,
            program: None,
        })
    }
}

/// The scenes of a dataset that are published one by one, each once.
pub(in crate::command) fn scenes_of<'a>(rows: &'a [PublishedRow], dataset: &str) -> Vec<&'a str> {
    let rows = rows.iter().filter(|row| row.dataset == dataset && !row.scene.is_empty());
    let mut scenes: Vec<&str> = rows.map(|row| row.scene.as_str()).collect();
    scenes.sort_unstable();
    scenes.dedup();
    scenes
}

/// Methods whose backbones can be trained here: their curves are always shown.
const BACKBONES: [&str; 4] = ["Scaffold-GS", "HAC", "HAC++", "ContextGS"];

/// Published curves of a scene, or with an empty name of a dataset's mean: those of the backbones, and whatever no other result beats.
pub(in crate::command) fn curves(rows: &[PublishedRow], dataset: &str, scene: &str) -> Vec<Named<Vec<ResultRow>>> {
    let here: Vec<&PublishedRow> = rows.iter().filter(|row| row.dataset == dataset && row.scene == scene).collect();
    let is_beaten = |row: &PublishedRow| {
        here.iter().any(|other| match (other.size_bytes, row.size_bytes) {
            (Some(theirs), Some(own)) => theirs < own && other.psnr_db > row.psnr_db,
            (None, Some(_)) => false,
            (_, None) => true,
        })
    };
    let shown = here.iter().filter(|row| BACKBONES.contains(&row.method.as_str()) || !is_beaten(row));
    let mut curves = gathered(shown.filter_map(|row| Some((format!("{} (published)", row.method), row.result()?))));
    // Rows of one name would be seeds of one rate.
    for Named { what, .. } in &mut curves {
        let names: Vec<String> = what.iter().map(|point| point.submethod.clone()).collect();
        for (i, point) in what.iter_mut().enumerate() {
            let n_before = names[..i].iter().filter(|name| **name == names[i]).count();
            if n_before > 0 {
                point.submethod = format!("{} ({})", names[i], n_before + 1);
            }
        }
    }
    curves
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_that_no_figure_can_show_is_refused_by_file_line_and_column() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("theirs.csv");
        let read = |row: &str| {
            let heads = "Dataset,Scene,Method,Submethod,PSNR,SSIM,LPIPS,Size [Bytes],#Gaussians,Source,Note";
            std::fs::write(&path, format!("{heads}\nD,,HAC,low,30,,,1000,,a paper,\n{row}\n")).unwrap();
            PublishedRow::read_all(&path)
        };
        for (row, said) in [
            ("D,,HAC,high,inf,,,2000,,a paper,", "line 3, column PSNR: found `inf`, needed: a finite number"),
            ("D,,HAC,high,31,0.9,NaN,2000,,a paper,", "line 3, column LPIPS: found `NaN`, needed: a finite number"),
            ("D,,HAC,high,31,,,1e999,,a paper,", "line 3, column Size [Bytes]: found `1e999`, needed: a finite number"),
            ("D,,HAC,high,31,,,-5,,a paper,", "line 3, column Size [Bytes]: found `-5`, needed: more than 0 bytes"),
            ("D,,HAC,high,31,,,0,,a paper,", "line 3, column Size [Bytes]: found `0`, needed: more than 0 bytes"),
        ] {
            let error = format!("{:#}", read(row).unwrap_err());
            assert!(error.contains("theirs.csv") && error.contains(said), "{error}");
        }
        let rows = read("D,,No size,,31,,,,,a paper,").unwrap();
        assert_eq!((rows.len(), rows[1].size_bytes), (2, None), "what a paper does not give may be missing");
    }

    #[test]
    fn what_no_row_of_known_size_beats_is_shown_and_rows_of_one_name_stay_apart() {
        let row = |method: &str, submethod: &str, psnr_db, size_bytes| PublishedRow {
            dataset: "D".to_owned(),
            scene: String::new(),
            method: method.to_owned(),
            submethod: submethod.to_owned(),
            psnr_db,
            ssim: None,
            lpips: None,
            size_bytes,
            n_gaussians: None,
            source: "a paper".to_owned(),
        };
        let rows = [
            row("No size", "", 40.0, None),
            row("Best", "40k", 30.0, Some(1e6)),
            row("Best", "40k", 31.0, Some(2e6)),
            row("Best", "40k, fine", 32.0, Some(2.5e6)),
            row("Beaten", "", 29.0, Some(3e6)),
            row("HAC", "", 28.0, Some(4e6)),
        ];
        let curves = curves(&rows, "D", "");
        let found: Vec<(&str, Vec<&str>)> = curves
            .iter()
            .map(|curve| (curve.name.as_str(), curve.what.iter().map(|point| point.submethod.as_str()).collect()))
            .collect();
        assert_eq!(found, [("Best (published)", vec!["40k", "40k (2)", "40k, fine"]), ("HAC (published)", vec![""])]);
    }
}
