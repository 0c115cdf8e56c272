//! Sums of products of 8-bit and 16-bit integers.

/// Adds `Σ weight·input` of two rows of weights, which are bytes of two's complement; wraps around.
///
/// Ends with the shortest of the slices.
///
/// # Budget
/// About 3 instructions a multiply-add; 1.8 with the assembly of a Cortex-M4 or M7, 1 to 2 on x86-64.
#[inline(always)]
#[must_use]
pub fn add_products_of_two_rows(sums: [i32; 2], [first, second]: [&[u8]; 2], inputs: &[i16]) -> [i32; 2] {
    // Order does not matter: integers add up the same in any.
    if cfg!(target_pointer_width = "64") {
        let [sum_a, sum_b] = sums;
        let n = first.len().min(second.len()).min(inputs.len());
        let [first, second] = [first, second].map(|row| row.get(..n).unwrap_or_default());
        let inputs = inputs.get(..n).unwrap_or_default();
        return [with_products(sum_a, (first, inputs)), with_products(sum_b, (second, inputs))];
    }
    // An input is fetched once for both.
    first.iter().zip(second).zip(inputs).fold(sums, |[sum_a, sum_b], ((&weight_a, &weight_b), &input)| {
        [sum_a.wrapping_add(product((&weight_a, &input))), sum_b.wrapping_add(product((&weight_b, &input)))]
    })
}

#[inline(always)]
fn product((&weight, &input): (&u8, &i16)) -> i32 {
    i32::from(weight as i8).wrapping_mul(i32::from(input))
}

/// `sum` with the products of a row and as many inputs, in turns of fixed lengths: these become instructions that multiply several numbers at once.
#[inline(always)]
fn with_products(sum: i32, row: (&[u8], &[i16])) -> i32 {
    let (sum, row) = in_turns::<32>(sum, row);
    let (sum, row) = in_turns::<8>(sum, row);
    in_turns::<1>(sum, row).0
}

/// `sum` with the products of all whole turns of `N`, and what is left of weights and inputs.
#[inline(always)]
fn in_turns<'r, const N: usize>(sum: i32, (weights, inputs): (&'r [u8], &'r [i16])) -> (i32, (&'r [u8], &'r [i16])) {
    let ((weights, weights_left), (inputs, inputs_left)) = (weights.as_chunks::<N>(), inputs.as_chunks::<N>());
    let sum = weights.iter().zip(inputs).fold(sum, |sum, (weights, inputs)| {
        sum.wrapping_add(weights.iter().zip(inputs).map(product).fold(0, i32::wrapping_add))
    });
    (sum, (weights_left, inputs_left))
}
