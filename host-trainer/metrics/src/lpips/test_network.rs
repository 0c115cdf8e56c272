//! A network as deep as VGG16 and much narrower, for properties that hold whatever the weights are.

use super::conv::Conv3x3;
use super::{InputRange, Lpips, Stage};

/// Numbers in [−1, 1) from a seed, one per call.
pub(super) fn noise(seed: u32) -> impl FnMut() -> f32 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 23) as f32 - 1.0
    }
}

impl Lpips {
    /// Five stages with random weights.
    pub(super) fn narrow(range: InputRange) -> Self {
        let mut draw = noise(3);
        let mut values = |n: usize| (0..n).map(|_| draw()).collect::<Vec<f32>>();
        let mut n_in = 3;
        let mut stage = |n_convolutions: usize, n_out: usize| {
            let convolutions = (0..n_convolutions).map(|_| {
                let convolution = Conv3x3::new(n_in, &values(n_out * n_in * 9), values(n_out));
                n_in = n_out;
                convolution
            });
            let convolutions = convolutions.collect();
            Stage { convolutions, head: values(n_out).into_iter().map(f32::abs).collect() }
        };
        let stages = [(2, 8), (2, 8), (3, 12), (3, 12), (3, 12)].map(|(n, n_out)| stage(n, n_out));
        Self { stages: stages.into(), range }
    }
}
