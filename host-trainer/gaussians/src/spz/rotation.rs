//! A rotation in 32 bits: the largest of x, y, z, w is left out, its index stands in the top two bits, and the others follow in their
//! order with a sign and 9 bits each, of 1/√2.

use std::f32::consts::FRAC_1_SQRT_2;

/// Packs (w, x, y, z) of any length above 0.
pub(super) fn pack([w, x, y, z]: [f32; 4]) -> u32 {
    let parts = [x, y, z, w].map(f64::from);
    let length = parts.iter().map(|part| part * part).sum::<f64>().sqrt();
    let largest = (0..4).fold(0, |best, index| if parts[index].abs() > parts[best].abs() { index } else { best });
    // q and −q are the same rotation; the part that is left out is positive.
    let sign = if parts[largest] < 0.0 { -1.0 } else { 1.0 };
    let mut packed = largest as u32;
    for index in (0..4).filter(|&index| index != largest) {
        let part = sign * parts[index] / length;
        let magnitude = (part.abs() / f64::from(FRAC_1_SQRT_2) * 511.0).round().min(511.0) as u32;
        packed = packed << 10 | u32::from(part < 0.0) << 9 | magnitude;
    }
    packed
}

/// (w, x, y, z) of length 1, from the 4 bytes of versions 3 and 4 or the 3 of versions 1 and 2.
pub(super) fn unpack(bytes: &[u8]) -> [f32; 4] {
    match *bytes {
        [a, b, c, d] => unpack_smallest(u32::from_le_bytes([a, b, c, d])),
        [a, b, c] => {
            let [x, y, z] = [a, b, c].map(|byte| f32::from(byte) / 127.5 - 1.0);
            let [w, length] =
                [(1.0 - (x * x + y * y + z * z)).max(0.0).sqrt(), (x * x + y * y + z * z).sqrt().max(1.0)];
            [w, x / length, y / length, z / length]
        }
        _ => [1.0, 0.0, 0.0, 0.0],
    }
}

fn unpack_smallest(packed: u32) -> [f32; 4] {
    let largest = (packed >> 30) as usize;
    let mut parts = [0.0f32; 4];
    let mut rest = packed;
    let mut squares = 0.0;
    for index in (0..4).rev().filter(|&index| index != largest) {
        let magnitude = (rest & 511) as f32 / 511.0 * FRAC_1_SQRT_2;
        parts[index] = if rest & 512 == 0 { magnitude } else { -magnitude };
        squares += magnitude * magnitude;
        rest >>= 10;
    }
    parts[largest] = (1.0 - squares).max(0.0).sqrt();
    let [x, y, z, w] = parts;
    [w, x, y, z]
}
