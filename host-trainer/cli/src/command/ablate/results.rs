//! What an ablation has found so far: every run, and every row against the backbone alone.

use std::path::PathBuf;

use crate::plot::{Named, ResultRow, SizeAxis, rate_distortion_svg, results_csv};
use anyhow::Result;
use pocketsplat_trainer::metrics::{
    RateDifference, RatePoint, bd_psnr_db, bd_rate_percent, ln_excess, rate_difference,
};
use serde::Serialize;

use super::rows::rows;
use crate::command::eval::Evaluation;
use crate::command::output;

/// The runs that are measured.
pub(super) struct Results {
    folder: PathBuf,
    /// Weight of the bits at which options and seeds are compared.
    option_lambda: f64,
    /// The seed of the curves.
    seed: u64,
    lines: Vec<Line>,
}

/// One line of ablation.csv.
#[derive(Serialize)]
struct Line {
    row: &'static str,
    lambda: f64,
    seed: u64,
    #[serde(rename = "PSNR")]
    psnr_db: f64,
    #[serde(rename = "SSIM")]
    ssim: f64,
    #[serde(rename = "LPIPS")]
    lpips: Option<f64>,
    #[serde(rename = "Size [Bytes]")]
    size_bytes: usize,
    anchors: u32,
    #[serde(rename = "#Gaussians")]
    gaussians: u64,
    decode_s: f64,
    render_s: f64,
    /// Where the run is tiered: `rate:dB` of each tier.
    tiers: String,
}

/// One line of summary.csv: a row against `none`.
#[derive(Serialize)]
struct Comparison {
    row: &'static str,
    /// Over the rates that both have.
    bd_rate_percent: Option<f64>,
    bd_psnr_db: Option<f64>,
    /// As `bd_rate_percent` at equal SSIM: where photographs differ in exposure or the scene is learnt by heart, PSNR of
    /// held-out views may fall while bytes and likeness rise.
    bd_rate_ssim_percent: Option<f64>,
    /// At the rate of the options, at equal quality; with its 95 % interval where there are seeds.
    rate_percent: Option<f64>,
    rate_low_percent: Option<f64>,
    rate_high_percent: Option<f64>,
    /// At the rate of the options, first seed.
    psnr_difference_db: Option<f64>,
    bytes_percent: Option<f64>,
    anchors_percent: Option<f64>,
    decode_percent: Option<f64>,
    render_percent: Option<f64>,
}

impl Results {
    pub(super) fn new(folder: PathBuf, option_lambda: f64, seed: u64) -> Self {
        Self { folder, option_lambda, seed, lines: Vec::new() }
    }

    pub(super) fn add(&mut self, row: &'static str, lambda: f64, seed: u64, evaluation: &Evaluation) {
        self.lines.push(Line::new(row, lambda, seed, evaluation));
    }

    /// The comparisons as the text of summary.csv.
    pub(super) fn summary_text(&self) -> Result<String> {
        Ok(String::from_utf8(csv_of(&self.summary())?)?)
    }

    fn of(&self, row: &str) -> impl Iterator<Item = &Line> {
        self.lines.iter().filter(move |line| line.row == row)
    }

    /// Writes the tables, a table for each curve, and the figure of all curves.
    pub(super) fn write(&self) -> Result<()> {
        output::write_whole(&self.folder.join("ablation.csv"), &csv_of(&self.lines)?)?;
        output::write_whole(&self.folder.join("summary.csv"), &csv_of(&self.summary())?)?;
        let mut curves = Vec::new();
        for row in rows().iter().filter(|row| row.at_all_rates) {
            let points: Vec<ResultRow> =
                self.of(row.name).filter(|line| line.seed == self.seed).map(Line::result_row).collect();
            if !points.is_empty() {
                output::write_whole(&self.folder.join(format!("{}.csv", row.name)), &results_csv(&points)?)?;
                curves.push(Named { name: row.name.to_owned(), what: points });
            }
        }
        let figure = rate_distortion_svg(&curves, SizeAxis::Linear)?;
        output::write_whole(&self.folder.join("rate_distortion.svg"), figure.as_bytes())
    }

