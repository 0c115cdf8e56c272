//! A rotation in a pixel: the largest of w, x, y, z is left out, alpha is 252 plus its index, and the others follow in their order with 8
//! bits each, from −1/√2 to 1/√2.

use std::f32::consts::{FRAC_1_SQRT_2, SQRT_2};

/// Packs (w, x, y, z) of any length above 0.
pub(super) fn pack(quaternion: [f32; 4]) -> [u8; 4] {
    let length = quaternion.iter().map(|part| f64::from(*part).powi(2)).sum::<f64>().sqrt();
    let largest =
        (0..4).fold(0, |best, index| if quaternion[index].abs() > quaternion[best].abs() { index } else { best });
    // q and −q are the same rotation; the part that is left out is positive.
    let sign = if quaternion[largest] < 0.0 { -1.0 } else { 1.0 };
    let mut pixel = [0, 0, 0, 252 + largest as u8];
    for (byte, index) in pixel.iter_mut().zip((0..4).filter(|&index| index != largest)) {
        let part = sign * f64::from(quaternion[index]) / length;
        *byte = ((part * f64::from(FRAC_1_SQRT_2) + 0.5) * 255.0).round() as u8;
    }
    pixel
}

/// (w, x, y, z) of length 1; `None` where alpha names no part.
pub(super) fn unpack([a, b, c, mode]: [u8; 4]) -> Option<[f32; 4]> {
    let largest = usize::from(mode.checked_sub(252)?);
    let parts = [a, b, c].map(|byte| (f32::from(byte) / 255.0 - 0.5) * SQRT_2);
    let left_out = (1.0 - parts.iter().map(|part| part * part).sum::<f32>()).max(0.0).sqrt();
    let mut quaternion = [left_out; 4];
    for (part, index) in parts.into_iter().zip((0..4).filter(|&index| index != largest)) {
        quaternion[index] = part;
    }
    Some(quaternion)
}
