//! Random numbers by what they decide. What one purpose draws changes nothing of another: a variant that grows one anchor more sees the
//! same views in the same order.

use pocketsplat_kernels::ops::rate::noise::Stream;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// What random numbers decide, besides the noise of an iteration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// The scene that a run starts with.
    Start,
    /// The order of the views in a pass over the capture.
    Views,
    /// Where explicit Gaussians are split.
    Split,
    /// The context model as it starts.
    Context,
    /// Which anchors share a rank of pruning.
    Ranks,
}

/// The numbers of one purpose at one iteration.
pub(crate) fn random(seed: u64, purpose: Purpose, iteration: u32) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(u64::from(purpose as u32) << 32 | u64::from(iteration));
    rng
}

/// The luck of growth at one iteration, a branch for each lattice cell: the anchors of two runs have the same wherever both have them.
pub(crate) fn growth(seed: u64, iteration: u32) -> Stream {
    // Noise has the branches of iterations, and no run has so many.
    Stream::of_run(seed).branch(u32::MAX).branch(iteration)
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::*;

    #[test]
    fn seeds_purposes_and_iterations_differ_and_nothing_else_does() {
        let first = |seed, purpose, iteration| random(seed, purpose, iteration).random::<u64>();
        let purposes = [Purpose::Start, Purpose::Views, Purpose::Split, Purpose::Context, Purpose::Ranks];
        let all = [1, 2].into_iter().flat_map(|seed| {
            purposes.into_iter().flat_map(move |purpose| [0, 1, u32::MAX].map(|at| first(seed, purpose, at)))
        });
        let distinct: std::collections::HashSet<u64> = all.collect();
        assert_eq!(distinct.len(), 2 * 5 * 3);
        assert_eq!(first(7, Purpose::Views, 3), first(7, Purpose::Views, 3));
        assert_ne!(growth(1, 100), growth(1, 200));
        assert_ne!(growth(1, 100), Stream::of_run(1).branch(100));
    }
}
