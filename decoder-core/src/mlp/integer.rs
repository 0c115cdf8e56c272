//! Heads in integers: weights, inputs and hidden units of 16 bits, sums of 32, which never overflow.
//!
//! An output is `t·Σ v·h + b`: v integers, t one step an output, h the hidden units as integers. What a step of hidden unit j
//! is worth goes into the weights that read it, because relu(c·x) = c·relu(x) for c > 0: so all units have one scale, and
//! nothing is a float between the inputs and the outputs.

use core::cell::Cell;
use core::iter;

use bytemuck::{Pod, Zeroable};
use pocketsplat_format::DecodeError;
use pocketsplat_format::bundle::{HeadView, WeightReader};

use super::block::HeadWeights;
use super::format::{HeadFormat, I16, MlpHead};
use super::pair::Role;
use crate::arena::Arena;

/// Units computed together: their sums, a pair of inputs and the addresses fill the registers of a Cortex-M.
const LANES: usize = 4;
/// Largest magnitude of a weight, an input or a hidden unit.
const MOST: f32 = 32_767.0;
/// Largest sum of the magnitudes of a row's weights, in steps: times [`MOST`] it is below 2³¹, with 128 steps of rounding of 257
/// weights.
const MOST_OF_A_ROW: f32 = 65_400.0;
/// Added, it leaves a float of less than 2²² rounded to an integer in the low bits: 1.5 · 2²³.
const ROUNDER: f32 = 12_582_912.0;

/// Two neighbouring weights of an output, 16 bits each.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(transparent)]
pub(crate) struct Pair(u32);

impl Pair {
    /// From the low 16 bits of each.
    fn of(low: u32, high: u32) -> Self {
        Self(packed(low, high))
    }

    /// `sum` with both products added; `x` holds two values, the first in its low half.
    // On a Cortex-M4 two instructions, SMLABB and SMLATT.
    #[inline(always)]
    fn added(self, sum: i32, x: u32) -> i32 {
        let low = i32::from(self.0 as i16).wrapping_mul(i32::from(x as i16));
        let high = (self.0 as i32 >> 16).wrapping_mul(x as i32 >> 16);
        sum.wrapping_add(low).wrapping_add(high)
    }
}

/// Values as integers, two a word, times one scale.
#[derive(Clone, Copy)]
pub(crate) struct Quantised<'v> {
    pairs: &'v [u32],
    scale: f32,
}

impl<'v> Quantised<'v> {
    /// A 1, which multiplies the bias, and the heads' inputs behind it, in the inputs' own memory: a head that sees less than another
    /// reads the first of them.
    ///
    /// # Budget
    /// About 10 instructions an input.
    pub(crate) fn of(inputs: &'v mut [f32]) -> Self {
        let mut largest = 1.0_f32;
        for x in &*inputs {
            let magnitude = x.abs();
            largest = if magnitude > largest { magnitude } else { largest };
        }
        let steps_per_unit = MOST / largest;
        let steps = |x: &Cell<f32>| (x.get() * steps_per_unit + ROUNDER).to_bits();
        let one = (steps_per_unit + ROUNDER).to_bits();
        let n_words = inputs.len() / 2 + 1;
        let cells = Cell::from_mut(&mut *inputs).as_slice_of_cells();
        if let Some((first, rest)) = cells.split_first() {
            first.set(f32::from_bits(packed(one, steps(first))));
            // A word is written when both of its pair, which lie at or behind it, have been read.
            let (pairs, last) = rest.as_chunks::<2>();
            for (slot, [low, high]) in rest.iter().zip(pairs) {
                slot.set(f32::from_bits(packed(steps(low), steps(high))));
            }
            if let (Some(slot), [x]) = (rest.get(pairs.len()), last) {
                slot.set(f32::from_bits(packed(steps(x), 0)));
            }
        }
        Self { pairs: words(inputs).get(..n_words).unwrap_or_default(), scale: largest / MOST }
    }
}

/// One head; its output layer has blocks of `B` outputs.
#[derive(Clone, Copy)]
pub(crate) struct IntegerHead<'s, const B: usize> {
    /// `[n_blocks, ⌈(1 + n_in)/2⌉, LANES]`, the bias before the weights.
    hidden: &'s [[Pair; LANES]],
    pairs_per_unit: usize,
    /// `[n_blocks, ⌈n_hidden/2⌉, B]`.
    output: &'s [[Pair; B]],
    pairs_per_output: usize,
    /// `[n_blocks, B]`: what a step is worth for hidden units of scale 1, and the bias.
    ends: &'s [[[f32; 2]; B]],
    n_hidden: usize,
}

/// Integers read integers; the detail head stays in floats.
impl HeadFormat for I16 {
    // One scale serves all inputs, those that a camera decides too.
    const READS_SUMS: bool = false;
    type Values<'v> = Quantised<'v>;
    type Head<'s, const B: usize> = IntegerHead<'s, B>;

