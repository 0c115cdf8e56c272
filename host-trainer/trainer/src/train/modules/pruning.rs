//! Opacity-based probabilistic pruning: fewer anchors for good, or an order in which a device may leave them out.

use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::{AnchorChange, Module, RunView};
use crate::train::error::TrainError;
use crate::train::schedule::{ConfigError, within};
use crate::train::streams::{Purpose, random};
use pocketsplat_kernels::ops::loss::opacity_target::forward_backward;
use pocketsplat_kernels::real::Real;
use pocketsplat_kernels::scene::{ModelShape, Scene};
use pocketsplat_kernels::step::{Block, DeviceTerms, StepInfo, Terms};

/// What the event does with the anchors it picks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Form {
    /// Deletes them (the paper).
    #[default]
    Hard,
    /// Deletes nothing: every anchor gets a prune rank, and each later step draws the scene without those below a random one, so that one scene is good at every pruning rate.
    Tiered,
}

/// Which anchors of the pool go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PoolChoice {
    /// Any, at random from the run's seed (the paper).
    #[default]
    Random,
    /// Those of the lowest rank.
    Lowest,
}

/// What anchors are ranked by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rank {
    /// Aggregated opacity: Σ of the opacities of its drawn Gaussians, mean over the views that see it (the paper).
    #[default]
    Opacity,
    /// Σ of α·T over the pixels of all training views: what it contributes to the images.
    Contribution,
    /// Squared error that its removal adds to the [probed](crate::train::worth::probed) training views, for each of its bits; needs a rate.
    Worth,
}

/// A loss that keeps opacities low, and one event that prunes by what is left of them (the plug-and-play paper, eq. 4 and
/// section 3.2).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Pruning {
    /// Weight of the opacity target. (The paper's is 1e-5. Divided by N it then leaves a third of lego's anchors and costs 4 dB.)
    pub weight: f64,
    /// β: the target is β·N, N being all K Gaussians of the visible anchors.
    pub beta: f64,
    /// Share of the run from which on the target counts.
    pub from: f64,
    /// Share of the run after which the event comes.
    pub at: f64,
    /// What the event does.
    pub form: Form,
    /// Share that goes; with [`Form::Tiered`] the deepest tier's.
    pub rate: f64,
    /// Share of the anchors, lowest ranks first, from which the choice is made. Beyond it the rank decides.
    pub pool: f64,
    /// Which of the pool.
    pub choice: PoolChoice,
    /// What anchors are ranked by.
    pub rank: Rank,
}

impl Default for Pruning {
    fn default() -> Self {
        Self {
            weight: 1e-7,
            beta: 1e-3,
            from: 1_500.0 / 30_000.0,
            at: 15_000.0 / 30_000.0,
            form: Form::Hard,
            rate: 0.3,
            pool: 0.4,
            choice: PoolChoice::Random,
            rank: Rank::Opacity,
        }
    }
}

/// Shares of [`Pruning::rate`] that steps leave out under [`Form::Tiered`]; of 40 % they are 40, 30, 20, 10 and 5 %.
const TIER_SHARES: [f64; 5] = [1.0, 0.75, 0.5, 0.25, 0.125];
/// Draws of an iteration's stream: whether it takes all anchors, and if not, which tier.
const WHOLE_DRAW: u32 = 0x5449_4552;
const TIER_DRAW: u32 = WHOLE_DRAW + 1;

impl Pruning {
    /// [`Form::Tiered`] as it measures best: in the order of contribution. (A random choice within the pool, as the paper
    /// deletes it, takes anchors that matter from the scene that is left.)
    pub fn tiered() -> Self {
        let hard = Self::default();
        Self { form: Form::Tiered, rate: hard.pool, rank: Rank::Contribution, choice: PoolChoice::Lowest, ..hard }
    }

