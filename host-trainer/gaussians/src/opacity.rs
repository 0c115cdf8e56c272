//! Opacities in 8 bits.

/// 255·o, rounded, of the logit of o.
pub(crate) fn byte_of_logit(logit: f32) -> u8 {
    (255.0 / (1.0 + (-logit).exp())).round() as u8
}

/// The logit of byte/255; 0 and 255 stand for half a step from the end, since the ends have none.
pub(crate) fn logit_of_byte(byte: u8) -> f32 {
    let opacity = f32::from(byte).clamp(0.5, 254.5) / 255.0;
    (opacity / (1.0 - opacity)).ln()
}
