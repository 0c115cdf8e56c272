//! What runs and sweeps recorded, as read from CSV files.

use std::path::Path;

use anyhow::{Context, Result, bail};
use pocketsplat_trainer::metrics::RatePoint;
use serde::Deserialize;
use serde::de::DeserializeOwned;

/// One row of a run's `progress.csv`; other columns are passed over.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub(crate) struct LearningRow {
    /// Iterations done.
    pub iteration: u32,
    /// Mean PSNR of the training views since the row before, dB; none where every step was dropped.
    pub psnr_db: Option<f64>,
    /// Anchors now.
    pub anchors: u64,
    /// Mean bits of an anchor's features since the row before, where the run has a rate.
    #[serde(default)]
    pub feature_bits: Option<f64>,
    /// Of its log-scales, likewise.
    #[serde(default)]
    pub log_scale_bits: Option<f64>,
    /// Of its offsets, likewise.
    #[serde(default)]
    pub offset_bits: Option<f64>,
}

impl LearningRow {
    /// Mean bits of an anchor's values, where the run has a rate.
    pub(crate) fn bits(&self) -> Option<f64> {
        Some(self.feature_bits? + self.log_scale_bits? + self.offset_bits?)
    }
}

/// One row of results: a method at one rate, with means over views or scenes.
///
/// The columns are those of the 3DGS compression survey (Bagdasarian et al. 2024, "3DGS.zip"), so that its tables and ours
/// can be laid over each other.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub(crate) struct ResultRow {
    /// Name of the rate.
    #[serde(rename = "Submethod")]
    pub submethod: String,
    /// dB.
    #[serde(rename = "PSNR")]
    pub psnr_db: f64,
    /// Structural similarity.
    #[serde(rename = "SSIM")]
    pub ssim: Option<f64>,
    /// Perceptual distance; none where it was not measured.
    #[serde(rename = "LPIPS")]
    pub lpips: Option<f64>,
    /// Everything that is needed to draw.
    #[serde(rename = "Size [Bytes]")]
    pub size_bytes: f64,
    /// Gaussians that can be drawn.
    #[serde(rename = "#Gaussians")]
    pub n_gaussians: Option<f64>,
}

impl ResultRow {
    /// Where the row lies in the plane of rate and distortion.
    pub(crate) fn rate_point(&self) -> RatePoint {
        RatePoint { size_bytes: self.size_bytes, psnr_db: self.psnr_db }
    }
}

/// Results as the CSV that [`Recording::read`] takes back.
pub(crate) fn results_csv(rows: &[ResultRow]) -> Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(["Submethod", "PSNR", "SSIM", "LPIPS", "Size [Bytes]", "#Gaussians"])?;
    let decimals = |value: f64| format!("{value:.6}");
    for row in rows {
        writer.write_record([
            row.submethod.clone(),
            decimals(row.psnr_db),
            row.ssim.map(decimals).unwrap_or_default(),
            row.lpips.map(decimals).unwrap_or_default(),
            row.size_bytes.to_string(),
            row.n_gaussians.map(|n| n.to_string()).unwrap_or_default(),
        ])?;
    }
    Ok(writer.into_inner()?)
}

/// A CSV file by what it holds.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Recording {
    /// How a run went.
    Learning(Vec<LearningRow>),
    /// What came out over rates.
    Results(Vec<ResultRow>),
}

impl Recording {
    /// Reads a CSV file, told by its header; errors name the path, and the line where it is a line's.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).with_context(|| format!("could not read {}", path.display()))?;
        Self::parse(&bytes).with_context(|| format!("{} cannot be plotted", path.display()))
    }

    fn parse(bytes: &[u8]) -> Result<Self> {
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(bytes);
        let header = reader.headers()?.clone();
        let has = |names: &[&str]| names.iter().all(|name| header.iter().any(|column| column == *name));
        if has(&["iteration", "psnr_db", "anchors"]) {
            Ok(Self::Learning(rows(reader)?))
        } else if has(&["PSNR", "Size [Bytes]"]) {
            Ok(Self::Results(rows(reader)?))
        } else {
            let found: String = header.iter().collect::<Vec<_>>().join(",").chars().take(80).collect();
            bail!(
                "it begins with `{found}`; needs the columns iteration, psnr_db and anchors (progress.csv of a run), or PSNR and \
                 Size [Bytes] (results of a sweep)"
            )
        }
    }
}

fn rows<T: DeserializeOwned>(mut reader: csv::Reader<&[u8]>) -> Result<Vec<T>> {
    let rows = reader.deserialize().collect::<Result<Vec<T>, _>>()?;
    if rows.is_empty() {
        bail!("it has no row to draw; let the run go further");
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: impl AsRef<[u8]>) -> Result<Recording> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("some.csv");
        std::fs::write(&path, text).unwrap();
        Recording::read(&path)
    }

    #[test]
    fn results_are_read_back_as_they_were_written() {
        let row = |submethod: &str, lpips| ResultRow {
            submethod: submethod.to_owned(),
            psnr_db: 31.25,
            ssim: Some(0.9375),
            lpips,
            size_bytes: 1_234_567.0,
            n_gaussians: Some(98_765.0),
        };
        let rows = vec![row("λ=0.004", None), row("λ=0.001", Some(0.125))];
        let text = String::from_utf8(results_csv(&rows).unwrap()).unwrap();
        assert!(text.contains("\nλ=0.004,31.250000,0.937500,,1234567,98765\n"), "{text}");
        assert_eq!(read(&text).unwrap(), Recording::Results(rows));
    }

    #[test]
    fn columns_are_told_by_name() {
        let text = "iteration,weather,psnr_db,anchors\n3,7.5,10.5,54381\n6,,,54400\n";
        let row = |iteration, psnr_db, anchors, [feature_bits, log_scale_bits, offset_bits]: [Option<f64>; 3]| {
            LearningRow { iteration, psnr_db, anchors, feature_bits, log_scale_bits, offset_bits }
        };
        let rows = vec![row(3, Some(10.5), 54_381, [None; 3]), row(6, None, 54_400, [None; 3])];
        assert_eq!(read(text).unwrap(), Recording::Learning(rows));
        let text = "offset_bits,iteration,psnr_db,anchors,feature_bits,log_scale_bits\n3.5,3,10.5,7,60.0,9.0\n";
        let with_rate = row(3, Some(10.5), 7, [Some(60.0), Some(9.0), Some(3.5)]);
        assert_eq!(with_rate.bits(), Some(72.5));
        assert_eq!(read(text).unwrap(), Recording::Learning(vec![with_rate]));
    }

    #[test]
    fn a_file_that_can_not_be_plotted_says_why() {
        let message = |text| {
            let error = format!("{:#}", read(text).unwrap_err());
            assert!(error.contains("some.csv"), "{error}");
            error
        };
        assert!(message("a,b\n1,2\n").contains("`a,b`"));
        assert!(message("").contains("needs the columns"));
        assert!(message("iteration,psnr_db,anchors\n").contains("no row"));
        let wrong = message("iteration,psnr_db,anchors\n3,1.0,5\n6,good,5\n");
        assert!(wrong.contains("line: 3"), "{wrong}");
    }
}
