//! One number for conversions to and from halves, and for sums of products with them.

use pocketsplat_half::{add_products, from_half, from_halves, is_finite_half, to_half};

use super::digest::Digest;

/// The lower 13 bits of a float, which a half drops: exact, just above, just below and at a tie, just above it, all.
const DROPPED: [u32; 6] = [0, 1, 0xFFF, 0x1000, 0x1001, 0x1FFF];

/// Weights at a multiple of four bytes, where a Cortex-M multiplies them its own way.
#[repr(align(4))]
struct Rows([[u16; 8]; 3]);

/// Digest of every finite half as a float, of the halves of 3.1 million floats (every sign, exponent and upper ten bits of the fraction; ties,
/// subnormals, infinities and NaN among them), and of sums.
pub(crate) fn digest() -> Digest {
    let mut digest = Digest::EMPTY;
    let mut add = |value: f32| digest.add(value.to_bits().to_le_bytes());
    for bits in (0..=u16::MAX).filter(|&bits| is_finite_half(bits)) {
        let value = from_half(bits);
        add(value);
        let four = from_halves([bits, 0, bits ^ 0x8000, bits]);
        let same = [value, 0.0, -value, value];
        add(if four.map(f32::to_bits) == same.map(f32::to_bits) { 1.0 } else { 0.0 });
    }
    // Weights of all finite halves, eight a row; inputs of any size that leaves the sums finite, subnormal ones too.
    let mut state = 1_u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state
    };
    for _ in 0..2000 {
        let weights = Rows(core::array::from_fn(|_| {
            core::array::from_fn(|_| {
                let bits = (random() >> 16) as u16;
                if is_finite_half(bits) { bits } else { 0 }
            })
        }));
        let inputs: [[f32; 3]; 2] = core::array::from_fn(|_| {
            core::array::from_fn(|_| f32::from_bits((random() & 0x807F_FFFF) | (random() >> 8) % 210 << 23))
        });
        let mut sums: [[f32; 8]; 2] = core::array::from_fn(|_| core::array::from_fn(|_| (random() >> 8) as f32 * 1e-6));
        add_products(&mut sums, &weights.0, inputs.each_ref().map(|inputs| &inputs[..]));
        sums.as_flattened().iter().for_each(|&sum| add(sum));
    }
    for upper in 0..1_u32 << 19 {
        for dropped in DROPPED {
            digest.add(to_half(f32::from_bits(upper << 13 | dropped)).to_le_bytes());
        }
    }
    digest
}
