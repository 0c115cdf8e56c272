//! How the photographs of a run were exposed, one after the other.

use anyhow::Result;
use plotters::prelude::*;

use super::chart::{self, Labels};

/// Colours of the channels.
const CHANNELS: [RGBColor; 3] = [RGBColor(200, 40, 40), RGBColor(40, 140, 60), RGBColor(50, 80, 200)];

/// Curves over the photographs, for a page.
///
/// * `stops`: of red, green and blue light, `[photographs]`.
pub(crate) fn exposures_svg(stops: &[[f64; 3]]) -> Result<String> {
    chart::figure_of(chart::PAGE_PX, 1, |panels, _| {
        let values = chart::padded(stops.iter().flatten().copied());
        let digits = chart::decimals(&values).max(1);
        let labels = Labels {
            title: "Exposure of each photograph, red, green and blue",
            x: "photograph",
            y: "stops",
            x_tick: &|x| chart::thousands(*x),
            y_tick: &|y| format!("{y:+.digits$}"),
        };
        let last = stops.len().saturating_sub(1).max(1);
        let mut chart = chart::axes(&panels[0], 0.0..last as f64, values, &labels)?;
        for (channel, colour) in CHANNELS.iter().enumerate() {
            let line = stops.iter().enumerate().map(|(i, stops)| (i as f64, stops[channel]));
            chart.draw_series(LineSeries::new(line, colour.stroke_width(2)))?;
        }
        Ok(())
    })
}
