//! What all charts share: sizes, axes, legend, names of points.

use anyhow::{Result, bail};
use plotters::chart::ChartContext;
use plotters::coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

pub(super) use super::marker::{Area, colour};
use super::{labels, marker};

/// Width of a figure and height of a panel, pixels of the SVG, which scales.
pub(super) const WIDTH_PX: u32 = 900;
pub(super) const PANEL_PX: u32 = 420;
/// The same of a figure in a page: narrow, so that its words are words on a phone.
pub(super) const PAGE_PX: [u32; 2] = [420, 280];

const FONT: &str = "sans-serif";
const TEXT_PX: u32 = 15;
const NOTE_PX: u32 = labels::LABEL_PX as u32;
/// Width of the legend, and of one of its lines.
const LEGEND_PX: u32 = 210;
const LEGEND_LINE_PX: i32 = 20;
const TITLE_PX: u32 = 18;
const INK: RGBColor = RGBColor(51, 51, 51);
/// Of lines that are no series.
pub(super) const FRONT: RGBColor = RGBColor(120, 120, 120);
const GRID: RGBColor = RGBColor(225, 225, 225);

/// A chart under construction.
pub(super) type Chart<'a, 'b, X> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<X, RangedCoordf64>>;

/// What a chart says about itself.
pub(super) struct Labels<'a> {
    pub(super) title: &'a str,
    pub(super) x: &'a str,
    pub(super) y: &'a str,
    pub(super) x_tick: &'a dyn Fn(&f64) -> String,
    pub(super) y_tick: &'a dyn Fn(&f64) -> String,
}

/// Draws `n_panels` panels, one below the other, into an SVG; `draw` gets them and the whole figure.
pub(super) fn figure(n_panels: usize, draw: impl FnOnce(&[Area<'_>], &Area<'_>) -> Result<()>) -> Result<String> {
    figure_of([WIDTH_PX, PANEL_PX], n_panels, draw)
}

/// The same, with panels of another size.
pub(super) fn figure_of(
    [width_px, panel_px]: [u32; 2],
    n_panels: usize,
    draw: impl FnOnce(&[Area<'_>], &Area<'_>) -> Result<()>,
) -> Result<String> {
    let mut svg = String::new();
    let height_px = panel_px * u32::try_from(n_panels).unwrap_or(1);
    let root = SVGBackend::with_string(&mut svg, (width_px, height_px)).into_drawing_area();
    root.fill(&WHITE)?;
    draw(&root.split_evenly((n_panels, 1)), &root)?;
    root.present()?;
    drop(root);
    Ok(svg)
}

/// The left part of a panel, for its chart, and the right part, for the legend.
pub(super) fn with_legend<'a>(panel: &Area<'a>) -> (Area<'a>, Area<'a>) {
    panel.split_horizontally(WIDTH_PX - LEGEND_PX)
}

/// The ends of an axis lie apart by more than this share of the larger one: closer ones have no marks between them that can be told apart.
const LEAST_SHARE: f64 = 1e-9;

/// Refuses an axis on which no marks can be set: what sets them would never come to its end.
fn check_axis(name: &str, range: &std::ops::Range<f64>) -> Result<()> {
    let (width, largest) = ((range.end - range.start).abs(), range.start.abs().max(range.end.abs()));
    // The last is for logarithmic axes: the marks of one that begins and ends at 0 stay there, whatever they are multiplied by.
    if width.is_finite() && width > LEAST_SHARE * largest && width >= f64::MIN_POSITIVE {
        return Ok(());
    }
    bail!(
        "the axis `{name}` would reach from {:?} to {:?}, needed: finite ends that lie apart by more than a billionth of the larger; \
         correct the numbers that are drawn",
        range.start,
        range.end
    )
}

/// A chart with axes, ready for its curves.
pub(super) fn axes<'a, 'b, X>(
    area: &'a Area<'b>,
    x: X,
    y: std::ops::Range<f64>,
    labels: &Labels<'_>,
) -> Result<Chart<'a, 'b, X::CoordDescType>>
where
    X: AsRangedCoord<Value = f64> + Clone,
    X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    let along_x: X::CoordDescType = x.clone().into();
    check_axis(labels.x, &along_x.range())?;
    check_axis(labels.y, &y)?;
    let mut chart = ChartBuilder::on(area)
        .caption(labels.title, (FONT, TITLE_PX).into_font().color(&INK))
        .margin(12)
        // The last mark of the x axis is written around its end.
        .margin_right(36)
        .x_label_area_size(50)
        .y_label_area_size(64)
        .build_cartesian_2d(x, y)?;
    chart
        .configure_mesh()
        .x_desc(labels.x)
        .y_desc(labels.y)
        .x_labels(8)
        .y_labels(8)
        .x_label_formatter(&labels.x_tick)
        .y_label_formatter(&labels.y_tick)
        .axis_style(INK)
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .label_style((FONT, TEXT_PX).into_font().color(&INK))
        .axis_desc_style((FONT, TEXT_PX).into_font().color(&INK))
        .draw()?;
    Ok(chart)
}

/// What a line of a legend shows before its name.
#[derive(Clone, Copy, Debug)]
pub(super) enum Sign {
    /// The line of the `i`-th series.
    Line(usize),
    /// Its marker.
    Marker(usize),
    /// A thin line that is no series.
    Front,
}

