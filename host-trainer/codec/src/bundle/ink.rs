//! The boxes that enclose everything a chunk can draw, in 16 bits a coordinate.

use std::ops::Range;

use pocketsplat_format::bundle::InkFrame;
use pocketsplat_format::rules::INK_DEVIATIONS;

use super::quantise::SymbolRows;
use pocketsplat_kernels::scene::ModelShape;

/// Rounding of a float32 and then some, relative to the largest coordinate.
const ROUNDING: f64 = 1e-6;
/// Largest magnitude of a coordinate: the sums of the format stay finite. Such a scene draws nothing out there anyway.
const MAX_COORDINATE: f64 = f32::MAX as f64 / 4.0;

/// Lowest and highest corner of a box, normalised frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct InkBox {
    low: [f64; 3],
    high: [f64; 3],
}

impl InkBox {
    /// The box of a run of anchors.
    ///
    /// Every drawn offset counts, with the ball of 3.33 times its anchor's largest base scale: the heads may open any of
    /// them in some view, and sigmoid(·) < 1 only makes them smaller.
    pub(super) fn of(rows: &SymbolRows, anchors: Range<usize>, shape: &ModelShape, voxel_size: f32) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for anchor in anchors {
            let (row, [_, log_scale_step, offset_step]) = (rows.symbols_of(anchor), rows.steps[anchor]);
            let (log_scales, offsets) = row[shape.feature_dim..].split_at(shape.n_log_scales());
            let scale = |i: usize| (f64::from(log_scales[i]) * f64::from(log_scale_step)).exp();
            let radius = INK_DEVIATIONS * (3..log_scales.len()).map(scale).fold(0.0, f64::max);
            let drawn = (0..shape.n_offsets).filter(|k| (rows.drawn[anchor] >> k) & 1 == 1);
            for offset in drawn.map(|k| &offsets[3 * k..][..3]) {
                for axis in 0..3 {
                    let position = f64::from(rows.lattice[anchor][axis]) * f64::from(voxel_size);
                    let centre = position + f64::from(offset[axis]) * f64::from(offset_step) * scale(axis);
                    low[axis] = low[axis].min(centre - radius);
                    high[axis] = high[axis].max(centre + radius);
                }
            }
        }
        let slack = ROUNDING * low.iter().chain(&high).fold(0.0_f64, |m, x| m.max(x.abs()));
        let fit = |x: f64| x.clamp(-MAX_COORDINATE, MAX_COORDINATE);
        Self { low: low.map(|x| fit(x - slack)), high: high.map(|x| fit(x + slack)) }
    }
}

/// The finest frame that reaches around all of `boxes`.
pub(super) fn frame_around(boxes: &[InkBox]) -> InkFrame {
    let mut frame = InkFrame { min: [0.0; 3], step: [0.0; 3] };
    if boxes.is_empty() {
        return frame;
    }
    for axis in 0..3 {
        let low = boxes.iter().map(|b| b.low[axis]).fold(f64::INFINITY, f64::min);
        let high = boxes.iter().map(|b| b.high[axis]).fold(f64::NEG_INFINITY, f64::max);
        frame.min[axis] = not_above(low);
        frame.step[axis] = ((high - f64::from(frame.min[axis])) / f64::from(u16::MAX)) as f32;
        while coordinate(&frame, axis, u16::MAX) < high {
            frame.step[axis] = frame.step[axis].next_up();
        }
    }
    frame
}

/// The corners of the smallest box of `frame` around `ink`.
pub(super) fn quantised(ink: &InkBox, frame: &InkFrame) -> [[u16; 3]; 2] {
    let steps = |axis: usize, x: f64| {
        let steps = (x - f64::from(frame.min[axis])) / f64::from(frame.step[axis]);
        // NaN, of a frame without extent, becomes 0.
        steps.clamp(0.0, f64::from(u16::MAX))
    };
    let low = std::array::from_fn(|axis| {
        let mut q = steps(axis, ink.low[axis]).floor() as u16;
        while q > 0 && coordinate(frame, axis, q) > ink.low[axis] {
            q -= 1;
        }
        q
    });
    let high = std::array::from_fn(|axis| {
        let mut q = steps(axis, ink.high[axis]).ceil() as u16;
        while q < u16::MAX && coordinate(frame, axis, q) < ink.high[axis] {
            q += 1;
        }
        q
    });
    [low, high]
}

/// The coordinate that `q` stands for along an axis, as the decoder rounds it.
fn coordinate(frame: &InkFrame, axis: usize, q: u16) -> f64 {
    frame.corner([q; 3])[axis].into()
}

/// The largest float32 not above `x`.
fn not_above(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) > x { rounded.next_down() } else { rounded }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::{InkBox, InkFrame, coordinate, frame_around, quantised};

    #[test]
    fn integer_boxes_enclose_the_boxes_they_stand_for() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for size in [1e-30, 1e-3, 1.0, 1e6, 1e30] {
            let mut boxes: Vec<InkBox> = (0..50)
                .map(|_| {
                    let low = std::array::from_fn(|_| size * rng.random_range(-1.0..1.0));
                    InkBox { low, high: low.map(|x| x + size * rng.random_range(0.0..0.1)) }
                })
                .collect();
            boxes.push(InkBox { low: [0.25; 3], high: [0.25; 3] });
            let frame = frame_around(&boxes);
            for ink in &boxes {
                let [low, high] = quantised(ink, &frame);
                for axis in 0..3 {
                    let [near, far] = [low, high].map(|corner| coordinate(&frame, axis, corner[axis]));
                    assert!(near <= ink.low[axis] && far >= ink.high[axis], "{ink:?} in {frame:?}: {near} to {far}");
                    let spare = 2.0 * f64::from(frame.step[axis]) + 1e-6 * near.abs().max(far.abs());
                    assert!(ink.low[axis] - near <= spare && far - ink.high[axis] <= spare, "{ink:?}: {near} to {far}");
                }
            }
        }
    }

    #[test]
    fn one_point_has_a_frame_without_extent() {
        let point = InkBox { low: [0.5; 3], high: [0.5; 3] };
        let frame = frame_around(&[point]);
        assert_eq!(frame, InkFrame { min: [0.5; 3], step: [0.0; 3] }, "the point itself");
        assert_eq!(quantised(&point, &frame), [[0; 3]; 2], "its only corner");
    }
}
