//! How much of a scene stays, and at which weight of the bits, so that its bundle fits.

use super::LimitShares;

/// Share of the limits to aim at: a little too much is cut in the end, but nothing grows any more where there is too little.
const AIM: f64 = 1.02;
/// How an event looks for it.
const FITTING: Search = Search { tolerance: 0.01, most_trials: 5 };
/// The bytes of an anchor go with λ to the power of −0.35 (`docs/method.md`).
const POWER_OF_LAMBDA: f64 = 0.35;
/// After the last event too few steps are left for them to follow: λ lowered to a sixth filled 5 to 8 % more.
const POWER_IN_THE_END: f64 = 0.05;
/// Farthest that one step changes λ, as a factor.
const LARGEST_FACTOR: f64 = 16.0;

/// What fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Anchors that are to stay in the end; before the last event more do.
    pub n_anchors: usize,
    /// λ from here on, and until now.
    pub lambda: f64,
    /// See `lambda`.
    pub former_lambda: f64,
    /// What they take as they are.
    pub shares: LimitShares,
}

impl Fit {
    /// Anchors that would fill the bytes at the former λ; never fewer than stay.
    pub(in crate::train) fn n_that_fill(&self) -> usize {
        let more = if self.shares.bytes > 0.0 { AIM / self.shares.bytes } else { 1.0 };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of anchors")]
        let n = (self.n_anchors as f64 * more.max(1.0)).round() as usize;
        n
    }
}

/// Shares of the run after which the weight alone is looked at again, once nothing is pruned any more: bytes follow it slowly.
pub(in crate::train) const REWEIGHED_AT: [f64; 3] = [0.75, 0.8, 0.85];

/// A scene of `n_anchors`, and the weight at which it is expected to fill its bytes; the present one where these have no limit.
///
/// * `lambda`: the present weight. * `shares`: what the scene takes at it.
pub(in crate::train) fn reweighed(n_anchors: usize, lambda: f64, shares: LimitShares) -> Fit {
    let factor = match shares.bytes {
        0.0 => 1.0,
        bytes => (bytes / AIM).powf(1.0 / POWER_OF_LAMBDA).clamp(1.0 / LARGEST_FACTOR, LARGEST_FACTOR),
    };
    Fit { n_anchors, lambda: lambda * factor, former_lambda: lambda, shares }
}

/// The most of `n` anchors that fit, and the weight λ at which their bytes do.
///
/// Fewer anchors and a larger λ both save bytes. They go together, at the strength of pruning that the new λ asks for; the bytes of
/// an anchor are expected to follow λ^−0.35. What a decoder needs follows from the anchors alone.
///
/// * `lambda`: the present weight. * `last`: whether nothing is pruned any more afterwards, so that anchors have to fill the bytes.
/// * `strength_for`: multiple of λ at which pruning leaves so many anchors, or fewer. * `shares`: what that scene takes.
///
/// # Errors
/// Those of `shares`.
pub(in crate::train) fn fit<E>(
    n: usize,
    lambda: f64,
    last: bool,
    strength_for: impl Fn(usize) -> f64,
    mut shares: impl FnMut(usize) -> Result<LimitShares, E>,
) -> Result<Fit, E> {
    let mut tried: Vec<(usize, LimitShares)> = Vec::new();
    let mut shares_of = |n: usize| match tried.iter().find(|(known, _)| *known == n) {
        Some((_, known)) => Ok(*known),
        None => shares(n).inspect(|found| tried.push((n, *found))),
    };
    let power = if last { POWER_IN_THE_END } else { POWER_OF_LAMBDA };
    let later = |strength: f64| strength.clamp(1.0 / LARGEST_FACTOR, LARGEST_FACTOR).powf(-power);
    let n_of_bytes = FITTING.largest(n, |n| Ok(shares_of(n)?.bytes / AIM * later(strength_for(n))))?;
    let n_anchors = FITTING.largest(n_of_bytes, |n| Ok(shares_of(n)?.drawing() / AIM))?;
    Ok(reweighed(n_anchors, lambda, shares_of(n_anchors)?))
}

/// A search among numbers of anchors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Search {
    /// What may be left of the limit.
    pub(crate) tolerance: f64,
    /// Scenes that are tried.
    pub(crate) most_trials: usize,
}

