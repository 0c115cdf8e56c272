//! Residual vector quantisation (Zeghidour et al. 2021, SoundStream, section 3.3): a sum of codes, each of a codebook of its own.

use half::f16;
use pocketsplat_kernels::ops::adam::{self, Moments, Step};
use rand_chacha::ChaCha8Rng;

use crate::k_means::k_means;
use crate::packed::halved;

/// Codebooks.
pub(super) const STAGES: usize = 6;
/// Codes of each.
pub(super) const CODES: usize = 64;
/// Rounds of k-means.
const ROUNDS: usize = 10;

/// N vectors as sums of codes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ResidualCodes<const WIDTH: usize> {
    /// `[STAGES]` codebooks, of as many codes each.
    pub(super) books: [Vec<[f32; WIDTH]>; STAGES],
    /// `[N]` a code of each.
    pub(super) codes: Vec<[u8; STAGES]>,
}

impl<const WIDTH: usize> ResidualCodes<WIDTH> {
    /// Each codebook by k-means of what those before leave.
    pub(super) fn of(vectors: &[[f32; WIDTH]], rng: &mut ChaCha8Rng) -> Self {
        let mut left = vectors.to_vec();
        let mut codes = vec![[0; STAGES]; vectors.len()];
        let weights = vec![1.0; vectors.len()];
        let books = std::array::from_fn(|stage| {
            let (book, nearest) = k_means(&left, &weights, CODES, ROUNDS, rng);
            for ((left, codes), nearest) in left.iter_mut().zip(&mut codes).zip(nearest) {
                left.iter_mut().zip(book[nearest]).for_each(|(left, code)| *left -= code);
                codes[stage] = u8::try_from(nearest).expect("64 codes");
            }
            book
        });
        Self { books, codes }
    }

    /// Vector `index`.
    pub(super) fn vector(&self, index: usize) -> [f32; WIDTH] {
        let mut sum = [0.0; WIDTH];
        for (book, code) in self.books.iter().zip(self.codes[index]) {
            sum.iter_mut().zip(book[usize::from(code)]).for_each(|(sum, value)| *sum += value);
        }
        sum
    }

    /// Gradients of all codes, `[STAGES · n_codes]`, from those of some vectors, in their order.
    fn backward(&self, d_vectors: impl Iterator<Item = (usize, [f32; WIDTH])>) -> Vec<[f32; WIDTH]> {
        let n = self.books[0].len();
        let mut d_codes = vec![[0.0; WIDTH]; STAGES * n];
        for (index, d) in d_vectors {
            for (stage, code) in self.codes[index].into_iter().enumerate() {
                d_codes[stage * n + usize::from(code)].iter_mut().zip(d).for_each(|(sum, d)| *sum += d);
            }
        }
        d_codes
    }

    /// Moves all codes.
    ///
    /// * `d_vectors`: index and gradient of some vectors. * `moments`: `[STAGES · n_codes · WIDTH]`.
    pub(super) fn learn(
        &mut self,
        step: Step<f32>,
        moments: &mut Moments<f32>,
        d_vectors: impl Iterator<Item = (usize, [f32; WIDTH])>,
    ) {
        let d_codes = self.backward(d_vectors);
        let len = self.books[0].len() * WIDTH;
        let parts = moments.first.chunks_mut(len.max(1)).zip(moments.second.chunks_mut(len.max(1)));
        for ((book, (first, second)), d) in
            self.books.iter_mut().zip(parts).zip(d_codes.as_flattened().chunks(len.max(1)))
        {
            adam::update(step, book.as_flattened_mut(), first, second, Some(d));
        }
    }

    /// Zero moments of all codes.
    pub(super) fn moments(&self) -> Moments<f32> {
        Moments::zeros(STAGES * self.books[0].len() * WIDTH)
    }

    /// With codes of 16 bits a number.
    pub(super) fn rounded(mut self) -> Self {
        self.books.iter_mut().flatten().flatten().for_each(|value| *value = halved(*value).to_f32());
        self
    }

    /// A codebook as files have it.
    pub(super) fn halves(&self, stage: usize) -> Vec<[f16; WIDTH]> {
        self.books[stage].iter().map(|code| code.map(f16::from_f32)).collect()
    }
}

#[cfg(test)]
mod tests {
    use pocketsplat_kernels::finite_difference::random;
    use rand::SeedableRng;

    use super::*;

    #[expect(clippy::cast_possible_truncation, reason = "any numbers")]
    fn vectors(n: usize) -> Vec<[f32; 3]> {
        random(5, 3 * n).as_chunks().0.iter().map(|v| v.map(|x| x as f32)).collect()
    }

    #[test]
    fn each_stage_leaves_less() {
        let vectors = vectors(5000);
        let coded = ResidualCodes::of(&vectors, &mut ChaCha8Rng::seed_from_u64(1));
        let error = |stages: usize| -> f32 {
            let mut cut = coded.clone();
            cut.books[stages..].iter_mut().flatten().for_each(|code| *code = [0.0; 3]);
            (0..5000).map(|i| (0..3).map(|c| (vectors[i][c] - cut.vector(i)[c]).powi(2)).sum::<f32>()).sum()
        };
        let errors: Vec<f32> = (0..=STAGES).map(error).collect();
        assert!(errors.windows(2).all(|pair| pair[1] < 0.3 * pair[0]), "{errors:?}");
        assert!(ResidualCodes::<3>::of(&[], &mut ChaCha8Rng::seed_from_u64(1)).codes.is_empty());
    }

    #[test]
    fn a_code_has_the_gradients_of_its_vectors() {
        let coded = ResidualCodes::of(&vectors(200), &mut ChaCha8Rng::seed_from_u64(1));
        let slopes = vectors(7);
        let found = coded.backward(slopes.iter().enumerate().map(|(i, d)| (20 * i, *d)));
        let loss = |coded: &ResidualCodes<3>| -> f32 {
            slopes.iter().enumerate().map(|(i, d)| (0..3).map(|c| d[c] * coded.vector(20 * i)[c]).sum::<f32>()).sum()
        };
        for (stage, code) in (0..STAGES).flat_map(|stage| (0..CODES).map(move |code| (stage, code))) {
            let difference = [0, 1, 2].map(|c| {
                let at = |by: f32| {
                    let mut moved = coded.clone();
                    moved.books[stage][code][c] += by;
                    loss(&moved)
                };
                (at(0.25) - at(-0.25)) / 0.5
            });
            let found = found[stage * CODES + code];
            assert!((0..3).all(|c| (found[c] - difference[c]).abs() < 1e-4), "{found:?}, expected {difference:?}");
        }
    }
}
