//! The box that encloses everything a chunk can draw.

use super::super::quantise::RowSlice;
use super::super::table::TableSet;

/// A splat of opacity 1 falls to 1/255 at √(2 ln 255) = 3.3290 deviations; the rest covers the decoder's rounding.
const INK_DEVIATIONS: f64 = 3.33;

/// Rounding of a float32 and then some, relative to the largest coordinate.
const ROUNDING: f64 = 1e-6;

/// Lowest and highest corner of the box, normalised frame.
///
/// Every offset of every anchor counts, with the ball of 3.33 times its largest base scale: the heads may open any of
/// them in some view, and sigmoid(·) < 1 only makes them smaller.
pub(super) fn ink_box(anchors: RowSlice<'_>, tables: &TableSet, voxel_size: f32) -> ([f32; 3], [f32; 3]) {
    let n_channels = tables.channel_tables.len();
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for (cell, row) in anchors.lattice.iter().zip(anchors.symbols.chunks_exact(n_channels)) {
        let value = |channel: usize| {
            let symbol = f64::from(row[channel]);
            symbol * f64::from(tables.of_channel(channel).step)
        };
        let n_offsets = tables.n_offsets;
        let first_offset = n_channels - 3 * n_offsets;
        let scale = |i: usize| value(first_offset - 6 + i).exp();
        let radius = INK_DEVIATIONS * scale(3).max(scale(4)).max(scale(5));
        for offset in 0..n_offsets {
            for axis in 0..3 {
                let anchor = f64::from(cell[axis]) * f64::from(voxel_size);
                let centre = anchor + value(first_offset + 3 * offset + axis) * scale(axis);
                low[axis] = low[axis].min(centre - radius);
                high[axis] = high[axis].max(centre + radius);
            }
        }
    }
    let largest = low.iter().chain(&high).fold(0.0_f64, |m, x| m.max(x.abs()));
    let slack = largest * ROUNDING;
    // Beyond f32 the box would be infinite, which the format refuses; such a scene draws nothing there anyway.
    let fit = |x: f64| x.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32;
    (low.map(|x| fit(x - slack)), high.map(|x| fit(x + slack)))
}
