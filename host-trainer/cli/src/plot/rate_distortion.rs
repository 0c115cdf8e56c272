//! Rate-distortion curves: what quality costs.

use anyhow::Result;
use plotters::coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter};
use plotters::prelude::*;

use super::chart::{self, Labels};
use super::{Named, ResultRow};

/// How sizes lie along the axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum SizeAxis {
    /// Evenly.
    #[default]
    Linear,
    /// By their ratios, for methods whose sizes differ many times.
    Logarithmic,
}

/// PSNR over size, a curve for each file and a point for each rate, as an SVG; the better the further up and left.
pub(crate) fn rate_distortion_svg(curves: &[Named<Vec<ResultRow>>], axis: SizeAxis) -> Result<String> {
    let sizes = || curves.iter().flat_map(|curve| &curve.what).map(megabytes);
    let (least, most) = (sizes().fold(f64::INFINITY, f64::min), sizes().fold(0.0, f64::max));
    match axis {
        SizeAxis::Linear => draw(curves, 0.0..1.1 * most.max(1e-6)),
        // Powers of two, so that there are marks between 1 MB and 10.
        SizeAxis::Logarithmic => {
            let (from, to) = if most > 0.0 { (least.max(1e-6) / 1.25, 1.25 * most) } else { (0.5, 2.0) };
            draw(curves, (from..to).log_scale().base(2.0))
        }
    }
}

fn draw<X>(curves: &[Named<Vec<ResultRow>>], sizes: X) -> Result<String>
where
    X: AsRangedCoord<Value = f64>,
    X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    chart::figure(1, |panels| {
        let all = curves.iter().flat_map(|curve| &curve.what).map(|row| row.psnr_db);
        let psnr_db = chart::padded(all);
        let digits = chart::decimals(&psnr_db);
        let labels = Labels {
            title: "Quality over size",
            x: "size, MB (10⁶ bytes)",
            y: "PSNR, dB",
            x_tick: &|x| significant(*x),
            y_tick: &|y| format!("{y:.digits$}"),
        };
        let mut chart = chart::axes(&panels[0], sizes, psnr_db, &labels)?;
        for (i, curve) in curves.iter().enumerate() {
            let colour = chart::colour(i);
            let mut rows: Vec<&ResultRow> = curve.what.iter().collect();
            rows.sort_by(|a, b| a.size_bytes.total_cmp(&b.size_bytes));
            let points: Vec<(f64, f64)> = rows.iter().map(|row| (megabytes(row), row.psnr_db)).collect();
            chart
                .draw_series(LineSeries::new(points.clone(), colour.stroke_width(2)))?
                .label(curve.name.as_str())
                .legend(chart::line_sign(colour));
            chart.draw_series(points.iter().map(|&point| Circle::new(point, 4, colour.filled())))?;
            let named = rows
                .iter()
                .zip(&points)
                .map(|(row, &point)| EmptyElement::at(point) + chart::note(i, row.submethod.clone()));
            chart.draw_series(named)?;
        }
        chart::legend(&mut chart)
    })
}

fn megabytes(row: &ResultRow) -> f64 {
    row.size_bytes / 1e6
}

/// At most three digits after the point, none of them an idle zero.
fn significant(value: f64) -> String {
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn idle_zeros_are_left_out() {
        assert_eq!([0.5, 0.125, 10.0, 0.0].map(significant), ["0.5", "0.125", "10", "0"]);
    }

    #[test]
    fn every_curve_and_every_rate_is_named_on_either_axis() {
        let row = |submethod: &str, size_bytes, psnr_db| ResultRow {
            submethod: submethod.to_owned(),
            psnr_db,
            ssim: None,
            lpips: None,
            size_bytes,
            n_gaussians: None,
        };
        let curve = |name: &str, factor| Named {
            name: name.to_owned(),
            what: vec![row("fine", 4e6 * factor, 33.0), row("coarse", 1e6 * factor, 31.0)],
        };
        for axis in [SizeAxis::Linear, SizeAxis::Logarithmic] {
            let svg = rate_distortion_svg(&[curve("ours", 1.0), curve("theirs", 1.5)], axis).unwrap();
            for text in ["ours", "theirs", "fine", "coarse", "size, MB (10⁶ bytes)", "PSNR, dB"] {
                assert!(svg.contains(text), "{text} {axis:?}");
            }
            assert!(rate_distortion_svg(&[], axis).is_ok(), "an empty figure is a figure");
            assert!(
                rate_distortion_svg(&[Named { name: String::new(), what: vec![row("alone", 1e6, 30.0)] }], axis)
                    .is_ok()
            );
        }
    }
}
