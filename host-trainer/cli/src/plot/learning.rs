//! Learning curves: how runs went.

use anyhow::Result;
use plotters::prelude::*;

use super::chart::{self, Labels};
use super::{LearningRow, Named};

/// Rows on either side of one that its mean takes in: the views of a row are few and differ.
const HALF_WINDOW: usize = 7;

/// A column of the logs that gets a panel.
struct Quantity {
    title: &'static str,
    axis: &'static str,
    of: fn(&LearningRow) -> Option<f64>,
    /// Whether it is of a few views or anchors at a time: then the rows are drawn thin, and their means thick.
    scatters: bool,
}

const PSNR: Quantity = Quantity {
    title: "PSNR of the training views (thick: means over 15 rows)",
    axis: "PSNR, dB",
    of: |row| row.psnr_db,
    scatters: true,
};
const ANCHORS: Quantity =
    Quantity { title: "Size of the model", axis: "anchors", of: |row| Some(row.anchors as f64), scatters: false };
const RATE: Quantity =
    Quantity { title: "Rate", axis: "bits of an anchor's values", of: LearningRow::bits, scatters: true };

/// PSNR of the training views over the iterations, below it the anchors, and below these the rate if any run has one, as
/// an SVG.
pub(crate) fn learning_curves_svg(runs: &[Named<Vec<LearningRow>>]) -> Result<String> {
    svg([chart::WIDTH_PX, chart::PANEL_PX], runs, 0)
}

/// The same of one run, which a page names and shows on a phone too; the axis reaches to the last of the run's iterations, done or not.
pub(crate) fn learning_curve_svg(rows: Vec<LearningRow>, iterations: u32) -> Result<String> {
    svg(chart::PAGE_PX, &[Named { name: String::new(), what: rows }], iterations)
}

fn svg(size_px: [u32; 2], runs: &[Named<Vec<LearningRow>>], iterations: u32) -> Result<String> {
    let has_rate = runs.iter().flat_map(|run| &run.what).any(|row| row.bits().is_some());
    let quantities = if has_rate { vec![PSNR, ANCHORS, RATE] } else { vec![PSNR, ANCHORS] };
    let done = runs.iter().flat_map(|run| &run.what).map(|row| row.iteration).max().unwrap_or(1);
    chart::figure_of(size_px, quantities.len(), |panels, _| {
        let last = done.max(iterations).max(1);
        panels.iter().zip(&quantities).try_for_each(|(panel, quantity)| draw(panel, quantity, runs, last))
    })
}

fn draw(
    panel: &chart::Area<'_>,
    quantity: &Quantity,
    runs: &[Named<Vec<LearningRow>>],
    last_iteration: u32,
) -> Result<()> {
    let all = runs.iter().flat_map(|run| points(quantity, &run.what)).map(|(_, value)| value);
    // PSNR has no zero worth showing; amounts are read by their height.
    let values = if quantity.axis == PSNR.axis { chart::padded(all) } else { chart::from_zero(all) };
    let digits = chart::decimals(&values);
    let labels = Labels {
        title: quantity.title,
        x: "iteration",
        y: quantity.axis,
        x_tick: &|x| chart::thousands(*x),
        y_tick: &|y| if digits == 0 { chart::thousands(*y) } else { format!("{y:.digits$}") },
    };
    // A single run has its name in the title of whatever shows the figure.
    let (area, for_legend) = if runs.len() > 1 {
        let (area, for_legend) = chart::with_legend(panel);
        (area, Some(for_legend))
    } else {
        (panel.clone(), None)
    };
    let mut chart = chart::axes(&area, 0.0..f64::from(last_iteration), values, &labels)?;
    for (i, run) in runs.iter().enumerate() {
        let (mut line, colour) = (points(quantity, &run.what), chart::colour(i));
        if quantity.scatters {
            chart.draw_series(LineSeries::new(line.clone(), colour.mix(0.25)))?;
            line = means(&line);
        }
        chart.draw_series(LineSeries::new(line, colour.stroke_width(2)))?;
    }
    let entries = runs.iter().enumerate().map(|(i, run)| (chart::Sign::Line(i), run.name.as_str()));
    for_legend.map_or(Ok(()), |area| chart::legend(&area, entries))
}

/// (iteration, value) of the rows that have one.
fn points(quantity: &Quantity, rows: &[LearningRow]) -> Vec<(f64, f64)> {
    rows.iter().filter_map(|row| Some((f64::from(row.iteration), (quantity.of)(row)?))).collect()
}

/// Each point at the mean of those around it, of as many before as after.
fn means(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mean = |(i, &(x, _)): (usize, &(f64, f64))| {
        let half = HALF_WINDOW.min(i).min(points.len() - 1 - i);
        let window = &points[i - half..=i + half];
        (x, window.iter().map(|(_, y)| y).sum::<f64>() / window.len() as f64)
    };
    points.iter().enumerate().map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_leave_a_line_where_it_is() {
        let line: Vec<(f64, f64)> = (0..40).map(|i| (f64::from(i), 3.0 * f64::from(i))).collect();
        for ((x, y), (_, expected)) in means(&line).into_iter().zip(&line) {
            assert!((y - expected).abs() < 1e-9, "at {x}: {y}");
        }
        assert!(means(&[]).is_empty());
    }

    #[test]
    fn every_run_is_named_and_every_axis_labelled() {
        let row = |iteration, psnr_db, bits| LearningRow {
            iteration,
            psnr_db,
            anchors: 10,
            seconds: None,
            feature_bits: bits,
            log_scale_bits: bits,
            offset_bits: bits,
        };
        let run = |name: &str, bits| Named {
            name: name.to_owned(),
            what: vec![row(5, Some(10.0), None), row(10, None, bits), row(15, Some(12.0), bits)],
        };
        let svg = learning_curves_svg(&[run("first", None), run("second", None)]).unwrap();
        for text in ["first", "second", "iteration", "PSNR, dB", "anchors"] {
            assert!(svg.contains(text), "{text}");
        }
        assert!(!svg.contains("bits"), "no run has a rate");
        assert!(
            learning_curves_svg(&[run("first", None), run("second", Some(3.0))]).unwrap().contains("bits of an anchor")
        );
        assert!(learning_curves_svg(&[]).is_ok(), "an empty figure is a figure");
        let begun = learning_curve_svg(run("first", None).what, 4000).unwrap();
        assert!(begun.contains("\n4,000\n") && !begun.contains("first"), "the whole run is on the axis: {begun}");
    }
}
