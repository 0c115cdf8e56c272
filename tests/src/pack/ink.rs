//! The boxes that enclose what a chunk can draw.

use pocketsplat_format::bundle::InkFrame;
use pocketsplat_format::rules::INK_DEVIATIONS;

use super::models::Anchor;

/// Rounding of an f32 and then some, relative to the largest coordinate.
const ROUNDING: f64 = 1e-6;
/// Largest magnitude of a coordinate: the sums of the format stay finite.
const MAX_COORDINATE: f64 = f32::MAX as f64 / 4.0;

/// Lowest and highest corner of a box, normalised frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InkBox {
    low: [f64; 3],
    high: [f64; 3],
}

impl InkBox {
    /// The box of the anchors of a chunk with their steps.
    ///
    /// * `n_scalars`: F and S.
    pub(super) fn of(voxel_size: f32, n_scalars: [usize; 2], anchors: &[Anchor], steps: &[[f32; 3]]) -> Self {
        let [n_features, n_log_scales] = n_scalars;
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for (anchor, [_, log_scale_step, offset_step]) in anchors.iter().zip(steps) {
            let (log_scales, offsets) = anchor.symbols[n_features..].split_at(n_log_scales);
            let scale = |i: usize| (f64::from(log_scales[i]) * f64::from(*log_scale_step)).clamp(-87.0, 88.0).exp();
            let radius = INK_DEVIATIONS * (3..log_scales.len()).map(scale).fold(0.0, f64::max);
            for (k, offset) in offsets.as_chunks::<3>().0.iter().enumerate() {
                for axis in (0..3).filter(|_| anchor.drawn >> k & 1 == 1) {
                    let position = f64::from(anchor.cell[axis]) * f64::from(voxel_size);
                    let centre = position + f64::from(offset[axis]) * f64::from(*offset_step) * scale(axis);
                    low[axis] = low[axis].min(centre - radius);
                    high[axis] = high[axis].max(centre + radius);
                }
            }
        }
        if low[0] > high[0] {
            // No offset is drawn.
            return Self { low: [0.0; 3], high: [0.0; 3] };
        }
        let slack = ROUNDING * low.iter().chain(&high).fold(0.0_f64, |m, x| m.max(x.abs()));
        let fit = |x: f64| x.clamp(-MAX_COORDINATE, MAX_COORDINATE);
        Self { low: low.map(|x| fit(x - slack)), high: high.map(|x| fit(x + slack)) }
    }
}

/// The finest frame that reaches around all of `boxes`.
pub fn frame_around(boxes: &[InkBox]) -> InkFrame {
    let mut frame = InkFrame { min: [0.0; 3], step: [0.0; 3] };
    for axis in (0..3).filter(|_| !boxes.is_empty()) {
        let low = boxes.iter().map(|ink| ink.low[axis]).fold(f64::INFINITY, f64::min);
        let high = boxes.iter().map(|ink| ink.high[axis]).fold(f64::NEG_INFINITY, f64::max);
        let rounded = low as f32;
        frame.min[axis] = if f64::from(rounded) > low { rounded.next_down() } else { rounded };
        frame.step[axis] = ((high - f64::from(frame.min[axis])) / f64::from(u16::MAX)) as f32;
        while coordinate(&frame, axis, u16::MAX) < high {
            frame.step[axis] = frame.step[axis].next_up();
        }
    }
    frame
}

/// The corners of the smallest box of `frame` around `ink`.
pub fn quantised(ink: &InkBox, frame: &InkFrame) -> [[u16; 3]; 2] {
    let steps = |axis: usize, x: f64| {
        let steps = (x - f64::from(frame.min[axis])) / f64::from(frame.step[axis]);
        // NaN, of a frame without extent, becomes 0.
        steps.clamp(0.0, f64::from(u16::MAX))
    };
    let low = std::array::from_fn(|axis| {
        let first = steps(axis, ink.low[axis]).floor() as u16;
        (0..=first).rev().find(|&q| coordinate(frame, axis, q) <= ink.low[axis]).unwrap_or(0)
    });
    let high = std::array::from_fn(|axis| {
        let first = steps(axis, ink.high[axis]).ceil() as u16;
        (first..=u16::MAX).find(|&q| coordinate(frame, axis, q) >= ink.high[axis]).unwrap_or(u16::MAX)
    });
    [low, high]
}

/// The coordinate that `q` stands for along an axis, as a decoder rounds it.
fn coordinate(frame: &InkFrame, axis: usize, q: u16) -> f64 {
    frame.corner([q; 3])[axis].into()
}
