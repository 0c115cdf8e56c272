//! Random numbers that are a function of where they are used: no state, so neither threads nor interruptions change them.

/// A point from which streams of random numbers branch: of a run, of an iteration in it, of an anchor in that.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stream(u32);

/// A bijection of 32 bits in which every bit of the input reaches every bit of the output (Wellons 2018, "Prospecting for
/// hash functions": shifts 16, 15, 16).
#[inline(always)]
fn mix(x: u32) -> u32 {
    let x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    let x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

impl Stream {
    /// The root of a run's streams.
    pub fn of_run(seed: u64) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "both halves are used")]
        let [low, high] = [seed as u32, (seed >> 32) as u32];
        Self(mix(low ^ mix(high)))
    }

    /// The `index`-th branch. Multiplying by 2³²/golden ratio keeps neighbouring indices apart.
    #[inline(always)]
    pub fn branch(self, index: u32) -> Self {
        Self(mix(self.0 ^ mix(index.wrapping_mul(0x9e37_79b9).wrapping_add(0x85eb_ca6b))))
    }

    /// The word that kernels take for this stream.
    pub fn word(self) -> u32 {
        self.0
    }

    /// The `index`-th number of this stream, uniform in [0, 1): a multiple of 2⁻²⁴.
    #[inline(always)]
    pub fn uniform(self, index: u32) -> f32 {
        let bits = mix(self.0.wrapping_add(index.wrapping_mul(0x9e37_79b9)));
        // Signed, because AVX2 converts only signed integers.
        (bits >> 8).cast_signed() as f32 * (1.0 / 16_777_216.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_uniform_and_their_streams_independent() {
        let run = Stream::of_run(42);
        let (n_rows, n) = (400u32, 86u32);
        let (mut sum, mut squares, mut along_row, mut along_column) = (0.0, 0.0, 0.0, 0.0);
        let at = |row: u32, i: u32| f64::from(run.branch(7).branch(row).uniform(i)) - 0.5;
        for row in 0..n_rows {
            for i in 0..n {
                let x = at(row, i);
                assert!((-0.5..0.5).contains(&x));
                sum += x;
                squares += x * x;
                along_row += x * at(row, i + 1);
                along_column += x * at(row + 1, i);
            }
        }
        let total = f64::from(n_rows * n);
        assert!((sum / total).abs() < 0.005, "mean {}", sum / total);
        assert!((squares / total - 1.0 / 12.0).abs() < 0.001, "variance {}", squares / total);
        for correlation in [along_row, along_column] {
            assert!((12.0 * correlation / total).abs() < 0.02, "correlation {}", 12.0 * correlation / total);
        }
    }

    #[test]
    fn seeds_and_branches_differ() {
        let numbers: std::collections::HashSet<u32> = (0..100)
            .flat_map(|seed| (0..100).map(move |i| Stream::of_run(seed << 20).branch(i).uniform(0).to_bits()))
            .collect();
        assert!(numbers.len() > 9990, "{} of 10,000 differ", numbers.len());
    }
}
