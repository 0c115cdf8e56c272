//! Heads of chosen weights.

use pocketsplat_format::bundle::Effects;

use super::models::TableDraft;
use super::numbers::Numbers;
use super::stream::words;

/// `y = W2·relu(W1·x + b1) + b2`, row-major, in units of [`UNIT`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HeadDraft {
    /// `[H, n_in]`, `[H]`, `[n_out, H]`, `[n_out]`.
    pub w1: Vec<i16>,
    #[expect(missing_docs, reason = "above")]
    pub b1: Vec<i16>,
    #[expect(missing_docs, reason = "above")]
    pub w2: Vec<i16>,
    #[expect(missing_docs, reason = "above")]
    pub b2: Vec<i16>,
    #[expect(missing_docs, reason = "above")]
    pub n_in: usize,
    #[expect(missing_docs, reason = "above")]
    pub n_hidden: usize,
}

/// What a weight of one step is; all of up to 2048 steps are halves.
pub const UNIT: f32 = 1.0 / 64.0;

/// Widths that heads follow from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Widths {
    /// F.
    pub features: usize,
    /// K.
    pub offsets: usize,
    /// Of the colour head.
    pub colour_hidden: usize,
    /// Of the detail head, 0 without.
    pub detail_hidden: usize,
}

/// `[n_in, H, n_out]` of each head.
pub fn shapes(widths: Widths, effects: Effects) -> Vec<[usize; 3]> {
    let Widths { features: f, offsets: k, colour_hidden, detail_hidden } = widths;
    let n_in = |direction: bool| f + usize::from(effects.view_distance) + if direction { 3 } else { 0 };
    let geometry = n_in(effects.view_geometry);
    let mut shapes = vec![
        [geometry, f, k],
        [geometry, f, if effects.anisotropic { 7 * k } else { k }],
        [n_in(effects.view_colour), colour_hidden, 3 * k],
    ];
    if effects.detail {
        shapes.push([f + 3, detail_hidden, 3]);
    }
    shapes
}

/// Heads of weights up to a half and some more where there are few inputs.
pub fn random(widths: Widths, effects: Effects, numbers: &mut Numbers) -> Vec<HeadDraft> {
    let mut some = |n: usize, reach: i32| numbers.many(n, -reach, reach).into_iter().map(|x| x as i16).collect();
    shapes(widths, effects)
        .into_iter()
        .map(|[n_in, n_hidden, n_out]| HeadDraft {
            w1: some(n_hidden * n_in, 48),
            b1: some(n_hidden, 24),
            w2: some(n_out * n_hidden, 64),
            b2: some(n_out, 32),
            n_in,
            n_hidden,
        })
        .collect()
}

/// The section without feature 5.
pub fn plain_section(heads: &[HeadDraft]) -> Vec<u8> {
    let arrays = heads.iter().flat_map(|head| [&head.w1, &head.b1, &head.w2, &head.b2]);
    arrays.flatten().flat_map(|&steps| half(steps).to_le_bytes()).collect()
}

/// The section with feature 5.
///
/// * `tables`: of W1 and of W2; those of the weights' own statistics where none are given.
pub fn coded_section(heads: &[HeadDraft], tables: Option<[TableDraft; 2]>) -> Vec<u8> {
    let tables = tables.unwrap_or_else(|| {
        let counting = |weights: Vec<i16>| {
            let range = [weights.iter().min(), weights.iter().max()].map(|end| *end.expect("weights"));
            TableDraft::counting(UNIT, range, weights.into_iter())
        };
        [
            counting(heads.iter().flat_map(|head| head.w1.clone()).collect()),
            counting(heads.iter().flat_map(|head| head.w2.clone()).collect()),
        ]
    });
    let mut bytes = tables.each_ref().map(TableDraft::bytes).concat();
    let biases = heads.iter().flat_map(|head| [&head.b1, &head.b2]).flatten();
    bytes.extend(biases.flat_map(|&steps| half(steps).to_le_bytes()));
    let [of_w1, of_w2] = &tables;
    let slots = heads.iter().flat_map(|head| {
        let [w1, w2] = [(&head.w1, of_w1), (&head.w2, of_w2)];
        [w1, w2].into_iter().flat_map(|(weights, table)| weights.iter().flat_map(|&weight| table.slots(weight)))
    });
    bytes.extend(words(&slots.collect::<Vec<_>>()));
    bytes
}

/// The half of `steps` units, which is exact.
fn half(steps: i16) -> u16 {
    let Some(top) = steps.unsigned_abs().checked_ilog2() else { return 0 };
    assert!(top < 11, "{steps} steps are not a half");
    // A half has an exponent of bias 15 and ten bits of fraction; a unit is 2⁻⁶.
    let fraction = (steps.unsigned_abs() << (10 - top)) & 0x3FF;
    u16::from(steps < 0) << 15 | (top as u16 + 15 - 6) << 10 | fraction
}

#[cfg(test)]
mod tests {
    use super::half;

    #[test]
    fn steps_are_halves() {
        for (steps, bits) in
            [(0, 0), (64, 0x3C00), (-64, 0xBC00), (32, 0x3800), (96, 0x3E00), (1, 0x2400), (-2047, 0xCFFF)]
        {
            assert_eq!(half(steps), bits, "{steps}/64");
        }
    }
}
