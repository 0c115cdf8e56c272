//! Rate-distortion curves: what quality costs.

use anyhow::Result;
use plotters::coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter};
use plotters::prelude::*;

use super::chart::{self, Labels, Sign};
use super::{Named, ResultRow, gathered, marker};

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
///
/// Rows of one curve with the same name are seeds: they become one point at their mean, with lines from the least to the most.
pub(crate) fn rate_distortion_svg(curves: &[Named<Vec<ResultRow>>], axis: SizeAxis) -> Result<String> {
    let sizes = || curves.iter().flat_map(|curve| &curve.what).map(megabytes);
    let (least, most) = (sizes().fold(f64::INFINITY, f64::min), sizes().fold(0.0, f64::max));
    match axis {
        SizeAxis::Linear => draw(curves, 0.0..1.1 * most.max(1e-6)),
        // Powers of two, so that there are marks between 1 MB and 10.
        SizeAxis::Logarithmic => {
            let (from, to) = if most > 0.0 { (least.max(1e-6) / 1.25, 1.25 * most.max(1e-6)) } else { (0.5, 2.0) };
            draw(curves, (from..to).log_scale().base(2.0))
        }
    }
}

fn draw<X>(curves: &[Named<Vec<ResultRow>>], sizes: X) -> Result<String>
where
    X: AsRangedCoord<Value = f64> + Clone,
    X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    chart::figure(1, |panels, figure| {
        let curves: Vec<(&str, Vec<Point>)> =
            curves.iter().map(|curve| (curve.name.as_str(), points(&curve.what))).collect();
        let all = || curves.iter().flat_map(|(_, points)| points);
        let psnr_db = chart::padded(all().flat_map(|point| point.psnr_db));
        let digits = chart::decimals(&psnr_db);
        let labels = Labels {
            title: "Quality over size",
            x: "size, MB (10⁶ bytes)",
            y: "PSNR, dB",
            x_tick: &|x| significant(*x),
            y_tick: &|y| format!("{y:.digits$}"),
        };
        let (area, for_legend) = chart::with_legend(&panels[0]);
        let mut chart = chart::axes(&area, sizes, psnr_db, &labels)?;
        for (i, (_, points)) in curves.iter().enumerate() {
            let line = points.iter().map(|point| (point.megabytes[1], point.psnr_db[1]));
            chart.draw_series(LineSeries::new(line, chart::colour(i).stroke_width(2)))?;
            for Point { megabytes: [from, x, to], psnr_db: [low, y, high], .. } in points {
                for (start, end) in [((*from, *y), (*to, *y)), ((*x, *low), (*x, *high))] {
                    let ends = [chart.backend_coord(&start), chart.backend_coord(&end)];
                    figure.draw(&PathElement::new(ends.to_vec(), chart::colour(i).stroke_width(1)))?;
                }
            }
        }
        let mut at = Vec::new();
        let mut names = Vec::new();
        for (i, (_, points)) in curves.iter().enumerate() {
            for point in points {
                let place = chart.backend_coord(&(point.megabytes[1], point.psnr_db[1]));
                marker::draw(figure, i, place)?;
                names.push((at.len(), i, point.name.replace("lambda=", "λ ")));
                at.push(place);
            }
        }
        chart::name_points(figure, &chart, &at, &names)?;
        let entries = curves.iter().enumerate().map(|(i, (name, _))| (Sign::Marker(i), *name));
        let has_seeds = all().any(|point| point.n_seeds > 1);
        let note = has_seeds.then_some((Sign::Front, "lines: range over seeds"));
        chart::legend(&for_legend, entries.chain(note))
    })
}

/// Rows of one name, which are one rate from several seeds: least, mean and most.
struct Point<'a> {
    name: &'a str,
    n_seeds: usize,
    megabytes: [f64; 3],
    psnr_db: [f64; 3],
}

fn points(rows: &[ResultRow]) -> Vec<Point<'_>> {
    let point = |seeds: &[&ResultRow], name| {
        let spread = |value: fn(&ResultRow) -> f64| {
            let values = || seeds.iter().map(|row| value(row));
            [
                values().fold(f64::INFINITY, f64::min),
                values().sum::<f64>() / seeds.len() as f64,
                values().fold(f64::NEG_INFINITY, f64::max),
            ]
        };
        Point { name, n_seeds: seeds.len(), megabytes: spread(megabytes), psnr_db: spread(|row| row.psnr_db) }
    };
    let rates = gathered(rows.iter().map(|row| (row.submethod.clone(), row)));
    let mut points: Vec<Point<'_>> =
        rates.iter().map(|rate| point(&rate.what, rate.what[0].submethod.as_str())).collect();
    points.sort_by(|a, b| a.megabytes[1].total_cmp(&b.megabytes[1]));
    points
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
    fn rows_of_one_name_are_one_point_with_its_spread() {
        let rows = [ResultRow::of("b", 4e6, 33.0), ResultRow::of("a", 1e6, 30.0), ResultRow::of("a", 3e6, 32.0)];
        let points = points(&rows);
        let found: Vec<_> =
            points.iter().map(|point| (point.name, point.n_seeds, point.megabytes, point.psnr_db)).collect();
        assert_eq!(found, [("a", 2, [1.0, 2.0, 3.0], [30.0, 31.0, 32.0]), ("b", 1, [4.0; 3], [33.0; 3])]);
    }

    #[test]
    fn idle_zeros_are_left_out() {
        assert_eq!([0.5, 0.125, 10.0, 0.0].map(significant), ["0.5", "0.125", "10", "0"]);
    }

    #[test]
    fn a_size_without_end_is_refused_on_either_axis() {
        let curve = |size_bytes| Named { name: "ours".to_owned(), what: vec![ResultRow::of("rate", size_bytes, 30.0)] };
        for axis in [SizeAxis::Linear, SizeAxis::Logarithmic] {
            for curves in [vec![curve(f64::INFINITY)], vec![curve(1e6), curve(f64::INFINITY)]] {
                let said = rate_distortion_svg(&curves, axis).unwrap_err().to_string();
                assert!(said.contains("the axis `size, MB"), "{axis:?}: {said}");
            }
            assert!(rate_distortion_svg(&[curve(0.5)], axis).is_ok(), "less than a byte");
        }
    }

    #[test]
    fn every_curve_and_every_rate_is_named_on_either_axis() {
        let curve = |name: &str, factor| Named {
            name: name.to_owned(),
            what: vec![ResultRow::of("fine", 4e6 * factor, 33.0), ResultRow::of("coarse", 1e6 * factor, 31.0)],
        };
        for axis in [SizeAxis::Linear, SizeAxis::Logarithmic] {
            let svg = rate_distortion_svg(&[curve("ours", 1.0), curve("theirs", 1.5)], axis).unwrap();
            for text in ["ours", "theirs", "fine", "coarse", "size, MB (10⁶ bytes)", "PSNR, dB"] {
                assert!(svg.contains(text), "{text} {axis:?}");
            }
            assert!(rate_distortion_svg(&[], axis).is_ok(), "an empty figure is a figure");
            assert!(
                rate_distortion_svg(
                    &[Named { name: String::new(), what: vec![ResultRow::of("alone", 1e6, 30.0)] }],
                    axis
                )
                .is_ok()
            );
        }
    }
}
