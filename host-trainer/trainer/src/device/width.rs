//! The width of features for a bundle of so many bytes.

use pocketsplat_kernels::scene::{Head, Heads, ModelShape};

/// Widths to choose from, widest first.
const WIDTHS: [usize; 4] = [32, 24, 16, 8];
/// The heads of a model take at most this part of its bundle: lego at 80 px gains 4.3 dB at 20 kB by features of 16 in place of 50,
/// and 0.8 dB at 40 kB by 24 (`docs/experiments/2026-11-23-scenes-that-fill-a-budget.md`).
const HEADS_AT_MOST: u64 = 6;

/// The widest features up to those of `shape` whose heads leave room for a scene in `bytes`; the narrowest where none do.
pub fn widest_within(bytes: u64, shape: &ModelShape) -> usize {
    let of_heads = |feature_dim: usize| bytes_of_heads(&ModelShape { feature_dim, ..*shape });
    let widths = WIDTHS.into_iter().filter(|width| *width <= shape.feature_dim);
    let [.., narrowest] = WIDTHS;
    widths.clone().find(|width| HEADS_AT_MOST * of_heads(*width) <= bytes).unwrap_or(narrowest.min(shape.feature_dim))
}

/// Bytes that the heads of a model take in its bundle, about: one for each parameter.
pub fn bytes_of_heads(shape: &ModelShape) -> u64 {
    Heads::filled(shape, 0.0_f32).each().map(Head::n_params).sum::<usize>() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heads_take_a_sixth_at_most() {
        let shape = ModelShape::plain(32, 10);
        let widths = [5_000, 20_000, 40_000, 1_000_000].map(|bytes| widest_within(bytes, &shape));
        assert_eq!(widths, [8, 16, 24, 32]);
        assert!(widths.is_sorted());
        assert_eq!(widest_within(1_000_000, &ModelShape::plain(16, 10)), 16, "no wider than the model");
        assert_eq!(widest_within(1_000, &ModelShape::plain(4, 10)), 4);
    }
}
