//! Opacities in 8 bits, and colours from 0 to 1.

/// Y₀ of the spherical harmonics: 1/(2√π).
const CONSTANT_HARMONIC: f32 = 0.282_094_8;

/// 255·o, rounded, of the logit of o.
pub(crate) fn byte_of_logit(logit: f32) -> u8 {
    (255.0 / (1.0 + (-logit).exp())).round() as u8
}

/// The logit of byte/255; 0 and 255 stand for half a step from the end, since the ends have none.
pub(crate) fn logit_of_byte(byte: u8) -> f32 {
    let opacity = f32::from(byte).clamp(0.5, 254.5) / 255.0;
    (opacity / (1.0 - opacity)).ln()
}

/// The constant coefficient of a colour that is the same from all sides.
pub(crate) fn constant_of_colour(channel: f32) -> f32 {
    (channel - 0.5) / CONSTANT_HARMONIC
}

/// The colour, 0 to 1, of a constant coefficient.
pub(crate) fn colour_of_constant(coefficient: f32) -> f32 {
    (0.5 + CONSTANT_HARMONIC * coefficient).clamp(0.0, 1.0)
}
