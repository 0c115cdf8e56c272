//! Learning curves: how runs went.

use plotters::prelude::*;

use super::chart::{self, DrawError, Labels};
use super::{LearningRow, Named};

/// Rows on either side of one that its mean takes in: the views of a row are few and differ.
const HALF_WINDOW: usize = 7;

/// PSNR of the training views over the iterations, and anchors below it, as an SVG.
///
/// The rows are drawn thin, their means over 15 rows thick.
///
/// # Errors
/// [`DrawError`] when the drawing library fails.
pub fn learning_curves_svg(runs: &[Named<Vec<LearningRow>>]) -> Result<String, DrawError> {
    let last = runs.iter().flat_map(|run| &run.what).map(|row| row.iteration).max().unwrap_or(1);
    let iterations = 0.0..f64::from(last.max(1));
    let most = runs.iter().flat_map(|run| &run.what).map(|row| row.anchors).max().unwrap_or(1);
    chart::figure(2, |panels| {
        let labels = Labels {
            title: "PSNR of the training views (thin: as recorded, thick: means over 15 rows)",
            x: "iteration",
            y: "PSNR, dB",
            x_tick: &|x| chart::thousands(*x),
            y_tick: &|y| format!("{y:.0}"),
        };
        let all = runs.iter().flat_map(|run| points(&run.what)).map(|(_, psnr_db)| psnr_db);
        let mut chart = chart::axes(&panels[0], iterations.clone(), chart::padded(all), &labels)?;
        for (i, run) in runs.iter().enumerate() {
            let (recorded, colour) = (points(&run.what), chart::colour(i));
            chart.draw_series(LineSeries::new(recorded.clone(), colour.mix(0.25)))?;
            chart
                .draw_series(LineSeries::new(means(&recorded), colour.stroke_width(2)))?
                .label(run.name.as_str())
                .legend(chart::line_sign(colour));
        }
        chart::legend(&mut chart)?;

        let labels = Labels { title: "Size of the model", y: "anchors", y_tick: &|y| chart::thousands(*y), ..labels };
        let mut chart = chart::axes(&panels[1], iterations, 0.0..1.05 * most.max(1) as f64, &labels)?;
        for (i, run) in runs.iter().enumerate() {
            let anchors = run.what.iter().map(|row| (f64::from(row.iteration), row.anchors as f64));
            chart.draw_series(LineSeries::new(anchors, chart::colour(i).stroke_width(2)))?;
        }
        Ok(())
    })
}

/// (iteration, PSNR) of the rows that have one.
fn points(rows: &[LearningRow]) -> Vec<(f64, f64)> {
    rows.iter().filter_map(|row| Some((f64::from(row.iteration), row.psnr_db?))).collect()
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
        let row = |iteration, psnr_db| LearningRow { iteration, psnr_db, anchors: 10 };
        let run = |name: &str| Named {
            name: name.to_owned(),
            what: vec![row(5, Some(10.0)), row(10, None), row(15, Some(12.0))],
        };
        let svg = learning_curves_svg(&[run("first"), run("second")]).unwrap();
        for text in ["first", "second", "iteration", "PSNR, dB", "anchors"] {
            assert!(svg.contains(text), "{text}");
        }
        assert!(learning_curves_svg(&[]).is_ok(), "an empty figure is a figure");
    }
}
