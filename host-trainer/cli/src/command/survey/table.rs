//! The table of a survey, and its figure.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Context as _, Result};
use serde::{Deserialize, Serialize};

use super::point::Point;
use crate::command::output;
use crate::command::tables::finished::rounded;
use crate::command::tables::published::PublishedRow;
use crate::plot::{Named, ResultRow, SizeAxis, gathered, rate_distortion_svg};

/// One line: a method at one rate, measured here or published.
#[derive(Serialize, Deserialize)]
pub(super) struct Line {
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
    /// From the bytes of the file to what every view is drawn of, in memory: Gaussians, or anchors and heads. The fastest of a few times.
    decode_s: Option<f64>,
    /// Of training; a method that compresses has that of its scene on top.
    train_s: Option<f64>,
    program: String,
}

/// How a table begins.
pub(super) const BEGINNING: &str = "Method,";

/// Ends the name of a method whose line is published.
const PUBLISHED: &str = " (published)";

impl Line {
    pub(super) fn of(point: &Point) -> Self {
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

    /// Its method, and a point of that method's curve.
    fn result(&self) -> Option<(String, ResultRow)> {
        let row = ResultRow {
            submethod: self.submethod.clone(),
            psnr_db: self.psnr_db,
            ssim: self.ssim,
            lpips: self.lpips,
            size_bytes: self.size_bytes?,
            n_gaussians: self.n_gaussians,
            program: Some(self.program.clone()),
        };
        Some((self.method.clone(), row))
    }

    fn published(row: &PublishedRow) -> Self {
        Self {
            method: format!("{}{PUBLISHED}", row.method),
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

/// The lines of a survey.
pub(super) struct Table {
    /// What was measured, in the order of the methods.
    measured: Vec<Line>,
    /// What an earlier command measured, and this one has not reached.
    earlier: Vec<Line>,
    published: Vec<Line>,
}

impl Table {
    /// What the table at `path` has of an earlier command, and what is published.
    pub(super) fn begun(path: &Path, published: &[PublishedRow]) -> Result<Self> {
        let bytes = if path.is_file() { std::fs::read(path)? } else { Vec::new() };
        // A file of another kind is there to be replaced.
        let bytes = if bytes.starts_with(BEGINNING.as_bytes()) { &bytes[..] } else { &[] };
        let earlier: Result<Vec<Line>, _> = csv::Reader::from_reader(bytes).deserialize().collect();
        let mut earlier = earlier.with_context(|| {
            format!("{} has no lines of a survey; move it away, and give the command again", path.display())
        })?;
        earlier.retain(|line| !line.method.ends_with(PUBLISHED));
        Ok(Self { earlier, published: published.iter().map(Line::published).collect(), measured: Vec::new() })
    }

    /// Adds what was measured, in place of what an earlier command measured of the same.
    pub(super) fn add(&mut self, line: Line) {
        self.earlier.retain(|earlier| (&earlier.method, &earlier.submethod) != (&line.method, &line.submethod));
        self.measured.push(line);
    }

    /// What was measured here, now or earlier.
    fn ours(&self) -> impl Iterator<Item = &Line> {
        self.measured.iter().chain(&self.earlier)
    }

    /// As CSV.
    pub(super) fn csv(&self) -> Result<Vec<u8>> {
        output::csv(self.ours().chain(&self.published))
    }

    /// PSNR over size, a curve for each method that was trained here: published images have other sizes.
    pub(super) fn figure(&self) -> Result<String> {
        let curves: Vec<Named<Vec<ResultRow>>> = gathered(self.ours().filter_map(Line::result));
        rate_distortion_svg(&curves, SizeAxis::Logarithmic)
    }

    /// For people.
    pub(super) fn text(&self) -> String {
        text(self.ours().chain(&self.published))
    }
}

fn or_dash(text: Option<String>) -> String {
    text.unwrap_or_else(|| "–".to_owned())
}

fn fixed(value: Option<f64>, digits: usize) -> String {
    or_dash(value.map(|value| format!("{value:.digits$}")))
}

/// What stands above a column, and what a line has in it.
type Column = (&'static str, fn(&Line) -> String);

const COLUMNS: [Column; 11] = [
    ("method", |line| line.method.clone()),
    ("rate", |line| line.submethod.clone()),
    ("PSNR, dB", |line| format!("{:.2}", line.psnr_db)),
    ("SSIM", |line| fixed(line.ssim, 3)),
    ("LPIPS", |line| fixed(line.lpips, 3)),
    ("kB", |line| fixed(line.size_bytes.map(|bytes| bytes / 1e3), 0)),
    ("Gaussians", |line| fixed(line.n_gaussians, 0)),
    ("anchors", |line| or_dash(line.n_anchors.map(|n| n.to_string()))),
    ("RAM, kB", |line| fixed(line.ram_bytes.map(|bytes| bytes as f64 / 1e3), 0)),
    ("decode, s", |line| fixed(line.decode_s, 2)),
    ("train, s", |line| fixed(line.train_s, 0)),
];

/// A line each, in columns.
fn text<'a>(lines: impl Iterator<Item = &'a Line>) -> String {
    let heads = COLUMNS.map(|(head, _)| head.to_owned());
    let cells = |line: &Line| COLUMNS.map(|(_, cell)| cell(line));
    let rows: Vec<[String; 11]> = std::iter::once(heads).chain(lines.map(cells)).collect();
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
