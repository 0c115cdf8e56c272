//! What accuracy costs in time, as a figure.

use plotters::prelude::*;

use super::chart::{self, DrawError, Labels};

/// One way to draw a bundle.
#[derive(Clone, Debug, PartialEq)]
pub struct TimePoint {
    /// What was changed; points of one knob share a colour.
    pub knob: String,
    /// How far.
    pub name: String,
    /// Instructions of a frame.
    pub instructions: f64,
    /// PSNR to the photographs, dB.
    pub psnr_db: f64,
    /// Whether nothing beats it.
    pub on_front: bool,
}

/// PSNR over instructions of a frame, a colour for each knob and a line along the Pareto front, as an SVG.
///
/// # Errors
/// [`DrawError`] when the drawing library fails.
pub fn time_accuracy_svg(points: &[TimePoint]) -> Result<String, DrawError> {
    let millions = |point: &TimePoint| point.instructions / 1e6;
    let mut knobs: Vec<&str> = Vec::new();
    for point in points {
        if !knobs.contains(&point.knob.as_str()) {
            knobs.push(&point.knob);
        }
    }
    chart::figure(1, |panels| {
        let psnr_db = chart::padded(points.iter().map(|point| point.psnr_db));
        let digits = chart::decimals(&psnr_db);
        let most = points.iter().map(millions).fold(1e-6, f64::max);
        let labels = Labels {
            title: "Quality over time",
            x: "instructions of a frame, millions",
            y: "PSNR, dB",
            x_tick: &|x| format!("{x:.0}"),
            y_tick: &|y| format!("{y:.digits$}"),
        };
        let mut chart = chart::axes(&panels[0], 0.0..1.1 * most, psnr_db, &labels)?;
        let mut front: Vec<(f64, f64)> =
            points.iter().filter(|point| point.on_front).map(|point| (millions(point), point.psnr_db)).collect();
        front.sort_by(|a, b| a.0.total_cmp(&b.0));
        chart.draw_series(LineSeries::new(front, BLACK.mix(0.5).stroke_width(1)))?;
        for (i, knob) in knobs.iter().enumerate() {
            let colour = chart::colour(i);
            let of_knob = points.iter().filter(|point| point.knob == *knob);
            chart
                .draw_series(of_knob.map(|point| Circle::new((millions(point), point.psnr_db), 4, colour.filled())))?
                .label(*knob)
                .legend(chart::line_sign(colour));
        }
        chart::legend(&mut chart)
    })
}

#[cfg(test)]
mod tests {
    use super::{TimePoint, time_accuracy_svg};

    #[test]
    fn every_knob_is_named() {
        let point = |knob: &str, instructions, psnr_db| TimePoint {
            knob: knob.to_owned(),
            name: String::new(),
            instructions,
            psnr_db,
            on_front: psnr_db > 29.0,
        };
        let points = [point("none", 5e7, 30.0), point("alpha cut", 4e7, 29.5), point("alpha cut", 3e7, 28.0)];
        let svg = time_accuracy_svg(&points).unwrap();
        for text in ["none", "alpha cut", "instructions of a frame, millions", "PSNR, dB"] {
            assert!(svg.contains(text), "{text}");
        }
        assert!(time_accuracy_svg(&[]).is_ok(), "an empty figure is a figure");
    }
}
