//! The table of a survey, and its figure.

use std::fmt::Write as _;

use anyhow::Result;
use serde::Serialize;

use super::point::Point;
use crate::command::output;
use crate::command::tables::finished::rounded;
use crate::command::tables::published::PublishedRow;
use crate::plot::{Named, ResultRow, SizeAxis, gathered, rate_distortion_svg};

/// One line: a method at one rate, measured here or published.
#[derive(Serialize)]
struct Line {
    #[serde(rename = "Method")]
    method: String,
    #[serde(rename = "Submethod")]
    submethod: String,
    #[serde(rename = "PSNR")]
    psnr_db: f64,
    #[serde(rename = "SSIM")]
    ssim: Option<f64>,
    #[serde(rename = "LPIPS")]
    lpips: Option<f64>,
    #[serde(rename = "Size [Bytes]")]
    size_bytes: Option<f64>,
    #[serde(rename = "#Gaussians")]
    n_gaussians: Option<f64>,
    n_anchors: Option<u32>,
    /// Memory in which a bundle's frames are drawn.
    ram_bytes: Option<usize>,
    decode_s: Option<f64>,
    /// From the bytes of the file to what every view is drawn of, in memory: Gaussians, or anchors and heads. The fastest of a few times.
    train_s: Option<f64>,
    program: String,
}

impl Line {
    fn of(point: &Point) -> Self {
        let Point { method, rate, figures } = point;
        let run = &figures.evaluation;
        Self {
            method: (*method).to_owned(),
            submethod: (*rate).to_owned(),
            psnr_db: rounded(run.psnr_db),
            ssim: Some(rounded(run.ssim)),
            lpips: run.lpips.map(rounded),
            size_bytes: Some(run.bundle_bytes as f64),
            n_gaussians: Some(run.n_gaussians as f64),
            n_anchors: (run.n_anchors > 0).then_some(run.n_anchors),
            ram_bytes: (run.scratch_bytes > 0).then_some(run.scratch_bytes),
            decode_s: Some(rounded(run.decode_s)),
            train_s: Some(rounded(figures.train_s)),
            program: run.program.clone(),
        }
    }

    fn published(row: &PublishedRow) -> Self {
        Self {
            method: format!("{} (published)", row.method),
            submethod: row.submethod.clone(),
            psnr_db: row.psnr_db,
            ssim: row.ssim,
            lpips: row.lpips,
            size_bytes: row.size_bytes,
            n_gaussians: row.n_gaussians,
            n_anchors: None,
            ram_bytes: None,
            decode_s: None,
            train_s: None,
            program: String::new(),
        }
    }
}

/// PSNR over size, a curve for each method that was trained here: published images have other sizes.
pub(super) fn figure(points: &[Point]) -> Result<String> {
    let row = |point: &Point| (point.method.to_owned(), point.figures.evaluation.result_row(point.rate.to_owned()));
    let curves: Vec<Named<Vec<ResultRow>>> = gathered(points.iter().map(row));
    rate_distortion_svg(&curves, SizeAxis::Logarithmic)
}

/// What was measured, and then what is published.
fn lines(points: &[Point], published: &[PublishedRow]) -> impl Iterator<Item = Line> {
    points.iter().map(Line::of).chain(published.iter().map(Line::published))
}

/// The table as CSV.
pub(super) fn csv(points: &[Point], published: &[PublishedRow]) -> Result<Vec<u8>> {
    output::csv(lines(points, published))
}

/// The table for people.
pub(super) fn text(points: &[Point], published: &[PublishedRow]) -> String {
    let heads = [
        "method",
        "rate",
        "PSNR, dB",
        "SSIM",
        "LPIPS",
        "kB",
        "Gaussians",
        "anchors",
        "RAM, kB",
        "decode, s",
        "train, s",
    ];
    let or_dash = |text: Option<String>| text.unwrap_or_else(|| "–".to_owned());
    let fixed = |value: Option<f64>, digits: usize| or_dash(value.map(|value| format!("{value:.digits$}")));
    let cells = |line: Line| {
        [
            line.method,
            line.submethod,
            format!("{:.2}", line.psnr_db),
            fixed(line.ssim, 3),
            fixed(line.lpips, 3),
            fixed(line.size_bytes.map(|bytes| bytes / 1e3), 0),
            fixed(line.n_gaussians, 0),
            or_dash(line.n_anchors.map(|n| n.to_string())),
            fixed(line.ram_bytes.map(|bytes| bytes as f64 / 1e3), 0),
            fixed(line.decode_s, 2),
            fixed(line.train_s, 0),
        ]
    };
    let rows: Vec<[String; 11]> =
        std::iter::once(heads.map(str::to_owned)).chain(lines(points, published).map(cells)).collect();
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; 11] = std::array::from_fn(width);
    let mut text = String::new();
    for row in &rows {
        for (column, (cell, width)) in row.iter().zip(widths).enumerate() {
            // Names to the left, numbers to the right.
            let _ = if column < 2 { write!(text, "{cell:<width$}  ") } else { write!(text, "{cell:>width$}  ") };
        }
        text.truncate(text.trim_end().len());
        text.push('\n');
    }
    text
}
