//! How far an 8-bit frame is from the oracle's.

use std::fmt;

/// The larger of two errors; what is no number is larger than all, so that no maximum loses it.
pub fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b <= a { a } else { b }
}

/// The difference between an 8-bit frame and an f64 one, over all channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Mean squared error, in units of the full range.
    pub mean_squared: f64,
    /// Largest error, in 8-bit steps.
    pub worst_steps: f64,
    /// Pixel `[x, y]` of the largest error.
    pub worst_px: [usize; 2],
    /// Share of channels that are not the oracle's value rounded to 8 bits.
    pub share_not_rounded: f64,
}

impl Difference {
    /// Compares `[height, width, 3]` bytes with `[height, width]` colours; the oracle's are clamped to 0..1, not rounded.
    ///
    /// # Panics
    /// If the two have different sizes.
    pub fn of(found: &[u8], oracle: &[[f64; 3]], width_px: usize) -> Self {
        let oracle = oracle.as_flattened();
        assert_eq!(found.len(), oracle.len(), "channels in the frame and in the oracle's");
        let mut difference = Self { mean_squared: 0.0, worst_steps: 0.0, worst_px: [0, 0], share_not_rounded: 0.0 };
        for (i, (&byte, &colour)) in found.iter().zip(oracle).enumerate() {
            let colour = colour.clamp(0.0, 1.0);
            let error = f64::from(byte) / 255.0 - colour;
            difference.mean_squared += error * error;
            if byte != (colour * 255.0 + 0.5) as u8 {
                difference.share_not_rounded += 1.0;
            }
            let steps = 255.0 * error.abs();
            if steps.is_nan() || steps > difference.worst_steps {
                difference.worst_steps = steps;
                difference.worst_px = [i / 3 % width_px, i / 3 / width_px];
            }
        }
        difference.mean_squared /= oracle.len() as f64;
        difference.share_not_rounded /= oracle.len() as f64;
        difference
    }

    /// Peak signal-to-noise ratio, dB. Rounding to 8 bits alone leaves 58.9 dB: an error uniform over one step.
    pub fn psnr_db(&self) -> f64 {
        -10.0 * self.mean_squared.log10()
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y] = self.worst_px;
        write!(
            f,
            "{:.2} dB, worst {:.3} steps at ({x}, {y}), {:.4} % of channels not the oracle's rounded",
            self.psnr_db(),
            self.worst_steps,
            100.0 * self.share_not_rounded
        )
    }
}
