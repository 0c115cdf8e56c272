//! Weights as halves, and sums of their products with floats.

use bytemuck::{Pod, Zeroable};
use pocketsplat_format::math::to_half;

/// Outputs computed together in layers whose outputs are all needed.
pub(super) use pocketsplat_half::LANES;

/// 2¹¹²: what a half's bits, moved into a float's fields, are short of.
const SCALE: f32 = f32::from_bits((127 + 112) << 23);

/// A half.
///
/// Its product with a float is that of its value: `(w·2⁻¹¹²)·(x·2¹¹²)` is the same real number as `w·x` and rounds likewise.
/// The first factor is a matter of moving bits, for every finite half, subnormal ones too; the second is exact for |x| < 2¹⁶.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(transparent)]
pub(crate) struct Half(u16);

impl Half {
    /// Rounds a weight of the file, which is a half or a symbol times a step.
    pub(super) fn of(weight: f32) -> Self {
        Self(to_half(weight))
    }

    /// The weight by itself, as the bias that a sum begins with.
    #[inline(always)]
    fn value(self) -> f32 {
        self.scaled() * SCALE
    }

    /// The weight times 2⁻¹¹².
    // On a Cortex-M a load that extends the sign, and an AND with a shifted operand.
    #[inline(always)]
    fn scaled(self) -> f32 {
        f32::from_bits(((i32::from(self.0 as i16) << 13) as u32) & 0x8FFF_E000)
    }
}

/// The outputs of one block: bias, then `input·weight` added in order.
///
/// Inputs that are 0, as half of the hidden units are, are left out before their weights are widened: a product of ±0 changes no
/// sum but the sign of a zero.
#[inline]
pub(super) fn outputs<const B: usize>(block: &[[Half; B]], inputs: &[f32]) -> [f32; B] {
    let Some((biases, rows)) = block.split_first() else { return [0.0; B] };
    let mut sums = biases.map(Half::value);
    for (row, &x) in rows.iter().zip(inputs) {
        // For one weight the test would cost more than it saves.
        if B == 1 || x != 0.0 {
            let x = x * SCALE;
            for (sum, weight) in sums.iter_mut().zip(row) {
                *sum += weight.scaled() * x;
            }
        }
    }
    checked(sums, block, inputs)
}

/// The sums of two anchors, whose weights are widened once. Without the FPU's conversions they are not finite where an input is too large to
/// be scaled.
#[inline]
pub(super) fn sums_of_two(block: &[[Half; LANES]], inputs: [&[f32]; 2]) -> [[f32; LANES]; 2] {
    let Some((biases, rows)) = block.split_first() else { return [[0.0; LANES]; 2] };
    let mut sums = [biases.map(Half::value); 2];
    if pocketsplat_half::IN_HARDWARE {
        pocketsplat_half::add_products(&mut sums, bytemuck::cast_slice(rows), inputs);
        return sums;
    }
    let [first, second] = &mut sums;
    let [first_inputs, second_inputs] = inputs;
    for ((row, &x), &y) in rows.iter().zip(first_inputs).zip(second_inputs) {
        let [x, y] = [x * SCALE, y * SCALE];
        for ((first, second), weight) in first.iter_mut().zip(&mut *second).zip(row) {
            let weight = weight.scaled();
            *first += weight * x;
            *second += weight * y;
        }
    }
    sums
}

/// `sums`, or the same without scaling if an input was too large for it, which leaves no sum finite.
#[inline(always)]
fn checked<const B: usize>(sums: [f32; B], block: &[[Half; B]], inputs: &[f32]) -> [f32; B] {
    // 0 times a finite number is 0; times any other it is NaN, and so is every sum with NaN.
    let mut zero = 0.0;
    for sum in sums {
        zero += 0.0 * sum;
    }
    if zero == 0.0 { sums } else { core::array::from_fn(|lane| unscaled(block.as_flattened(), lane, B, inputs)) }
}

/// One output of a block of `lanes`, for inputs of any size.
// Not inlined: rare, in the middle of loops that are not.
#[cold]
#[inline(never)]
pub(super) fn unscaled(block: &[Half], lane: usize, lanes: usize, inputs: &[f32]) -> f32 {
    let mut weights = block.get(lane..).unwrap_or_default().iter().step_by(lanes.max(1));
    let mut sum = weights.next().map_or(0.0, |bias| bias.value());
    for (weight, x) in weights.zip(inputs) {
        sum += weight.value() * x;
    }
    sum
}

#[cfg(test)]
mod tests {
    use half::f16;

    use super::{Half, LANES, SCALE, outputs, sums_of_two};

    /// Every finite half.
    fn halves() -> impl Iterator<Item = f16> {
        (0..=u16::MAX).map(f16::from_bits).filter(|half| half.is_finite())
    }

    #[test]
    fn products_are_those_of_the_value() {
        let mut state = 1_u32;
        let mut xs = std::vec![0.0, -0.0, 1.0, -1.0, 1e-45, -1e-45, 1e-38, 1.1754944e-38, 0.1, 65_535.996, -65_535.996];
        // Of all exponents below 16.
        for exponent in 0..127 + 16 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            xs.push(f32::from_bits(exponent << 23 | state & 0x807F_FFFF));
        }
        for half in halves() {
            let weight = Half::of(half.to_f32());
            assert_eq!(weight.0, half.to_bits(), "kept as it is");
            assert_eq!(weight.value().to_bits(), half.to_f32().to_bits(), "its value");
            for &x in &xs {
                let (ours, value) = (weight.scaled() * (x * SCALE), half.to_f32() * x);
                assert_eq!(ours.to_bits(), value.to_bits(), "{half} times {x:e}");
            }
        }
    }

    #[test]
    fn sums_are_those_of_the_values_whatever_the_inputs() {
        let mut state = 3_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 8_388_608.0 - 1.0
        };
        for round in 0..2000 {
            let block: [[Half; LANES]; 9] =
                core::array::from_fn(|_| core::array::from_fn(|_| Half::of(3.0 * random())));
            // Small ones, zeros, and in some rounds one that is too large to be scaled.
            let mut inputs: [[f32; 8]; 2] = core::array::from_fn(|_| core::array::from_fn(|_| 5.0 * random().max(0.0)));
            if round % 3 == 0 {
                inputs[0][round % 8] = [65_536.0, -70_000.0, 6e5, 3e38, -1e30][round % 5];
            }
            let expected = inputs.map(|inputs| {
                core::array::from_fn(|lane| {
                    let mut sum = block[0][lane].value();
                    for (row, x) in block[1..].iter().zip(inputs) {
                        sum += row[lane].value() * x;
                    }
                    sum
                })
            });
            assert_eq!(inputs.map(|inputs| outputs(&block, &inputs)), expected, "one by one, {inputs:?}");
            if round % 3 != 0 {
                let of_two = sums_of_two(&block, inputs.each_ref().map(|inputs| &inputs[..]));
                assert_eq!(of_two, expected, "two at a time");
            }
        }
    }
}
