//! The rules of drawing that training follows as well: where the two differ, a trained scene looks different on a device.

/// Centres at this depth or nearer are not drawn, normalised units (Kerbl et al. 2023, 3D Gaussian splatting).
pub const NEAR: f32 = 0.2;

/// Added in frames of the training size to both variances of a projected covariance, so that no splat is thinner than about a
/// pixel, px² (Kerbl et al. 2023).
pub const DILATION_PX2: f64 = 0.3;

/// Added beside it in smaller frames, times 1 − s² where they have s times the size: chosen by measurement (a box of one pixel has a
/// variance of 1/12 px²).
pub const SHRUNK_DILATION_PX2: f32 = 1.0 / 6.0;

/// How far the dilation makes a splat reach beyond its extent in space: √(2 ln 255 · 0.3) and rounding, pixels.
pub const DILATION_REACH_PX: f64 = 1.9;

/// How far a Gaussian reaches: an opaque one falls to 1/255 at √(2 ln 255) = 3.3290 deviations; the rest covers rounding.
pub const INK_DEVIATIONS: f64 = 3.33;

/// Largest alpha of one contribution: no splat is opaque, which keeps the light behind it computable.
pub const ALPHA_MAX: f64 = 0.99;

/// A splat that would leave less light than this is left out, and the pixel is finished: all later splats together move a
/// channel by less than half a step of 8 bits.
pub const TRANSMITTANCE_MIN: f64 = 1e-4;

/// Edge of a tile, pixels.
pub const TILE_PX: u16 = 16;
