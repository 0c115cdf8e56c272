//! Colours, and points that can be told apart without them.

use anyhow::Result;
use plotters::prelude::*;

/// Half the size of a marker, pixels.
const HALF_PX: i32 = 5;
const N_SHAPES: usize = 5;

/// Colours that people who see colours differently can tell apart (Okabe and Ito 2008), the darker ones first.
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
];

/// The colour of the `i`-th curve; they come round after seven.
pub(super) fn colour(i: usize) -> RGBColor {
    COLOURS[i % COLOURS.len()]
}

/// A part of a figure, or all of it; drawn on in pixels.
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

/// Draws the marker of the `i`-th series: circle, square, triangle, diamond, triangle on its tip, in the colour of the series.
pub(super) fn draw(on: &Area<'_>, i: usize, (x, y): (i32, i32)) -> Result<()> {
    let (h, style) = (HALF_PX, colour(i).filled());
    let corners: &[(i32, i32)] = match i % N_SHAPES {
        0 => return Ok(on.draw(&Circle::new((x, y), h - 1, style))?),
        1 => &[(-h + 1, -h + 1), (h - 1, -h + 1), (h - 1, h - 1), (-h + 1, h - 1)],
        2 => &[(0, -h), (h, h - 1), (-h, h - 1)],
        3 => &[(0, -h - 1), (h + 1, 0), (0, h + 1), (-h - 1, 0)],
        _ => &[(0, h), (h, -h + 1), (-h, -h + 1)],
    };
    let corners: Vec<(i32, i32)> = corners.iter().map(|(dx, dy)| (x + dx, y + dy)).collect();
    Ok(on.draw(&Polygon::new(corners, style))?)
}

/// Draws an arrow down in the colour of the `i`-th series: what is meant lies below the chart.
pub(super) fn draw_below(on: &Area<'_>, i: usize, (x, y): (i32, i32)) -> Result<()> {
    let style = colour(i).stroke_width(1);
    on.draw(&PathElement::new(vec![(x, y - 9), (x, y)], style))?;
    Ok(on.draw(&PathElement::new(vec![(x - 3, y - 4), (x, y), (x + 3, y - 4)], style))?)
}