    /// The prune rank of every anchor, 0 to 1: the share of the anchors that goes before it.
    ///
    /// Those of the pool are shuffled, all others follow their scores; equal scores keep their order.
    ///
    /// * `scores`: `[n]`, low goes first.
    fn prune_ranks(&self, scores: &[f32], rng: &mut ChaCha8Rng) -> Vec<f32> {
        let n = scores.len();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|a, b| scores[*a].total_cmp(&scores[*b]));
        if self.choice == PoolChoice::Random {
            order[..of_length(self.pool, n)].shuffle(rng);
        }
        let mut ranks = vec![0.0; n];
        for (prune_rank, anchor) in order.into_iter().enumerate() {
            ranks[anchor] = as_prune_rank(prune_rank as f64 / n as f64);
        }
        ranks
    }
}

/// A share as anchors' [prune ranks](pocketsplat_kernels::scene::Anchors::prune_rank) are kept, so that it compares equal with them.
#[expect(clippy::cast_possible_truncation, reason = "ranks are f32")]
fn as_prune_rank(share: f64) -> f32 {
    share as f32
}

/// A share of `n` items, to the nearest; at most all of them.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a length")]
fn of_length(share: f64, n: usize) -> usize {
    ((share * n as f64).round() as usize).min(n)
}

impl Module for Pruning {
    fn check(&self) -> Result<(), ConfigError> {
        within("train.modules.pruning.weight", self.weight, 0.0, 1e6)?;
        within("train.modules.pruning.beta", self.beta, 0.0, 1.0)?;
        within("train.modules.pruning.from", self.from, 0.0, 1.0)?;
        within("train.modules.pruning.at", self.at, 0.0, 1.0)?;
        within("train.modules.pruning.pool", self.pool, 0.0, 1.0)?;
        let most = if self.form == Form::Hard { self.pool } else { 0.95 };
        within("train.modules.pruning.rate", self.rate, 0.0, most)
    }

    fn is_due(&self, at: &StepInfo) -> bool {
        at.is_at(self.at)
    }

    fn event(&self, at: &StepInfo, run: &RunView<'_>) -> Result<Option<AnchorChange>, TrainError> {
        if !at.is_at(self.at) || run.scene().anchors.is_empty() {
            return Ok(None);
        }
        let scores = match self.rank {
            Rank::Opacity => run.visibility(false).opacity_per_view(),
            Rank::Contribution => run.visibility(true).contribution,
            Rank::Worth => run.worth()?.per_bit(),
        };
        let ranks = self.prune_ranks(&scores, &mut random(run.seed(), Purpose::Ranks, at.iteration));
        Ok(Some(match self.form {
            Form::Tiered => AnchorChange::Rank(ranks),
            Form::Hard => {
                AnchorChange::Keep(ranks.iter().map(|prune_rank| *prune_rank >= as_prune_rank(self.rate)).collect())
            }
        }))
    }

    fn weighs_bits_at(&self) -> Option<(&'static str, f64)> {
        (self.rank == Rank::Worth).then_some(("train.modules.pruning.at", self.at))
    }

    fn pruned_share(&self, at: &StepInfo) -> f32 {
        if self.form != Form::Tiered || !at.is_after(self.at) || at.stream.uniform(WHOLE_DRAW) < 0.5 {
            return 0.0;
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below the number of shares")]
        let tier = (at.stream.uniform(TIER_DRAW) * TIER_SHARES.len() as f32) as usize;
        as_prune_rank(self.rate * TIER_SHARES[tier])
    }
}

impl<R: Real> Terms<R> for Pruning {
    fn on_device(&self, at: &StepInfo, _shape: &ModelShape, terms: &mut DeviceTerms) -> bool {
        if at.is_after(self.from) {
            terms.opacity_target = [self.beta, self.weight];
        }
        true
    }

