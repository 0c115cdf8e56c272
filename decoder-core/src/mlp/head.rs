//! A head in floats: hidden layer with ReLU, output layer of one block per offset.

use pocketsplat_format::DecodeError;
use pocketsplat_format::bundle::{HeadView, WeightReader};

use super::block::{Blocks, HeadWeights, continued};
use super::format::{F32, HeadFormat, MlpHead};
use super::pair::Role;
use super::weight;
use super::weight::LANES;
use crate::arena::Arena;

/// One head in floats; its output layer has blocks of `B` outputs.
#[derive(Clone, Copy)]
pub(crate) struct Head<'s, const B: usize> {
    pub(super) hidden: Hidden<'s>,
    pub(super) output: Blocks<'s, B>,
}

/// The hidden layer of a head.
#[derive(Clone, Copy)]
pub(super) struct Hidden<'s> {
    pub(super) blocks: Blocks<'s, LANES>,
    pub(super) n_units: usize,
}

/// Floats read floats.
impl HeadFormat for F32 {
    const READS_SUMS: bool = true;
    type Values<'v> = &'v [f32];
    type Head<'s, const B: usize> = Head<'s, B>;

    #[inline(always)]
    fn values(inputs: &mut [f32]) -> &[f32] {
        inputs
    }

    #[inline(always)]
    fn floats(inputs: &[f32]) -> Option<&[f32]> {
        Some(inputs)
    }
}

impl<'s, N, const B: usize> MlpHead<'s, N, B> for Head<'s, B>
where
    N: for<'v> HeadFormat<Values<'v> = &'v [f32]>,
{
    fn convert(
        arena: &mut Arena<'s>,
        _: Arena<'_>,
        kept_as: HeadWeights,
        head: &HeadView<'_>,
        weights: &mut WeightReader<'_>,
    ) -> Result<Self, DecodeError> {
        Self::convert(arena, kept_as, head, weights)
    }

    fn begin(&self, feature: &[f32], sums: &mut [f32]) {
        self.hidden.begin(feature, sums);
    }

    fn activate<'h>(&self, number: usize, inputs: &[f32], hidden: &'h mut [f32], role: &'h mut Role<'_>) -> &'h [f32] {
        self.hidden.activate(number, inputs, hidden, role)
    }

    #[inline(always)]
    fn block(&self, index: usize, hidden: &[f32]) -> Option<[f32; B]> {
        self.output.outputs(index, hidden)
    }

    fn takes_two(&self) -> bool {
        self.hidden.blocks.takes_two()
    }
}

impl Hidden<'_> {
    // Not inlined: one of it serves all heads.
    #[inline(never)]
    fn activate<'h>(&self, number: usize, inputs: &[f32], hidden: &'h mut [f32], role: &'h mut Role<'_>) -> &'h [f32] {
        if let Some(sums) = role.sums() {
            let (sums, n_in) = sums.of_head(number);
            self.go_on(sums, n_in, inputs.get(n_in..).unwrap_or_default(), hidden);
        } else if !self.blocks.takes_two() {
            self.blocks.rectify(inputs, hidden);
        } else if let Some((second_inputs, second)) = role.second(number, hidden.len()) {
            // Not zipped: blocks are of a length that the compiler does not know, and their number would be a division, which it may take
            // for one by zero.
            let mut blocks = self.blocks.halves();
            for (first, second) in hidden.as_chunks_mut::<LANES>().0.iter_mut().zip(second.as_chunks_mut::<LANES>().0) {
                let Some(block) = blocks.next() else { break };
                [*first, *second] = weight::sums_of_two(block, [inputs, second_inputs]);
            }
            self.finish(inputs, hidden);
            self.finish(second_inputs, second);
        } else if let Some(known) = role.known(number, hidden.len()) {
            return known.get(..self.n_units).unwrap_or_default();
        } else {
            // Rare: the last anchor of a chunk.
            hidden.fill(f32::NAN);
            self.finish(inputs, hidden);
        }
        hidden.get(..self.n_units).unwrap_or_default()
    }

    /// Fills `sums` with `b₁ + W₁·inputs`, of the first inputs alone.
    ///
    /// * `sums`: whole blocks.
    pub(super) fn begin(&self, inputs: &[f32], sums: &mut [f32]) {
        for (sums, block) in sums.as_chunks_mut::<LANES>().0.iter_mut().zip(self.blocks.floats()) {
            *sums = pocketsplat_half::outputs(block, inputs);
        }
    }

    /// Makes units of `sums`, as [`begin`](Self::begin) left them, and of the inputs behind the first `n_in`.
    // Inlined: the detail head's three inputs are no loop.
    #[inline(always)]
    pub(super) fn go_on(&self, sums: &[f32], n_in: usize, inputs: &[f32], hidden: &mut [f32]) {
        let units = hidden.as_chunks_mut::<LANES>().0.iter_mut();
        for ((units, sums), block) in units.zip(sums.as_chunks::<LANES>().0).zip(self.blocks.floats()) {
            // The row of biases, then one an input.
            let rows = block.get(1..).and_then(|rows| rows.get(n_in..)).unwrap_or_default();
            for (unit, sum) in units.iter_mut().zip(continued(*sums, rows, inputs)) {
                *unit = relu(sum);
            }
        }
    }

    /// Makes units of the sums of halves, which are not finite if an input was too large to be scaled.
    #[inline(never)]
    fn finish(&self, inputs: &[f32], units: &mut [f32]) {
        let units = units.get_mut(..self.n_units).unwrap_or_default();
        // 0 times a finite number is 0; times any other it is NaN, and so is every sum with NaN.
        let mut zero = 0.0;
        for unit in &mut *units {
            zero += 0.0 * *unit;
            *unit = relu(*unit);
        }
        if zero != 0.0 {
            let blocks = self.blocks.halves().flat_map(|block| (0..LANES).map(move |lane| (block, lane)));
            for (unit, (block, lane)) in units.iter_mut().zip(blocks) {
                *unit = relu(weight::unscaled(block.as_flattened(), lane, LANES, inputs));
            }
        }
    }
}

#[inline]
fn relu(sum: f32) -> f32 {
    if sum > 0.0 { sum } else { 0.0 }
}

impl<'s, const B: usize> Head<'s, B> {
    pub(super) fn convert(
        arena: &mut Arena<'s>,
        kept_as: HeadWeights,
        head: &HeadView<'_>,
        weights: &mut WeightReader<'_>,
    ) -> Result<Self, DecodeError> {
        Ok(Self {
            hidden: Hidden {
                blocks: Blocks::convert(arena, kept_as, weights.next_layer(), &head.b1, head.n_in)?,
                n_units: head.n_hidden,
            },
            output: Blocks::convert(arena, kept_as, weights.next_layer(), &head.b2, head.n_hidden)?,
        })
    }
}
