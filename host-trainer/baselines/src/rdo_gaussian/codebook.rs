//! Entropy-constrained vector quantisation (Chou, Lookabaugh and Gray 1989): codes that take few bits where there are many vectors.
//!
//! A code k has the probability p = softmax(l), and so −log₂ p(k) bits. The code of x is argmin_k ‖x − c(k)‖² + λ·(−log₂ p(k)).

use std::f64::consts::LN_2;

use pocketsplat_kernels::ops::adam::{self, Moments, Step};
use pocketsplat_kernels::real::Real;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use crate::k_means::cheapest;

/// Codes at most.
pub(super) const CODES: usize = 1024;

/// Vectors that a code has to stand for on average: fewer are not worth its numbers in the file.
const VECTORS_PER_CODE: usize = 32;

/// Rounds of the generalised Lloyd algorithm with which codes begin.
const ROUNDS: usize = 10;

/// Of vectors that no code has seen: what stands in for a count of 0.
const HARDLY_ANY: f32 = 0.5;

/// K codes that learn, and how likely each is.
#[derive(Clone, Debug)]
pub(super) struct Codebook {
    pub(super) width: usize,
    /// `[K, width]` c.
    pub(super) codes: Vec<f32>,
    /// `[K]` l.
    pub(super) logits: Vec<f32>,
    of_codes: Moments<f32>,
    of_logits: Moments<f32>,
    n_steps: u32,
}

/// −log₂ softmax(l) `[K]`.
pub(super) fn bits<R: Real>(logits: &[R]) -> Vec<R> {
    let most = logits.iter().fold(R::real(-1e30), |most, l| most.larger(*l));
    let ln_sum = logits.iter().fold(R::ZERO, |sum, l| sum + (*l - most).exp()).ln() + most;
    logits.iter().map(|l| (ln_sum - *l) * R::real(1.0 / LN_2)).collect()
}

/// dR/dl `[K]` of the bits R = Σ n(k)·(−log₂ p(k)) of all vectors: (Σn·p(k) − n(k))/ln 2.
///
/// * `counts`: `[K]` n.
fn d_logits<R: Real>(logits: &[R], counts: &[R]) -> Vec<R> {
    let total = counts.iter().fold(R::ZERO, |sum, n| sum + *n);
    let p = bits(logits).into_iter().map(|bits| (-bits * R::real(LN_2)).exp());
    p.zip(counts).map(|(p, n)| (total * p - *n) * R::real(1.0 / LN_2)).collect()
}

impl Codebook {
    /// Codes that begin as vectors drawn at random, and follow the generalised Lloyd algorithm: vectors choose, codes become their means, and
    /// probabilities their shares. Cost: `n · K · width` products a round.
    ///
    /// * `vectors`: `[n, width]`, finite. * `price`: λ.
    pub(super) fn new(width: usize, vectors: &[f32], price: f32, rng: &mut ChaCha8Rng) -> Self {
        let mut order: Vec<&[f32]> = vectors.chunks_exact(width).collect();
        order.shuffle(rng);
        order.truncate(order.len().div_ceil(VECTORS_PER_CODE).min(CODES));
        let (codes, logits) = (order.concat(), vec![0.0; order.len()]);
        let [of_codes, of_logits] = [&codes, &logits].map(|values| Moments::zeros(values.len()));
        let mut book = Self { width, codes, logits, of_codes, of_logits, n_steps: 0 };
        for _ in 0..ROUNDS {
            let chosen = book.choose(vectors, price);
            book.centre(|| chosen.iter().copied().zip(vectors.chunks_exact(width)));
            let counts = book.counts(chosen.into_iter());
            book.logits = counts.into_iter().map(|n| n.max(HARDLY_ANY).ln()).collect();
        }
        book
    }

    /// The code of each vector. Cost: `n · K · width` products.
    pub(super) fn choose(&self, vectors: &[f32], price: f32) -> Vec<u16> {
        let costs: Vec<f32> = bits(&self.logits).into_iter().map(|bits| price * bits).collect();
        let chosen = match self.width {
            3 => cheapest::<3>(vectors.as_chunks().0, self.codes.as_chunks().0, &costs),
            4 => cheapest::<4>(vectors.as_chunks().0, self.codes.as_chunks().0, &costs),
            9 => cheapest::<9>(vectors.as_chunks().0, self.codes.as_chunks().0, &costs),
            15 => cheapest::<15>(vectors.as_chunks().0, self.codes.as_chunks().0, &costs),
            21 => cheapest::<21>(vectors.as_chunks().0, self.codes.as_chunks().0, &costs),
            other => unreachable!("no attribute has {other} numbers"),
        };
        chosen.into_iter().map(|code| u16::try_from(code).expect("1,024 codes")).collect()
    }