    fn values(inputs: &mut [f32]) -> Quantised<'_> {
        Quantised::of(inputs)
    }

    fn floats(_: &[f32]) -> Option<Quantised<'_>> {
        None
    }
}

impl<'s, N, const B: usize> MlpHead<'s, N, B> for IntegerHead<'s, B>
where
    N: for<'v> HeadFormat<Values<'v> = Quantised<'v>>,
{
    fn convert(
        arena: &mut Arena<'s>,
        mut free: Arena<'_>,
        _: HeadWeights,
        head: &HeadView<'_>,
        weights: &mut WeightReader<'_>,
    ) -> Result<Self, DecodeError> {
        let HeadView { n_in, n_hidden, .. } = *head;
        let (pairs_per_unit, pairs_per_output) = (n_in / 2 + 1, n_hidden.div_ceil(2));
        let n_blocks = head.b2.len().div_ceil(B);
        let hidden = take_rows::<LANES>(arena, n_hidden.div_ceil(LANES) * pairs_per_unit)?;
        let output = take_rows::<B>(arena, n_blocks * pairs_per_output)?;
        let ends = arena.take::<[[f32; 2]; B]>(n_blocks)?;
        // Needed until the weights are integers: what a step of each hidden unit is worth, and a row.
        let steps = free.take::<f32>(n_hidden)?;
        let row = free.take::<f32>(n_hidden.max(n_in + 1))?;

        let mut w1 = weights.next_layer();
        for (unit, (bias, step)) in head.b1.iter().zip(&mut *steps).enumerate() {
            let row = row.get_mut(..=n_in).unwrap_or_default();
            for (slot, weight) in row.iter_mut().zip(iter::once(bias).chain(w1.by_ref().take(n_in))) {
                *slot = weight;
            }
            *step = put_row(row, hidden, unit, pairs_per_unit);
        }
        let mut w2 = weights.next_layer();
        for (index, bias) in head.b2.iter().enumerate() {
            let row = row.get_mut(..n_hidden).unwrap_or_default();
            for ((slot, step), weight) in row.iter_mut().zip(&*steps).zip(w2.by_ref()) {
                *slot = weight * step;
            }
            let step = put_row(row, output, index, pairs_per_output);
            if let Some(end) = ends.as_flattened_mut().get_mut(index) {
                *end = [step, bias];
            }
        }
        Ok(Self { hidden, pairs_per_unit, output, pairs_per_output, ends, n_hidden })
    }

    fn begin(&self, _: &[f32], _: &mut [f32]) {}

    fn activate<'h>(
        &self,
        _: usize,
        inputs: Quantised<'_>,
        hidden: &'h mut [f32],
        _: &'h mut Role<'_>,
    ) -> Quantised<'h> {
        let mut blocks = self.hidden.chunks_exact(self.pairs_per_unit.max(1));
        let mut all_bits = 0;
        for units in words_mut(hidden).as_chunks_mut::<LANES>().0 {
            let Some(block) = blocks.next() else { break };
            for (unit, sum) in units.iter_mut().zip(sums(block, inputs.pairs)) {
                *unit = sum.max(0) as u32;
                all_bits |= *unit;
            }
        }
        // To 15 bits; the sign's is never set.
        let shift = 17_u32.saturating_sub(all_bits.leading_zeros()) & 31;
        let (used, _) = words_mut(hidden).split_at_mut_checked(self.n_hidden).unwrap_or_default();
        // As for the inputs.
        let cells = Cell::from_mut(used).as_slice_of_cells();
        let (pairs, last) = cells.as_chunks::<2>();
        for (slot, [low, high]) in cells.iter().zip(pairs) {
            slot.set(low.get() >> shift | high.get() >> shift << 16);
        }
        if let (Some(slot), [unit]) = (cells.get(pairs.len()), last) {
            slot.set(unit.get() >> shift);
        }
        let two_to_shift = f32::from_bits((127 + shift) << 23);
        let pairs = words(hidden).get(..self.pairs_per_output).unwrap_or_default();
        Quantised { pairs, scale: inputs.scale * two_to_shift }
    }

    fn block(&self, index: usize, hidden: Quantised<'_>) -> Option<[f32; B]> {
        let (_, from) = self.output.split_at_checked(index * self.pairs_per_output)?;
        let sums = sums(from.get(..self.pairs_per_output)?, hidden.pairs);
        let mut outputs = [0.0; B];
        for ((output, sum), [step, bias]) in outputs.iter_mut().zip(sums).zip(self.ends.get(index)?) {
            *output = sum as f32 * (hidden.scale * step) + bias;
        }
        Some(outputs)
    }
}

/// The sums of one block.
#[inline]
fn sums<const B: usize>(block: &[[Pair; B]], values: &[u32]) -> [i32; B] {
    let mut sums = [0; B];
    for (row, &x) in block.iter().zip(values) {
        for (sum, pair) in sums.iter_mut().zip(row) {
            *sum = pair.added(*sum, x);
        }
    }
    sums
}