    fn on_gaussians(&self, at: &StepInfo, scene: &Scene<R>, blocks: &mut [Block<R>]) -> R {
        if self.weight == 0.0 || !at.is_after(self.from) {
            return R::ZERO;
        }
        let n = blocks.iter().map(|b| b.anchors.len() * scene.shape.n_offsets).sum::<usize>();
        let sum: R = blocks.iter().map(|b| b.gaussians.iter().map(|g| g.opacity).sum::<R>()).sum();
        let target = R::real(self.beta * n as f64);
        let (term, slope) = forward_backward(sum, n, target, R::real(self.weight));
        for d in blocks.iter_mut().flat_map(|b| &mut b.d_gaussians) {
            d.opacity += slope;
        }
        term
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;
    use crate::train::modules::Modules;
    use crate::train::test_capture::{tiny_capture, tiny_config};
    use crate::train::{TrainConfig, Trainer};

    fn prune_ranks(pruning: &Pruning, rank: &[f32], seed: u64) -> Vec<f32> {
        pruning.prune_ranks(rank, &mut ChaCha8Rng::seed_from_u64(seed))
    }

    #[test]
    fn the_pool_goes_at_random_and_the_rest_by_rank() {
        let rank: Vec<f32> = (0..100).map(|i| ((i * 37) % 100) as f32).collect();
        let random = prune_ranks(&Pruning::default(), &rank, 1);
        let mut sorted = random.clone();
        sorted.sort_by(f32::total_cmp);
        assert!(sorted.iter().enumerate().all(|(i, prune_rank)| *prune_rank == i as f32 / 100.0), "every rank once");
        for (prune_rank, rank) in random.iter().zip(&rank) {
            assert_eq!(*prune_rank < 0.4, *rank < 40.0, "the pool is the lowest ranks");
            assert!(*rank < 40.0 || (prune_rank - rank / 100.0).abs() < 1e-6, "beyond it the rank decides");
        }
        assert_ne!(random, prune_ranks(&Pruning::default(), &rank, 2));
        let lowest = prune_ranks(&Pruning { choice: PoolChoice::Lowest, ..Pruning::default() }, &rank, 1);
        assert!(lowest.iter().zip(&rank).all(|(prune_rank, rank)| (prune_rank - rank / 100.0).abs() < 1e-6));
        assert!(prune_ranks(&Pruning::default(), &[], 1).is_empty());
    }

    /// Trains the tiny capture to its end with a pruning module; returns anchors before and after the event, and the
    /// ranks.
    fn run(pruning: Pruning) -> ([usize; 2], Vec<f32>) {
        let capture = tiny_capture();
        let modules = Modules { pruning: Some(pruning), ..Modules::default() };
        let mut config = TrainConfig { modules, ..tiny_config(40) };
        config.densification.until = 0.45;
        let mut trainer = Trainer::new(&capture, config).unwrap();
        let mut before = 0;
        while !trainer.is_done() {
            if trainer.state.iteration == 19 {
                before = trainer.state.learned.scene.anchors.len();
            }
            trainer.advance().unwrap();
        }
        ([before, trainer.state.learned.scene.anchors.len()], trainer.state.learned.scene.anchors.prune_rank.clone())
    }

    #[test]
    fn hard_pruning_takes_its_share_once() {
        for rank in [Rank::Opacity, Rank::Contribution] {
            let ([before, after], _) = run(Pruning { rank, rate: 0.3, ..Pruning::default() });
            assert!(before > 10 && (after as f64 - 0.7 * before as f64).abs() <= 1.0, "{before} anchors, then {after}");
        }
    }

    #[test]
    fn tiered_pruning_deletes_nothing_and_steps_leave_out_what_their_place_says() {
        let pruning = Pruning { form: Form::Tiered, rate: 0.4, ..Pruning::default() };
        let ([before, after], ranks) = run(pruning);
        assert_eq!((before, ranks.len()), (after, after));
        let info = |iteration| StepInfo {
            iteration,
            iterations: 40,
            phase: pocketsplat_kernels::step::Phase::Raw,
            scaled: true,
            stream: pocketsplat_kernels::ops::rate::noise::Stream::of_run(3).branch(iteration),
        };
        assert!((1..=20).all(|iteration| pruning.pruned_share(&info(iteration)) == 0.0));
        let shares: Vec<f32> = (21..4021).map(|iteration| pruning.pruned_share(&info(iteration))).collect();
        let n_whole = shares.iter().filter(|share| **share == 0.0).count();
        assert!((1900..2100).contains(&n_whole), "half of the steps see all anchors: {n_whole}");
        for share in TIER_SHARES {
            let n = shares.iter().filter(|s| **s == (0.4 * share) as f32).count();
            assert!((340..460).contains(&n), "each tier as often as the others: {n}");
        }
    }
}