impl Search {
    /// About the largest number up to `n` whose share is at most 1, on straight lines between logarithms; `n` itself where it is.
    ///
    /// Where no number that was tried is good enough it is the smallest of them.
    ///
    /// # Errors
    /// Those of `share`.
    pub(crate) fn largest<E>(&self, n: usize, mut share: impl FnMut(usize) -> Result<f64, E>) -> Result<usize, E> {
        let (mut too_many, mut fits): ((usize, f64), Option<(usize, f64)>) = ((n, share(n)?), None);
        if too_many.1 <= 1.0 {
            return Ok(n);
        }
        // Proportional at first, and more careful with every trial that was still too much.
        let mut slope = 1.0;
        for _ in 1..self.most_trials {
            let (n_above, above) = (too_many.0 as f64, too_many.1.ln());
            if let Some((n_below, below)) = fits {
                slope = ((above - below.ln()) / (n_above / n_below as f64).ln()).max(0.1);
            }
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of anchors")]
            let next = (n_above * (-(above + 0.5 * self.tolerance) / slope).exp()) as usize;
            let next = next.clamp(fits.map_or(1, |(n, _)| n), too_many.0.max(2) - 1);
            if next >= too_many.0 || fits.is_some_and(|(n, _)| next == n) {
                break;
            }
            let found = share(next)?;
            if found > 1.0 {
                too_many = (next, found);
                slope *= 0.7;
            } else {
                fits = Some((next, found));
                if found >= 1.0 - self.tolerance {
                    break;
                }
            }
        }
        Ok(fits.map_or(too_many.0, |(n, _)| n))
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    /// A scene whose decoder takes 1 for 1,000 anchors and a tenth more, and whose bundle 1 for `per_byte`.
    fn fitted(n: usize, per_byte: f64, strength_for: impl Fn(usize) -> f64) -> Fit {
        fitted_at(n, per_byte, false, strength_for)
    }

    fn fitted_at(n: usize, per_byte: f64, last: bool, strength_for: impl Fn(usize) -> f64) -> Fit {
        let mut n_trials = 0;
        let load = |n: usize| -> Result<LimitShares, Infallible> {
            n_trials += 1;
            Ok(LimitShares {
                ram: 0.1 + 0.9e-3 * n as f64,
                instructions: 0.5e-3 * n as f64,
                bytes: n as f64 / per_byte,
            })
        };
        let found = fit(n, 0.002, last, strength_for, load).unwrap();
        assert!(n_trials <= 2 * FITTING.most_trials, "{n_trials} trials");
        found
    }

    #[test]
    fn memory_alone_decides_about_anchors() {
        let fit = fitted(3000, f64::INFINITY, |_| 1.0);
        assert!((fit.shares.ram / AIM - 1.0).abs() <= FITTING.tolerance, "{fit:?}");
        assert_eq!(fit.lambda, 0.002);
        assert_eq!(fitted(700, f64::INFINITY, |_| 1.0).n_anchors, 700, "what fits stays");
    }

    #[test]
    fn bytes_are_saved_by_anchors_and_rate_together() {
        // Half as many anchors are left at four times the strength.
        let strength = |n: usize| (1000.0 / n as f64).powi(2);
        let fit = fitted(900, 500.0, strength);
        assert!(fit.n_anchors > 500 * 102 / 100, "rate saves a part: {fit:?}");
        let factor = fit.lambda / 0.002;
        assert!((factor / strength(fit.n_anchors) - 1.0).abs() < 0.1, "one weight for both: {fit:?}");
        let bytes = fit.shares.bytes * factor.powf(-POWER_OF_LAMBDA);
        assert!((bytes / AIM - 1.0).abs() < 1e-9, "{bytes}");
    }

    #[test]
    fn the_last_anchors_fill_the_bytes() {
        // Balanced, a scene that was pruned before would give up anchors for a smaller λ.
        let strength = |n: usize| if n >= 510 { 0.0 } else { (400.0 / n as f64).powi(2) };
        let [balanced, last] = [false, true].map(|last| fitted_at(510, 500.0, last, strength));
        assert!(balanced.shares.bytes < 0.85 * AIM, "{balanced:?}");
        assert!(last.shares.bytes > 0.9 * AIM, "{last:?}");
    }

    #[test]
    fn bytes_that_memory_leaves_over_go_into_the_rate() {
        let fit = fitted(3000, 2000.0, |_| 1.0);
        assert!((fit.shares.ram / AIM - 1.0).abs() <= FITTING.tolerance, "{fit:?}");
        assert!(fit.lambda < 0.002 && fit.lambda > 0.002 / LARGEST_FACTOR, "{fit:?}");
    }

    #[test]
    fn a_limit_that_nothing_keeps_leaves_little_and_ends() {
        let never = fit(
            1000,
            0.002,
            false,
            |_| 1.0,
            |_| Ok::<_, Infallible>(LimitShares { ram: 3.0, ..LimitShares::default() }),
        )
        .unwrap();
        assert!(never.n_anchors >= 1 && never.n_anchors < 100, "{never:?}");
    }
}
