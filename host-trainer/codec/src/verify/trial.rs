//! One frame in watched memory.

use std::convert::Infallible;

use pocketsplat_core::{Bundle, Camera, DecodeError, Decoder, FrameReport, Plan, Tile, TileSink};

/// Bytes before and after the memory that a decoder gets.
const GUARD_LEN: usize = 64;

/// A frame drawn between two guards, and the memory of the plan as it was left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Trial {
    /// `[height, width, 3]`.
    pub rgb: Vec<u8>,
    /// What the decoder says of it.
    pub report: FrameReport,
    /// `[scratch_len]`.
    pub memory: Vec<u8>,
}

/// What must not happen.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "each message names its fields")]
pub enum Breach {
    /// The decoder refused what was planned.
    #[error("the decoder refuses: {0}")]
    Refused(#[from] DecodeError),
    /// It wrote where it was given nothing.
    #[error("{n_bytes} bytes beside the {scratch_len} of the plan were written to")]
    Outside { n_bytes: usize, scratch_len: usize },
    /// A pixel came never, or more than once.
    #[error("pixel ({x}, {y}) was delivered {times} times, needed: once")]
    Delivery { x: usize, y: usize, times: u8 },
}

impl Trial {
    /// Draws a frame in memory that is filled with `fill` before and begins `start` bytes after a guard.
    ///
    /// # Errors
    /// [`Breach`].
    pub fn run(bundle: &Bundle<'_>, plan: Plan, camera: &Camera, fill: u8, start: usize) -> Result<Self, Breach> {
        let scratch_len = plan.scratch_len();
        let mut memory = vec![fill; GUARD_LEN + start + scratch_len + GUARD_LEN];
        let (before, rest) = memory.split_at_mut(GUARD_LEN + start);
        let (scratch, after) = rest.split_at_mut(scratch_len);
        let mut sink = Pixels::new(camera);
        let report =
            Decoder::bind(bundle, plan, &mut *scratch)?.render(camera, &mut sink).map_err(DecodeError::from)?;
        let n_bytes = before.iter().chain(&*after).filter(|byte| **byte != fill).count();
        if n_bytes > 0 {
            return Err(Breach::Outside { n_bytes, scratch_len });
        }
        if let Some(pixel) = sink.times.iter().position(|times| *times != 1) {
            let (x, y) = (pixel % sink.width, pixel / sink.width);
            return Err(Breach::Delivery { x, y, times: sink.times[pixel] });
        }
        Ok(Self { rgb: sink.rgb, report, memory: scratch.to_vec() })
    }
}

/// A frame, and how often each of its pixels came.
struct Pixels {
    width: usize,
    rgb: Vec<u8>,
    times: Vec<u8>,
}

impl Pixels {
    fn new(camera: &Camera) -> Self {
        let [width, height] = [camera.width_px, camera.height_px].map(usize::from);
        Self { width, rgb: vec![0; 3 * width * height], times: vec![0; width * height] }
    }
}

impl TileSink for Pixels {
    type Error = Infallible;

    fn tile(&mut self, Tile { x_px, y_px, width, rgb, .. }: Tile<'_>) -> Result<(), Infallible> {
        let [x, y, width] = [x_px, y_px, width].map(usize::from);
        for (row, pixels) in rgb.chunks_exact(width).enumerate() {
            let start = (y + row) * self.width + x;
            self.rgb[3 * start..][..3 * width].copy_from_slice(pixels.as_flattened());
            self.times[start..][..width].iter_mut().for_each(|times| *times = times.saturating_add(1));
        }
        Ok(())
    }
}