    /// Every row but `none`, in the order of the plan.
    fn summary(&self) -> Vec<Comparison> {
        let mut names: Vec<&'static str> = Vec::new();
        for line in self.lines.iter().filter(|line| line.row != "none") {
            if !names.contains(&line.row) {
                names.push(line.row);
            }
        }
        names.into_iter().map(|row| self.comparison(row)).collect()
    }

    fn comparison(&self, row: &'static str) -> Comparison {
        let curve_of = |row: &str, point: fn(&Line) -> RatePoint| -> Vec<RatePoint> {
            self.of(row).filter(|line| line.seed == self.seed).map(point).collect()
        };
        let curve = |row: &str| curve_of(row, Line::rate_point);
        let at_option =
            |row: &str| -> Vec<&Line> { self.of(row).filter(|line| line.lambda == self.option_lambda).collect() };
        let runs = |row: &str| -> Vec<RatePoint> { at_option(row).into_iter().map(Line::rate_point).collect() };
        let first = |row: &str| at_option(row).into_iter().find(|line| line.seed == self.seed);
        let (none, own) = (curve("none"), curve(row));
        let by_seeds = rate_difference(&none, &runs("none"), &runs(row));
        let pair = first("none").zip(first(row));
        let alone = pair.and_then(|(_, line)| ln_excess(&none, &line.rate_point()));
        let share = |of: fn(&Line) -> f64| pair.map(|(none, line)| 100.0 * (of(line) / of(none) - 1.0));
        Comparison {
            row,
            bd_rate_percent: bd_rate_percent(&none, &own).ok(),
            bd_psnr_db: bd_psnr_db(&none, &own).ok(),
            bd_rate_ssim_percent: bd_rate_percent(
                &curve_of("none", Line::rate_point_of_ssim),
                &curve_of(row, Line::rate_point_of_ssim),
            )
            .ok(),
            rate_percent: by_seeds.map(|d| d.percent).or(alone.map(|ln| 100.0 * ln.exp_m1())),
            rate_low_percent: by_seeds.map(|RateDifference { interval, .. }| interval[0]),
            rate_high_percent: by_seeds.map(|RateDifference { interval, .. }| interval[1]),
            psnr_difference_db: pair.map(|(none, line)| line.psnr_db - none.psnr_db),
            bytes_percent: share(|line| line.size_bytes as f64),
            anchors_percent: share(|line| f64::from(line.anchors)),
            decode_percent: share(|line| line.decode_s),
            render_percent: share(|line| line.render_s),
        }
    }
}

impl Line {
    fn new(row: &'static str, lambda: f64, seed: u64, evaluation: &Evaluation) -> Self {
        Self {
            row,
            lambda,
            seed,
            psnr_db: evaluation.psnr_db,
            ssim: evaluation.ssim,
            lpips: evaluation.lpips,
            size_bytes: evaluation.bundle_bytes,
            anchors: evaluation.n_anchors,
            gaussians: evaluation.n_gaussians,
            decode_s: evaluation.decode_s,
            render_s: evaluation.render_s_per_view,
            tiers: evaluation
                .tiers
                .iter()
                .map(|tier| format!("{:.2}:{:.3}", tier.pruning_rate, tier.psnr_db))
                .collect::<Vec<_>>()
                .join(" "),
        }
    }

    fn rate_point(&self) -> RatePoint {
        RatePoint { size_bytes: self.size_bytes as f64, psnr_db: self.psnr_db }
    }

    /// With −10·lg(1 − SSIM) for quality, which is spread as decibels are.
    fn rate_point_of_ssim(&self) -> RatePoint {
        RatePoint { size_bytes: self.size_bytes as f64, psnr_db: -10.0 * (1.0 - self.ssim).log10() }
    }

    fn result_row(&self) -> ResultRow {
        ResultRow {
            submethod: format!("lambda={}", self.lambda),
            psnr_db: self.psnr_db,
            ssim: Some(self.ssim),
            lpips: self.lpips,
            size_bytes: self.size_bytes as f64,
            n_gaussians: Some(self.gaussians as f64),
        }
    }
}

fn csv_of<T: Serialize>(lines: &[T]) -> Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for line in lines {
        writer.serialize(line)?;
    }
    Ok(writer.into_inner().map_err(|error| error.into_error())?)
}
