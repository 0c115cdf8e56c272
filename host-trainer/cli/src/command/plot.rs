//! `pocketsplat plot`: figures of what runs recorded.

use std::path::PathBuf;

use crate::plot::{
    Named, Recording, ResultRow, SizeAxis, cost_svg, gathered, learning_curves_svg, names_of, rate_distortion_svg,
};
use anyhow::{Result, bail};
use pocketsplat_files::Output;
use pocketsplat_metrics::{RatePoint, bd_psnr_db, bd_rate_percent};
use serde_json::{Map, Value, json};

use super::output;
use super::outputs::{FIGURE, OverwriteArgs, check_name};

/// Draw recorded curves as an SVG.
///
/// Learning curves of runs, rate-distortion curves, or what settings cost.
///
/// Of rate-distortion curves it also prints how far each lies from the first: Bjøntegaard's deltas.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Files of one kind: progress.csv of runs, tables with quality and size (`PSNR`, `Size [Bytes]`), or cost.csv and runs.csv.
    #[arg(value_name = "CSV", required = true)]
    files: Vec<PathBuf>,
    /// The figure to write.
    #[arg(short, long, value_name = "FILE.svg")]
    output: PathBuf,
    /// Draw sizes on a logarithmic axis.
    #[arg(long)]
    log_x: bool,
    /// Print the deltas as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    overwrite: OverwriteArgs,
}

pub(crate) fn run(args: &Args) -> Result<()> {
    check_name(&args.output, FIGURE, None)?;
    let outputs = args.files.iter().fold(args.overwrite.outputs(), |outputs, path| outputs.reading(path));
    let output = outputs.clone().file(&args.output, FIGURE)?;
    let (mut runs, mut curves, mut panels) = (Vec::new(), Vec::new(), Vec::new());
    for (path, name) in args.files.iter().zip(names_of(&args.files)) {
        match Recording::read(path)? {
            Recording::Learning(what) => runs.push(Named { name, what }),
            Recording::Curves(of_file) => {
                let is_alone = args.files.len() == 1;
                let named = |own: String| match own.is_empty() {
                    true => name.clone(),
                    false if is_alone => own,
                    false => format!("{name}: {own}"),
                };
                curves.extend(of_file.into_iter().map(|Named { name, what }| Named { name: named(name), what }));
            }
            Recording::Cost(of_file) => panels.extend(of_file),
        }
    }
    let n_kinds = [runs.is_empty(), curves.is_empty(), panels.is_empty()].iter().filter(|is_empty| !**is_empty).count();
    if n_kinds > 1 {
        bail!(
            "these are learning curves, rate-distortion curves or costs, and not all of one kind; plot them one kind at a time"
        );
    }
    if args.log_x && curves.is_empty() {
        bail!("--log-x is for the sizes of rate-distortion curves");
    }
    if args.json && curves.is_empty() {
        bail!("--json prints how far rate-distortion curves lie apart; leave it out");
    }
    match (runs.is_empty(), panels.is_empty()) {
        (false, _) => Ok(output.write(learning_curves_svg(&runs)?.as_bytes())?),
        (_, false) => Ok(output.write(cost_svg(&panels)?.as_bytes())?),
        _ => draw_rate_distortion(args, &output, &curves),
    }
}

fn draw_rate_distortion(args: &Args, output: &Output, curves: &[Named<Vec<ResultRow>>]) -> Result<()> {
    let axis = if args.log_x { SizeAxis::Logarithmic } else { SizeAxis::Linear };
    output.write(rate_distortion_svg(curves, axis)?.as_bytes())?;
    let [reference, others @ ..] = curves else { return Ok(()) };
    if others.is_empty() && !args.json {
        return Ok(());
    }
    let points = |curve: &Named<Vec<ResultRow>>| of_rates(&curve.what);
    let mut report = Map::new();
    for curve in others {
        report.insert(
            format!("{} against {}", curve.name, reference.name),
            deltas(&points(reference), &points(curve), args.json),
        );
    }
    output::print(&report, args.json)
}

/// A point for each rate, where rows of one name are seeds: their mean where every rate has as many; else the first of each, for then
/// one seed has the curve and the others show what a seed changes.
fn of_rates(rows: &[ResultRow]) -> Vec<RatePoint> {
    let rates = gathered(rows.iter().map(|row| (row.submethod.clone(), row.rate_point())));
    let has_all_seeds = rates.iter().all(|rate| rate.what.len() == rates[0].what.len());
    let point = |seeds: &[RatePoint]| {
        let seeds = if has_all_seeds { seeds } else { &seeds[..1] };
        let mean = |value: fn(&RatePoint) -> f64| seeds.iter().map(value).sum::<f64>() / seeds.len() as f64;
        RatePoint { size_bytes: mean(|point| point.size_bytes), psnr_db: mean(|point| point.psnr_db) }
    };
    rates.iter().map(|rate| point(&rate.what)).collect()
}

/// Bjøntegaard's deltas, or why there are none.
fn deltas(reference: &[RatePoint], compared: &[RatePoint], as_json: bool) -> Value {
    let (rate, psnr) = (bd_rate_percent(reference, compared), bd_psnr_db(reference, compared));
    if as_json {
        let why: Vec<String> =
            rate.as_ref().err().into_iter().chain(psnr.as_ref().err()).map(ToString::to_string).collect();
        return json!({ "bd_rate_percent": rate.ok(), "bd_psnr_db": psnr.ok(), "why_not": why });
    }
    let rate = rate.map_or_else(|error| format!("no BD-rate: {error}"), |rate| format!("BD-rate {rate:+.2} %"));
    let psnr = psnr.map_or_else(|error| format!("no BD-PSNR: {error}"), |psnr| format!("BD-PSNR {psnr:+.3} dB"));
    json!(format!("{rate}; {psnr}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_one_point_whatever_seeds_it_has() {
        let found = |rows: &[ResultRow]| -> Vec<(f64, f64)> {
            of_rates(rows).into_iter().map(|point| (point.size_bytes, point.psnr_db)).collect()
        };
        let mut rows =
            vec![ResultRow::of("a", 1.0, 30.0), ResultRow::of("b", 5.0, 33.0), ResultRow::of("a", 3.0, 32.0)];
        assert_eq!(found(&rows), [(1.0, 30.0), (5.0, 33.0)], "the seed that has the curve");
        rows.push(ResultRow::of("b", 7.0, 34.0));
        assert_eq!(found(&rows), [(2.0, 31.0), (6.0, 33.5)], "both have it");
    }
}
