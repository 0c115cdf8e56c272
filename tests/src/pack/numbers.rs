//! Numbers that look random and are the same on every machine and for ever.

/// A sequence of numbers (Steele, Lea and Flood 2014, SplitMix64), written here so that no library can change it.
#[derive(Clone, Debug)]
pub struct Numbers(u64);

impl Numbers {
    /// The sequence of a seed.
    pub fn of(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    /// A number from `least` to `most`.
    pub fn between(&mut self, least: i32, most: i32) -> i32 {
        let span = u64::from(most.abs_diff(least)) + 1;
        least.wrapping_add((self.next() % span) as i32)
    }

    /// The sum of three numbers from −`reach` to `reach`: near 0 more often than far from it.
    pub fn around_zero(&mut self, reach: i32) -> i32 {
        (0..3).map(|_| self.between(-reach, reach)).sum()
    }

    /// `n` numbers from `least` to `most`.
    pub fn many(&mut self, n: usize, least: i32, most: i32) -> Vec<i32> {
        (0..n).map(|_| self.between(least, most)).collect()
    }
}
