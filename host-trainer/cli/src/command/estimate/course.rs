//! How anchors and the time of a step go over a run.

/// Anchors that growth adds, for each pixel of an image, where the loss is 1: they go with the loss after the trial to the power of
/// [`GROWTH_POWER`] (docs/experiments/2026-11-28-estimates.md).
const GROWTH_OF_LOSS: f64 = 10.0;
const GROWTH_POWER: f64 = 2.3;
/// Iterations that this takes; a shorter run adds the root of its share.
const GROWN_AFTER: f64 = 7000.0;
/// Pruning leaves this share over that loss of the anchors at the end of growth, within [`LEFT`].
const LEFT_OVER_LOSS: f64 = 0.045;
const LEFT: [f64; 2] = [0.2, 0.75];
/// The time of a step goes with the number of anchors to this power.
const POWER_OF_ANCHORS: f64 = 0.7;

/// How a run goes on, against the last steps of its trial.
pub(super) struct Course {
    /// Time of a step at [`SHARES`] of the run.
    pub(super) cost: [f64; SHARES.len()],
    /// Anchors at these.
    pub(super) anchors: [f64; SHARES.len()],
}

/// Shares of a run: growth goes on up to half of it, then rate–distortion pruning takes its first part.
pub(super) const SHARES: [f64; 8] = [0.0, 0.1, 0.2, 0.35, 0.5, 0.51, 0.65, 1.0];
/// The number of those before pruning.
pub(super) const BEFORE_PRUNING: usize = 5;

/// From points drawn at random, as runs of Synthetic-NeRF went (docs/experiments/2026-11-22-train-without-options.md).
pub(super) const FROM_RANDOM: Course =
    Course { cost: [1.0, 1.0, 2.7, 5.3, 7.0, 3.6, 3.4, 3.4], anchors: [1.0, 0.6, 3.0, 3.5, 3.8, 1.7, 1.5, 1.5] };

impl Course {
    /// From points of the scene.
    ///
    /// * `n`: anchors, and * `loss`: after the trial. * `n_pixels`: of an image.
    pub(super) fn from_points(n: f64, loss: f64, n_pixels: f64, iterations: u32) -> Self {
        let grown_share = (f64::from(iterations) / GROWN_AFTER).min(1.0).sqrt();
        let added = grown_share * GROWTH_OF_LOSS * loss.powf(GROWTH_POWER) * n_pixels / n.max(1.0);
        let left = (LEFT_OVER_LOSS / loss).clamp(LEFT[0], LEFT[1]) * (1.0 + added);
        let grown = |share: f64| 1.0 + share * added;
        let anchors = [1.0, grown(0.1), grown(0.4), grown(0.7), grown(1.0), 1.15 * left, 1.15 * left, left];
        Self { cost: anchors.map(|n| n.powf(POWER_OF_ANCHORS)), anchors }
    }

    /// The same where nothing is pruned by rate and distortion.
    pub(super) fn unpruned(&self) -> Self {
        let goes_on = |values: &[f64; SHARES.len()]| {
            std::array::from_fn(|i| values[if i < BEFORE_PRUNING { i } else { BEFORE_PRUNING - 1 }])
        };
        Self { cost: goes_on(&self.cost), anchors: goes_on(&self.anchors) }
    }
}

/// The value at share `at` on straight lines between [`SHARES`].
pub(super) fn between(values: &[f64; SHARES.len()], at: f64) -> f64 {
    let next = SHARES.partition_point(|share| *share < at).clamp(1, SHARES.len() - 1);
    let (from, to) = (SHARES[next - 1], SHARES[next]);
    values[next - 1] + (values[next] - values[next - 1]) * (at - from) / (to - from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_between_shares() {
        let values = [1.0, 2.0, 4.0, 4.0, 4.0, 4.0, 4.0, 8.0];
        let at = |share: f64| between(&values, share);
        assert_eq!(
            [0.0, 0.1, 0.15, 0.5, 0.825, 1.0].map(|share| (8.0 * at(share)).round() / 8.0),
            [1.0, 2.0, 3.0, 4.0, 6.0, 8.0]
        );
    }

    #[test]
    fn what_is_drawn_badly_after_the_trial_grows() {
        // 10·0.1^2.3 = 0.05 of 100,000 pixels; 0.45 of the sum is left.
        let course = Course::from_points(5000.0, 0.1, 1e5, 30_000);
        let close = |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 0.01, "{found}, {expected}");
        close(course.anchors[4], 2.002);
        close(course.anchors[7], 0.901);
        close(course.cost[4], 2.002f64.powf(0.7));
        // A run of a quarter of 7,000 steps adds half.
        close(Course::from_points(5000.0, 0.1, 1e5, 1750).anchors[4], 1.501);
        // All but nothing is left to grow, and three quarters stay.
        close(Course::from_points(5000.0, 0.01, 1e5, 30_000).anchors[7], 0.75);
    }
}