    /// Makes each code the mean of its vectors, where Σ ‖x − c‖² is least; one without vectors stays.
    pub(super) fn centre<'a, I: Iterator<Item = (u16, &'a [f32])>>(&mut self, vectors: impl Fn() -> I) {
        let counts = self.counts(vectors().map(|(code, _)| code));
        let mut sums = vec![0.0f64; self.codes.len()];
        for (code, vector) in vectors() {
            let sum = &mut sums[usize::from(code) * self.width..];
            sum.iter_mut().zip(vector).for_each(|(sum, value)| *sum += f64::from(*value));
        }
        let rows = self.codes.chunks_mut(self.width).zip(sums.chunks(self.width)).zip(counts);
        for ((code, sum), n) in rows.filter(|(_, n)| *n > 0.0) {
            #[expect(clippy::cast_possible_truncation, reason = "a mean of single-precision numbers")]
            code.iter_mut().zip(sum).for_each(|(code, sum)| *code = (sum / f64::from(n)) as f32);
        }
    }

    /// How many have each code, `[K]`.
    pub(super) fn counts(&self, chosen: impl Iterator<Item = u16>) -> Vec<f32> {
        let mut counts = vec![0.0; self.logits.len()];
        chosen.for_each(|code| counts[usize::from(code)] += 1.0);
        counts
    }

    /// A step of the distribution down its own bits.
    ///
    /// * `chosen`: the code of each vector.
    pub(super) fn learn_distribution(&mut self, rate: f64, chosen: impl Iterator<Item = u16>) {
        self.n_steps += 1;
        let d = d_logits(&self.logits, &self.counts(chosen));
        let Moments { first, second } = &mut self.of_logits;
        adam::update(Step::new(rate, self.n_steps), &mut self.logits, first, second, Some(&d));
    }

    /// A step of all codes.
    ///
    /// * `d_codes`: `[K, width]`.
    pub(super) fn learn_codes(&mut self, step: Step<f32>, d_codes: &[f32]) {
        let Moments { first, second } = &mut self.of_codes;
        adam::update(step, &mut self.codes, first, second, Some(d_codes));
    }
}

#[cfg(test)]
mod tests {
    use pocketsplat_kernels::finite_difference::{assert_gradient, random};
    use rand::SeedableRng;

    use super::*;

    /// More of them near 0, so that codes are not equally likely.
    #[expect(clippy::cast_possible_truncation, reason = "any numbers")]
    fn vectors(n: usize) -> Vec<f32> {
        random(5, 3 * n).into_iter().map(|x| x.powi(3) as f32).collect()
    }

    fn book(vectors: &[f32], price: f32) -> Codebook {
        Codebook::new(3, vectors, price, &mut ChaCha8Rng::seed_from_u64(1))
    }

    #[test]
    fn the_gradient_of_the_rate_agrees_with_finite_differences() {
        let logits: Vec<f64> = random(1, 12).iter().map(|x| 3.0 * x).collect();
        let counts: Vec<f64> = random(2, 12).iter().map(|x| 20.0 * (x + 1.0)).collect();
        let rate = |logits: &[f64]| bits(logits).iter().zip(&counts).map(|(bits, n)| bits * n).sum();
        assert_gradient("rate", &logits, &d_logits(&logits, &counts), rate);
        assert!((bits(&logits).iter().map(|bits| (-bits).exp2()).sum::<f64>() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_higher_price_takes_fewer_bits_and_more_distance() {
        let vectors = vectors(4000);
        let of = |price| {
            let book = book(&vectors, price);
            let (chosen, bits) = (book.choose(&vectors, price), bits(&book.logits));
            let code = |k: u16| &book.codes[3 * usize::from(k)..][..3];
            let distance = |(x, k): (&[f32], u16)| x.iter().zip(code(k)).map(|(x, c)| (x - c).powi(2)).sum::<f32>();
            let distances: f32 = vectors.chunks(3).zip(chosen.iter().copied()).map(distance).sum();
            (chosen.iter().map(|k| bits[usize::from(*k)]).sum::<f32>() / 4000.0, distances / 4000.0)
        };
        let [free, cheap, dear] = [0.0, 0.01, 0.1].map(of);
        assert!(free.0 > cheap.0 + 0.5 && cheap.0 > dear.0 + 1.0, "{free:?}, {cheap:?}, {dear:?}");
        assert!(free.1 < cheap.1 && cheap.1 < dear.1, "{free:?}, {cheap:?}, {dear:?}");
    }

    #[test]
    fn codes_are_means_and_the_distribution_learns_their_shares() {
        let vectors = vectors(2000);
        let mut book = book(&vectors, 0.01);
        let chosen = book.choose(&vectors, 0.01);
        book.centre(|| chosen.iter().copied().zip(vectors.chunks(3)));
        let of_first: Vec<&[f32]> =
            vectors.chunks(3).zip(&chosen).filter(|(_, code)| **code == chosen[0]).map(|(vector, _)| vector).collect();
        let mean = of_first.iter().map(|vector| vector[1]).sum::<f32>() / of_first.len() as f32;
        assert!((book.codes[3 * usize::from(chosen[0]) + 1] - mean).abs() < 1e-5);
        book.logits.fill(0.0);
        (0..600).for_each(|_| book.learn_distribution(0.01, chosen.iter().copied()));
        let counts = book.counts(chosen.iter().copied());
        for (bits, n) in bits(&book.logits).into_iter().zip(counts).filter(|(_, n)| *n > 5.0) {
            assert!((bits - (2000.0 / n).log2()).abs() < 0.2, "{bits} bits for {n} of 2000");
        }
        assert!(Codebook::new(4, &[], 0.1, &mut ChaCha8Rng::seed_from_u64(1)).choose(&[], 0.1).is_empty());
    }
}
