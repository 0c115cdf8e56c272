//! What accuracy costs, in time or bytes, as a figure.

use anyhow::Result;
use plotters::prelude::*;

use super::chart::{self, Labels, Panel};

/// One way to train or draw a scene.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CostPoint {
    /// What was changed; points of one knob share a colour.
    pub knob: String,
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

/// PSNR over cost, a panel for each kind of it, a colour for each knob and a line along the Pareto front, as an SVG.
pub(crate) fn cost_svg(panels: &[CostPanel]) -> Result<String> {
    let mut knobs: Vec<&str> = Vec::new();
    for point in panels.iter().flat_map(|panel| &panel.points) {
        if !knobs.contains(&point.knob.as_str()) {
            knobs.push(&point.knob);
        }
    }
    chart::figure(panels.len(), |areas| {
        areas.iter().zip(panels).try_for_each(|(area, panel)| draw(area, panel, &knobs))
    })
}

fn draw(area: &Panel<'_>, panel: &CostPanel, knobs: &[&str]) -> Result<()> {
    let points = &panel.points;
    let psnr_db = chart::padded(points.iter().map(|point| point.psnr_db));
    let digits = chart::decimals(&psnr_db);
    let most = points.iter().map(|point| point.cost).fold(1e-6, f64::max);
    let labels = Labels {
        title: &panel.title,
        x: &panel.unit,
        y: "PSNR, dB",
        x_tick: &|x| format!("{x:.0}"),
        y_tick: &|y| format!("{y:.digits$}"),
    };
    let mut chart = chart::axes(area, 0.0..1.1 * most, psnr_db, &labels)?;
    let mut front: Vec<(f64, f64)> =
        points.iter().filter(|point| point.on_front).map(|point| (point.cost, point.psnr_db)).collect();
    front.sort_by(|a, b| a.0.total_cmp(&b.0));
    chart.draw_series(LineSeries::new(front, BLACK.mix(0.5).stroke_width(1)))?;
    for (i, knob) in knobs.iter().enumerate() {
        let colour = chart::colour(i);
        let of_knob = points.iter().filter(|point| point.knob == *knob);
        chart
            .draw_series(of_knob.map(|point| Circle::new((point.cost, point.psnr_db), 4, colour.filled())))?
            .label(*knob)
            .legend(chart::line_sign(colour));
    }
    chart::legend(&mut chart)
}

#[cfg(test)]
mod tests {
    use super::{CostPanel, CostPoint, cost_svg};

    #[test]
    fn every_kind_of_cost_and_every_knob_is_named() {
        let point =
            |knob: &str, cost, psnr_db| CostPoint { knob: knob.to_owned(), cost, psnr_db, on_front: psnr_db > 29.0 };
        let points = vec![point("none", 50.0, 30.0), point("alpha cut", 40.0, 29.5), point("alpha cut", 30.0, 28.0)];
        let panel = |title: &str, unit: &str| CostPanel {
            title: title.to_owned(),
            unit: unit.to_owned(),
            points: points.clone(),
        };
        let panels = [panel("cortex-m4", "millions of instructions"), panel("host", "milliseconds")];
        let svg = cost_svg(&panels).unwrap();
        for text in ["cortex-m4", "host", "none", "alpha cut", "millions of instructions", "milliseconds", "PSNR, dB"] {
            assert!(svg.contains(text), "{text}");
        }
        assert!(cost_svg(&[CostPanel { points: Vec::new(), ..panel("a", "b") }]).is_ok(), "an empty panel is one");
    }
}
