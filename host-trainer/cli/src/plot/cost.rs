//! What accuracy costs, in time or bytes, as a figure.

use anyhow::Result;
use plotters::coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter};
use plotters::prelude::*;

use super::chart::{self, Area, Labels, Sign};
use super::{marker, unique};

/// Costs that differ more than this many times get a logarithmic axis.
const WIDE: f64 = 5.0;
/// What lies so many spans of the front below it is shown by an arrow at the edge, so that the front is not squashed.
const SPANS_BELOW: f64 = 1.0;
/// The same, dB, where the front is flat.
const LEAST_BELOW_DB: f64 = 1.0;

/// One way to train or draw a scene.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CostPoint {
    /// What was changed; points of one parameter share a marker.
    pub parameter: String,
    /// What it was changed to.
    pub setting: String,
    /// What it costs, in the unit of its panel.
    pub cost: f64,
    /// PSNR to the photographs, dB.
    pub psnr_db: f64,
    /// Whether nothing beats it.
    pub on_front: bool,
}

/// One kind of cost.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CostPanel {
    /// What the panel shows.
    pub title: String,
    /// What cost is measured in.
    pub unit: String,
    /// The ways to draw.
    pub points: Vec<CostPoint>,
}

/// PSNR over cost, a panel for each kind of it, a marker for each parameter, and a line along the Pareto front with the names of its
/// points, as an SVG.
pub(crate) fn cost_svg(panels: &[CostPanel]) -> Result<String> {
    let parameters = unique(panels.iter().flat_map(|panel| &panel.points).map(|point| point.parameter.as_str()));
    chart::figure(panels.len(), |areas, figure| {
        areas.iter().zip(panels).try_for_each(|(area, panel)| {
            let (least, most) = extremes(panel.points.iter().map(|point| point.cost));
            if least > 0.0 && most > WIDE * least {
                draw(area, figure, panel, &parameters, (least / 1.15..1.15 * most).log_scale().base(2.0))
            } else {
                draw(area, figure, panel, &parameters, 0.0..1.1 * most.max(1e-6))
            }
        })
    })
}

fn extremes(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, 0.0), |(least, most), value| (f64::min(least, value), f64::max(most, value)))
}

/// The range of PSNR that shows the front: all points, unless some lie far below it.
fn shown(points: &[CostPoint]) -> std::ops::Range<f64> {
    let front = points.iter().filter(|point| point.on_front).map(|point| point.psnr_db);
    let (low, high) = front.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    let floor = low - (SPANS_BELOW * (high - low)).max(LEAST_BELOW_DB);
    chart::padded(points.iter().map(|point| point.psnr_db).filter(|psnr_db| !(*psnr_db < floor)))
}

fn draw<X>(panel_area: &Area<'_>, figure: &Area<'_>, panel: &CostPanel, parameters: &[&str], costs: X) -> Result<()>
where
    X: AsRangedCoord<Value = f64> + Clone,
    X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    let points = &panel.points;
    let psnr_db = shown(points);
    let (floor, digits) = (psnr_db.start, chart::decimals(&psnr_db));
    let labels = Labels {
        title: &panel.title,
        x: &panel.unit,
        y: "PSNR, dB",
        x_tick: &|x| if *x < 10.0 { format!("{x:.1}") } else { chart::thousands(*x) },
        y_tick: &|y| format!("{y:.digits$}"),
    };
    let (area, for_legend) = chart::with_legend(panel_area);
    let mut chart = chart::axes(&area, costs, psnr_db, &labels)?;
    let mut front: Vec<usize> = (0..points.len()).filter(|i| points[*i].on_front).collect();
    front.sort_by(|a, b| points[*a].cost.total_cmp(&points[*b].cost));
    let line = front.iter().map(|i| (points[*i].cost, points[*i].psnr_db));
    chart.draw_series(LineSeries::new(line, chart::FRONT.stroke_width(1)))?;
    let series = |point: &CostPoint| parameters.iter().position(|parameter| *parameter == point.parameter).unwrap_or(0);
    let at: Vec<(i32, i32)> =
        points.iter().map(|point| chart.backend_coord(&(point.cost, point.psnr_db.max(floor)))).collect();
    // Those of the front last, on top.
    let order = (0..points.len()).filter(|i| !points[*i].on_front).chain(front.iter().copied());
    for i in order {
        let below = points[i].psnr_db < floor;
        let draw = if below { marker::draw_below } else { marker::draw };
        draw(figure, series(&points[i]), at[i])?;
    }
    let names: Vec<_> = front.iter().map(|i| (*i, series(&points[*i]), points[*i].setting.clone())).collect();
    chart::name_points(figure, &chart, &at, &names)?;
    let below = points.iter().any(|point| point.psnr_db < floor);
    let notes = [(true, "none is better and cheaper"), (below, "↓ lies below the chart")];
    let notes = notes.into_iter().filter(|(is_shown, _)| *is_shown).map(|(_, note)| (Sign::Front, note));
    let entries = parameters.iter().enumerate().map(|(i, parameter)| (Sign::Marker(i), *parameter));
    chart::legend(&for_legend, entries.chain(notes))
}

#[cfg(test)]
mod tests {
    use super::{CostPanel, CostPoint, cost_svg};

    #[test]
    fn every_kind_of_cost_and_every_parameter_is_named() {
        let point = |parameter: &str, cost, psnr_db| CostPoint {
            parameter: parameter.to_owned(),
            setting: format!("{parameter} so"),
            cost,
            psnr_db,
            on_front: psnr_db > 29.0,
        };
        let points = vec![point("none", 50.0, 30.0), point("alpha cut", 40.0, 29.5), point("alpha cut", 30.0, 28.9)];
        let panel = |title: &str, unit: &str| CostPanel {
            title: title.to_owned(),
            unit: unit.to_owned(),
            points: points.clone(),
        };
        let panels = [panel("cortex-m4", "millions of instructions"), panel("host", "milliseconds")];
        let svg = cost_svg(&panels).unwrap();
        for text in [
            "cortex-m4",
            "host",
            "alpha cut so",
            "none",
            "alpha cut",
            "millions of instructions",
            "milliseconds",
            "PSNR, dB",
        ] {
            assert!(svg.contains(text), "{text}");
        }
        assert!(!svg.contains("lies below"));
        let mut outlying = panel("a", "b");
        outlying.points.push(point("pruning", 500.0, 12.0));
        let svg = cost_svg(&[outlying]).unwrap();
        assert!(svg.contains("lies below") && !svg.contains(">15<"), "the front keeps its room");
        assert!(cost_svg(&[CostPanel { points: Vec::new(), ..panel("a", "b") }]).is_ok(), "an empty panel is one");
    }

    #[test]
    fn a_cost_without_end_is_refused_on_either_axis() {
        let point = |cost, psnr_db| CostPoint {
            parameter: "level".to_owned(),
            setting: "exact".to_owned(),
            cost,
            psnr_db,
            on_front: true,
        };
        // Of these, the first is drawn logarithmically.
        for points in [
            vec![point(1.0, 30.0), point(f64::INFINITY, 31.0)],
            vec![point(f64::INFINITY, 30.0)],
            vec![point(-1e308, -1e308), point(1.0, 1e308)],
        ] {
            let (title, unit) = ("host".to_owned(), "milliseconds".to_owned());
            let said = cost_svg(&[CostPanel { title, unit, points }]).unwrap_err().to_string();
            assert!(said.contains("the axis `"), "{said}");
        }
    }
}
