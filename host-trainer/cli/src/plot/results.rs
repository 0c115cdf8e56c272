//! Rows of results, and the curves of any table that has quality and size.

use anyhow::{Context, Result, bail};
use csv::StringRecord;
use pocketsplat_metrics::RatePoint;

use super::{Named, gathered};

/// What tables call quality, size and rate; upper case or not.
const PSNR: &[&str] = &["psnr", "psnr_db"];
const SIZE: &[&str] = &["size [bytes]", "bytes", "bundle_bytes"];
const RATE: &[&str] = &["submethod", "rate", "lambda"];
/// What a curve is named by, where rows differ in it: of each line the first column that is there.
const NAMING: [&[&str]; 6] = [
    &["dataset"],
    &["scene", "capture"],
    &["size", "px"],
    &["steps"],
    &["backbone"],
    &["method", "row", "training", "run", "file"],
];

/// One row of results: a method at one rate, with means over views or scenes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ResultRow {
    /// Name of the rate.
    pub submethod: String,
    /// dB.
    pub psnr_db: f64,
    /// Structural similarity.
    pub ssim: Option<f64>,
    /// Perceptual distance; none where it was not measured.
    pub lpips: Option<f64>,
    /// Everything that is needed to draw.
    pub size_bytes: f64,
    /// Gaussians that can be drawn.
    pub n_gaussians: Option<f64>,
    /// What trained and measured it; none for what is published.
    pub program: Option<String>,
}

impl ResultRow {
    /// Where the row lies in the plane of rate and distortion.
    pub(crate) fn rate_point(&self) -> RatePoint {
        RatePoint { size_bytes: self.size_bytes, psnr_db: self.psnr_db }
    }

    /// A row of quality and size alone, which is what a curve shows.
    pub(crate) fn of(submethod: &str, size_bytes: f64, psnr_db: f64) -> Self {
        let submethod = submethod.to_owned();
        Self { submethod, psnr_db, ssim: None, lpips: None, size_bytes, n_gaussians: None, program: None }
    }
}

/// Whether a table has what a curve needs.
pub(super) fn is_table(header: &StringRecord) -> bool {
    place(header, PSNR).is_some() && place(header, SIZE).is_some()
}

/// The curves of a table, each named by what its rows have and others do not; of one curve the name is empty. Rows of one rate are
/// seeds. Rows without quality or size, which is how tables say that something was not measured, are passed over.
pub(super) fn curves(reader: &mut csv::Reader<&[u8]>) -> Result<Vec<Named<Vec<ResultRow>>>> {
    let header = reader.headers()?.clone();
    let (psnr, size) = (place(&header, PSNR).context("no PSNR")?, place(&header, SIZE).context("no size")?);
    let records = reader.records().collect::<Result<Vec<_>, _>>()?;
    let measured: Vec<&StringRecord> =
        records.iter().filter(|row| !row[psnr].is_empty() && !row[size].is_empty()).collect();
    if measured.is_empty() {
        bail!("no row has both quality and size; measure its runs first");
    }
    let differs = |column: &usize| measured.iter().any(|row| row[*column] != measured[0][*column]);
    let naming: Vec<usize> = NAMING.iter().filter_map(|names| place(&header, names)).filter(differs).collect();
    let rate = place(&header, RATE);
    let row = |record: &&StringRecord| {
        let line = record.position().map_or(0, csv::Position::line);
        let remedy = "correct it, or leave the cell empty to pass the row over";
        let number = |column: usize| {
            let value = &record[column];
            let number = value.parse::<f64>().ok().filter(|number| number.is_finite());
            number.with_context(|| format!("`{value}` is no number (line {line}, {}); {remedy}", &header[column]))
        };
        let (psnr_db, size_bytes) = (number(psnr)?, number(size)?);
        if size_bytes <= 0.0 {
            bail!("a size is {size_bytes} bytes, needed: more than 0 (line {line}, {}); {remedy}", &header[size]);
        }
        let submethod = match rate {
            Some(column) if header[column].eq_ignore_ascii_case("lambda") => format!("lambda={}", &record[column]),
            Some(column) => record[column].to_owned(),
            None => format!("{size_bytes} bytes"),
        };
        let name = naming.iter().map(|column| &record[*column]).collect::<Vec<_>>().join(" ");
        Ok((name, ResultRow::of(&submethod, size_bytes, psnr_db)))
    };
    Ok(gathered(measured.iter().map(row).collect::<Result<Vec<_>>>()?))
}

/// The column that has the first of these names that any has.
fn place(header: &StringRecord, names: &[&str]) -> Option<usize> {
    names.iter().find_map(|name| header.iter().position(|column| column.eq_ignore_ascii_case(name)))
}