/// `n` rows of `B` pairs, all zero.
fn take_rows<'s, const B: usize>(arena: &mut Arena<'s>, n: usize) -> Result<&'s mut [[Pair; B]], DecodeError> {
    let rows = arena.take::<[Pair; B]>(n)?;
    rows.fill([Pair::zeroed(); B]);
    Ok(rows)
}

/// Rounds the weights of output `index` and puts them into its lane; returns what a step is worth.
fn put_row<const B: usize>(weights: &[f32], rows: &mut [[Pair; B]], index: usize, pairs_per_output: usize) -> f32 {
    let (mut largest, mut sum) = (0.0, 0.0);
    for weight in weights {
        let magnitude = weight.abs();
        largest = if magnitude > largest { magnitude } else { largest };
        sum += magnitude;
    }
    let [by_largest, by_sum] = [largest / MOST, sum / MOST_OF_A_ROW];
    let step = if by_largest > by_sum { by_largest } else { by_sum };
    let step = if step > f32::MIN_POSITIVE { step } else { f32::MIN_POSITIVE };
    let block = rows.chunks_exact_mut(pairs_per_output.max(1)).nth(index / B).unwrap_or_default();
    let steps = |weight: &f32| (weight / step + ROUNDER).to_bits();
    for (row, pair) in block.iter_mut().zip(weights.chunks(2)) {
        if let (Some(slot), Some(low)) = (row.get_mut(index % B), pair.first()) {
            *slot = Pair::of(steps(low), pair.get(1).map_or(0, steps));
        }
    }
    step
}

/// The low halves of two words in one.
fn packed(low: u32, high: u32) -> u32 {
    low & 0xFFFF | high << 16
}

// Floats and words have one size and one alignment.
fn words(floats: &[f32]) -> &[u32] {
    bytemuck::try_cast_slice(floats).unwrap_or_default()
}

fn words_mut(floats: &mut [f32]) -> &mut [u32] {
    bytemuck::try_cast_slice_mut(floats).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use bytemuck::Zeroable;

    use super::{Pair, Quantised, put_row, sums};

    /// A stream of numbers between −1 and 1, the same every time.
    fn numbers(seed: u32) -> impl FnMut() -> f32 {
        let mut state = seed;
        move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 8_388_608.0 - 1.0
        }
    }

    /// The integers of quantised values, in order.
    fn integers(values: &Quantised<'_>) -> Vec<i64> {
        values.pairs.iter().flat_map(|&pair| [i64::from(pair as i16), i64::from((pair >> 16) as i16)]).collect()
    }

    #[test]
    fn inputs_are_right_to_half_a_step_behind_a_one() {
        let mut random = numbers(1);
        for n in 1..70 {
            for size in [1e-6, 0.5, 1.0, 30.0, 1e9] {
                let inputs: Vec<f32> = (0..n).map(|_| size * random()).collect();
                let mut memory = inputs.clone();
                let values = Quantised::of(&mut memory);
                let found = integers(&values);
                let expected = [1.0].iter().chain(&inputs);
                for (found, expected) in found.iter().zip(expected) {
                    let error = *found as f64 * f64::from(values.scale) - f64::from(*expected);
                    assert!(error.abs() <= 0.51 * f64::from(values.scale), "{found} for {expected} of {size}");
                }
                assert!(found[n + 1..].iter().all(|&rest| rest == 0), "nothing behind them");
            }
        }
    }

    /// Sums of random rows against f64, and those of the largest values against i64.
    #[test]
    fn rows_are_right_to_half_a_step_and_never_overflow() {
        let mut random = numbers(2);
        for n in [1_usize, 2, 3, 16, 33, 257] {
            // One weight far above the others, all alike, and random ones.
            for kind in 0..3 {
                let weights: Vec<f32> = (0..n)
                    .map(|i| match kind {
                        0 if i > 0 => 1e-6 * random(),
                        2 => random(),
                        _ => -60_000.0,
                    })
                    .collect();
                let n_pairs = n.div_ceil(2);
                let mut rows = std::vec![[Pair::zeroed(); 3]; n_pairs];
                let step = f64::from(put_row(&weights, &mut rows, 1, n_pairs));
                let steps: Vec<i64> =
                    (0..2 * n_pairs).map(|i| sums(&rows[i / 2..], &[1_u32 << (16 * (i % 2))])[1].into()).collect();
                for (found, weight) in steps.iter().zip(&weights) {
                    let error = *found as f64 * step - f64::from(*weight);
                    assert!(error.abs() <= 0.51 * step, "{found} steps of {step} for {weight}");
                }
                for x in [i16::MAX, -i16::MAX] {
                    let pair = u32::from(x as u16) * 0x1_0001;
                    let exact = steps.iter().map(|&step| step * i64::from(x)).sum::<i64>();
                    assert_eq!(i64::from(sums(&rows, &std::vec![pair; n_pairs])[1]), exact, "{n} weights, kind {kind}");
                }
                assert_eq!(sums(&rows, &std::vec![0x7FFF_7FFF; n_pairs])[0], 0, "the other lanes");
            }
        }
    }
}