/// Draws a legend, one line each; where there is no room for all, the last line says how many it leaves out.
pub(super) fn legend<'n>(area: &Area<'_>, entries: impl IntoIterator<Item = (Sign, &'n str)>) -> Result<()> {
    let most = ((PANEL_PX as i32 - 60) / LEGEND_LINE_PX) as usize;
    let mut entries: Vec<_> = entries.into_iter().collect();
    let y_of = |row: usize| 44 + row as i32 * LEGEND_LINE_PX;
    if entries.len() > most {
        let n_left_out = entries.len() - (most - 1);
        entries.truncate(most - 1);
        area.draw(&Text::new(
            format!("and {n_left_out} more"),
            (24, y_of(most - 1) - NOTE_PX as i32 / 2),
            note_style(&INK),
        ))?;
    }
    for (row, (sign, name)) in entries.into_iter().enumerate() {
        let y = y_of(row);
        let line = |style: ShapeStyle| PathElement::new(vec![(0, y), (18, y)], style);
        match sign {
            Sign::Line(i) => area.draw(&line(colour(i).stroke_width(2)))?,
            Sign::Marker(i) => marker::draw(area, i, (9, y))?,
            Sign::Front => area.draw(&line(FRONT.stroke_width(1)))?,
        }
        area.draw(&Text::new(shortened(name, 28), (24, y - NOTE_PX as i32 / 2), note_style(&INK)))?;
    }
    Ok(())
}

fn note_style(colour: &RGBColor) -> TextStyle<'static> {
    (FONT, NOTE_PX).into_font().color(colour)
}

fn shortened(name: &str, most: usize) -> String {
    let n = name.chars().count();
    if n <= most { name.to_owned() } else { name.chars().take(most - 1).chain(['…']).collect() }
}

/// Writes names beside points, the first ones first, where they cover nothing; those without room are left out.
///
/// * `points`: all points of the chart, pixels of the figure. * `names`: index of the point, its series, the name.
pub(super) fn name_points<'a, 'b: 'a, X: Ranged<ValueType = f64>>(
    figure: &Area<'_>,
    chart: &Chart<'a, 'b, X>,
    points: &[(i32, i32)],
    names: &[(usize, usize, String)],
) -> Result<()> {
    let (x, y) = chart.plotting_area().get_pixel_range();
    let labels: Vec<(usize, &str)> = names.iter().map(|(index, _, name)| (*index, name.as_str())).collect();
    let places = labels::placed(points, &labels, [x.start, y.start, x.end, y.end]);
    for ((index, series, name), place) in names.iter().zip(places) {
        if let Some((dx, dy)) = place {
            let (x, y) = points[*index];
            figure.draw(&Text::new(name.clone(), (x + dx, y + dy), note_style(&colour(*series))))?;
        }
    }
    Ok(())
}

/// The smallest range with all `values`, widened by a twentieth at both ends; around a single value, or several that are almost one, by 1
/// or a thousandth of it.
pub(super) fn padded(values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    let largest = low.abs().max(high.abs());
    let pad = if high - low > LEAST_SHARE * largest { 0.05 * (high - low) } else { f64::max(1.0, 1e-3 * largest) };
    if low.is_finite() && high.is_finite() { low - pad..high + pad } else { 0.0..1.0 }
}

/// The range from 0 to a twentieth above the largest of `values`.
pub(super) fn from_zero(values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
    let high = values.fold(0.0, f64::max);
    0.0..if high > 0.0 { 1.05 * high } else { 1.0 }
}

/// The digits after the point that tell the marks of an axis over `range` apart.
pub(super) fn decimals(range: &std::ops::Range<f64>) -> usize {
    // Eight marks, about.
    let step = (range.end - range.start) / 8.0;
    (0..9).find(|&digits| step * 10f64.powi(digits) >= 1.0).map_or(9, |digits| digits as usize)
}

/// A whole number with its thousands apart.
pub(crate) fn thousands(value: f64) -> String {
    let digits = format!("{:.0}", value.abs());
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i) % 3 == 0 {
            text.push(',');
        }
        text.push(digit);
    }
    if value <= -0.5 { format!("-{text}") } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_stand_apart() {
        let texts = [0.0, 999.0, 1000.0, 1_234_567.0, -12_000.0].map(thousands);
        assert_eq!(texts, ["0", "999", "1,000", "1,234,567", "-12,000"]);
    }

    #[test]
    fn marks_have_the_digits_that_tell_them_apart() {
        assert_eq!([0.0..80.0, 30.0..35.0, 12.6..12.601].map(|range| decimals(&range)), [0, 1, 4]);
    }

    #[test]
    fn an_axis_that_no_marks_fit_is_refused_by_its_name() {
        let without_end = [0.0..f64::INFINITY, f64::NEG_INFINITY..0.0, f64::NAN..1.0, -1e308..1e308];
        for range in without_end.into_iter().chain([5.0..5.0, 1.0..1.0 + 1e-12, 0.0..1e-310]) {
            let said = check_axis("PSNR, dB", &range).unwrap_err().to_string();
            assert!(said.contains("`PSNR, dB`") && said.contains("needed: finite ends"), "{range:?}: {said}");
        }
        for range in [0.0..1.0, 30.0..30.1, 1e300..2e300, 2.0..-1.0, padded([30.0, 30.0 + 4e-15].into_iter())] {
            check_axis("size", &range).unwrap();
        }
    }

    #[test]
    fn a_range_is_never_empty() {
        assert_eq!(padded([1.0, 3.0].into_iter()), 0.9..3.1);
        assert_eq!(padded([2.0].into_iter()), 1.0..3.0);
        assert_eq!(padded(std::iter::empty()), 0.0..1.0);
        assert_eq!(padded([2.0, 2.0 + 1e-15].into_iter()), 1.0..3.0 + 1e-15, "values that are almost one");
        let huge = padded([1e300].into_iter());
        assert!(huge.start < 1e300 && huge.end > 1e300, "where 1 is nothing: {huge:?}");
        assert_eq!((from_zero([2.0].into_iter()), from_zero(std::iter::empty())), (0.0..2.1, 0.0..1.0));
    }
}
