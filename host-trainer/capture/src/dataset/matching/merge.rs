//! One point for a place that several photographs found.

use glam::DVec3;

use crate::dataset::points::ColouredPoint;

/// Points within a cell of so many pixels' width are one.
pub(in crate::dataset) const CELL_PX: f64 = 4.0;

/// The mean of the points in each cell, in the cells' order. A cell is as wide as four pixels at the distance of its points, to a power of
/// two.
///
/// * `found`: points, each with the width of a pixel there.
pub(in crate::dataset) fn merged(found: &[(ColouredPoint, f64)]) -> Vec<ColouredPoint> {
    let cell = |(point, pixel_width): &(ColouredPoint, f64)| {
        let octave = (CELL_PX * pixel_width).log2().round();
        #[expect(clippy::cast_possible_truncation, reason = "an octave of f64, and cells no smaller than a pixel")]
        let key = (octave as i32, (point.at / octave.exp2()).floor().to_array().map(|coordinate| coordinate as i64));
        (key, *point)
    };
    let mut by_cell: Vec<_> = found.iter().map(cell).collect();
    by_cell.sort_by_key(|(cell, _)| *cell);
    let mean = |of_cell: &[(_, ColouredPoint)]| {
        let n = of_cell.len();
        let channel = |c: usize| of_cell.iter().map(|(_, point)| usize::from(point.rgb[c])).sum::<usize>() / n;
        ColouredPoint {
            at: of_cell.iter().map(|(_, point)| point.at).sum::<DVec3>() / n as f64,
            rgb: [0, 1, 2].map(|c| u8::try_from(channel(c)).unwrap_or(u8::MAX)),
        }
    };
    by_cell.chunk_by(|a, b| a.0 == b.0).map(mean).collect()
}
