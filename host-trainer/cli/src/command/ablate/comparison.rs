//! What an ablation has found so far: every run, and every row against the backbone alone.

use pocketsplat_metrics::{RateDifference, RatePoint, bd_psnr_db, bd_rate_percent, ln_excess, rate_difference};
use serde::Serialize;

use super::rows::BASELINE;
use crate::command::eval::{Evaluation, TierEvaluation};
use crate::command::runs::MeasuredRun;

/// One line of ablation.csv.
#[derive(Serialize)]
pub(super) struct AblationLine {
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
    program: String,
}

/// One line of summary.csv: a row against `none`.
#[derive(Serialize)]
pub(super) struct Comparison {
    row: &'static str,
    /// Over the rates that both have.
    bd_rate_percent: Option<f64>,
    bd_psnr_db: Option<f64>,
    /// As `bd_rate_percent` at equal SSIM: where photographs differ in exposure or training overfits, PSNR of
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

/// Every run, as ablation.csv lists it.
pub(super) fn run_lines(runs: &[MeasuredRun<'_>]) -> impl Iterator<Item = AblationLine> {
    let tier = |tier: &TierEvaluation| format!("{:.2}:{:.3}", tier.pruning_rate, tier.psnr_db);
    runs.iter().map(move |MeasuredRun { spec, evaluation }| AblationLine {
        row: spec.row,
        lambda: spec.lambda,
        seed: spec.seed,
        psnr_db: evaluation.psnr_db,
        ssim: evaluation.ssim,
        lpips: evaluation.lpips,
        size_bytes: evaluation.bundle_bytes,
        anchors: evaluation.n_anchors,
        gaussians: evaluation.n_gaussians,
        decode_s: evaluation.decode_s,
        render_s: evaluation.render_s_per_view,
        tiers: evaluation.tiers.iter().map(tier).collect::<Vec<_>>().join(" "),
        program: evaluation.program.clone(),
    })
}

/// Every row but the baseline against it, in the order of the runs.
///
/// * `option_lambda`: the weight of the bits at which options and seeds are compared.
pub(super) fn comparisons(runs: &[MeasuredRun<'_>], option_lambda: f64) -> impl Iterator<Item = Comparison> {
    let mut rows: Vec<&'static str> = Vec::new();
    for MeasuredRun { spec, .. } in runs.iter().filter(|run| run.spec.row != BASELINE) {
        if !rows.contains(&spec.row) {
            rows.push(spec.row);
        }
    }
    rows.into_iter().map(move |row| Comparison::new(row, runs, option_lambda))
}

impl Comparison {
    fn new(row: &'static str, runs: &[MeasuredRun<'_>], option_lambda: f64) -> Self {
        let of = |row: &'static str| runs.iter().filter(move |run| run.spec.row == row);
        let curve = |row, point: fn(&Evaluation) -> RatePoint| -> Vec<RatePoint> {
            of(row).filter(|run| run.spec.on_curve).map(|run| point(&run.evaluation)).collect()
        };
        let at_option = |row| of(row).filter(|run| run.spec.lambda == option_lambda).map(|run| &run.evaluation);
        let points = |row| at_option(row).map(rate_point).collect::<Vec<_>>();
        let (baseline, own) = (curve(BASELINE, rate_point), curve(row, rate_point));
        let by_seeds = rate_difference(&baseline, &points(BASELINE), &points(row));
        // The first seed's come first.
        let pair = at_option(BASELINE).next().zip(at_option(row).next());
        let alone = pair.and_then(|(_, own)| ln_excess(&baseline, &rate_point(own)));
        let share = |of: fn(&Evaluation) -> f64| pair.map(|(baseline, own)| 100.0 * (of(own) / of(baseline) - 1.0));
        Self {
            row,
            bd_rate_percent: bd_rate_percent(&baseline, &own).ok(),
            bd_psnr_db: bd_psnr_db(&baseline, &own).ok(),
            bd_rate_ssim_percent: bd_rate_percent(&curve(BASELINE, ssim_point), &curve(row, ssim_point)).ok(),
            rate_percent: by_seeds.map(|d| d.percent).or(alone.map(|ln| 100.0 * ln.exp_m1())),
            rate_low_percent: by_seeds.map(|RateDifference { interval, .. }| interval[0]),
            rate_high_percent: by_seeds.map(|RateDifference { interval, .. }| interval[1]),
            psnr_difference_db: pair.map(|(baseline, own)| own.psnr_db - baseline.psnr_db),
            bytes_percent: share(|run| run.bundle_bytes as f64),
            anchors_percent: share(|run| f64::from(run.n_anchors)),
            decode_percent: share(|run| run.decode_s),
            render_percent: share(|run| run.render_s_per_view),
        }
    }
}

fn rate_point(run: &Evaluation) -> RatePoint {
    RatePoint { size_bytes: run.bundle_bytes as f64, psnr_db: run.psnr_db }
}

/// With −10·lg(1 − SSIM) for quality, which is spread as decibels are.
fn ssim_point(run: &Evaluation) -> RatePoint {
    RatePoint { size_bytes: run.bundle_bytes as f64, psnr_db: -10.0 * (1.0 - run.ssim).log10() }
}
