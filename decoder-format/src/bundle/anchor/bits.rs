//! Numbers of a few bits side by side in a row of 16-bit words, the lowest bits first.

/// Takes numbers off the front of a row.
pub(super) struct BitReader<'r> {
    words: core::slice::Iter<'r, u16>,
    /// The bits of the words taken so far that no number has had yet.
    left: u32,
    n_left: u32,
}

impl<'r> BitReader<'r> {
    pub(super) fn new(words: &'r [u16]) -> Self {
        Self { words: words.iter(), left: 0, n_left: 0 }
    }

    /// The next number of `n` bits, 0 to 16; zeros behind the end of the row.
    #[inline(always)]
    pub(super) fn unsigned(&mut self, n: u32) -> u32 {
        if self.n_left < n {
            let word = self.words.next().copied().unwrap_or_default();
            self.left |= u32::from(word).wrapping_shl(self.n_left);
            self.n_left = self.n_left.wrapping_add(16);
        }
        let number = self.left & 1_u32.wrapping_shl(n).wrapping_sub(1);
        self.left = self.left.wrapping_shr(n);
        self.n_left = self.n_left.wrapping_sub(n);
        number
    }

    /// The same as two's complement; 1 to 16 bits.
    #[inline(always)]
    pub(super) fn signed(&mut self, n: u32) -> i32 {
        let unused = u32::BITS.wrapping_sub(n);
        (self.unsigned(n).wrapping_shl(unused).cast_signed()).wrapping_shr(unused)
    }

    /// Passes over `n` bits.
    pub(super) fn skip(&mut self, n: u32) {
        let n_here = n.min(self.n_left);
        self.unsigned(n_here);
        let rest = n.wrapping_sub(n_here);
        self.words = self.words.as_slice().get((rest / 16) as usize..).unwrap_or_default().iter();
        self.unsigned(rest % 16);
    }

    /// A number of `n` bits, up to 64, in pieces.
    pub(super) fn wide(&mut self, n: u32) -> u64 {
        let (mut number, mut n_done) = (0_u64, 0_u32);
        while n_done < n {
            let piece = n.wrapping_sub(n_done).min(16);
            number |= u64::from(self.unsigned(piece)).wrapping_shl(n_done);
            n_done = n_done.wrapping_add(piece);
        }
        number
    }
}

/// Puts numbers side by side.
pub(super) struct BitWriter<'r> {
    words: core::slice::IterMut<'r, u16>,
    pending: u32,
    n_pending: u32,
}

impl<'r> BitWriter<'r> {
    pub(super) fn new(words: &'r mut [u16]) -> Self {
        Self { words: words.iter_mut(), pending: 0, n_pending: 0 }
    }

    /// Adds the lowest `n` bits of a number, 0 to 16; what has no place in the row is dropped.
    pub(super) fn push(&mut self, number: u32, n: u32) {
        let bits = number & 1_u32.wrapping_shl(n).wrapping_sub(1);
        self.pending |= bits.wrapping_shl(self.n_pending);
        self.n_pending = self.n_pending.wrapping_add(n);
        if self.n_pending >= 16 {
            self.flush();
            self.n_pending = self.n_pending.wrapping_sub(16);
        }
    }

    /// Adds the lowest `n` bits, up to 64, in pieces.
    pub(super) fn push_wide(&mut self, number: u64, n: u32) {
        let mut n_done = 0_u32;
        while n_done < n {
            let piece = n.wrapping_sub(n_done).min(16);
            self.push(number.wrapping_shr(n_done) as u32, piece);
            n_done = n_done.wrapping_add(piece);
        }
    }

    /// Writes what is left; the rest of the row becomes 0.
    pub(super) fn finish(mut self) {
        self.flush();
        self.words.by_ref().for_each(|word| *word = 0);
    }

    fn flush(&mut self) {
        if let Some(word) = self.words.next() {
            *word = self.pending as u16;
        }
        self.pending = self.pending.wrapping_shr(16);
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::{BitReader, BitWriter};

    #[test]
    fn numbers_of_any_width_come_back() {
        let mut state = 1_u32;
        let mut random = move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            state >> 8
        };
        for _ in 0..500 {
            let widths: Vec<u32> = (0..40).map(|_| 1 + random() % 16).collect();
            let numbers: Vec<u32> = widths.iter().map(|n| random() & ((1 << n) - 1)).collect();
            let (wide, n_wide) = (u64::from(random()) << 20, 33 + random() % 16);
            let wide = wide & ((1 << n_wide) - 1);
            let n_words = (widths.iter().sum::<u32>() + n_wide).div_ceil(16) as usize;
            let mut words = std::vec![0xDEAD_u16; n_words + 1];
            let mut writer = BitWriter::new(&mut words);
            widths.iter().zip(&numbers).for_each(|(&n, &number)| writer.push(number, n));
            writer.push_wide(wide, n_wide);
            writer.finish();
            assert_eq!(words.last(), Some(&0), "the rest is empty");
            let mut reader = BitReader::new(&words[..n_words]);
            for (&n, &number) in widths.iter().zip(&numbers) {
                assert_eq!(reader.unsigned(n), number, "{n} bits");
            }
            assert_eq!((reader.wide(n_wide), reader.unsigned(16)), (wide, 0), "{n_wide} bits, then nothing");
            let n_skipped = random() as usize % 40;
            let mut reader = BitReader::new(&words[..n_words]);
            let [before, skipped] = [&widths[..n_skipped / 2], &widths[n_skipped / 2..n_skipped]];
            before.iter().for_each(|n| _ = reader.unsigned(*n));
            reader.skip(skipped.iter().sum());
            let n = widths[n_skipped];
            assert_eq!(reader.unsigned(n), numbers[n_skipped], "{n} bits behind {skipped:?}");
        }
    }

    #[test]
    fn signed_numbers_that_fit_come_back() {
        for n in 1..=16 {
            for number in -300..300_i16 {
                let mut words = [0];
                let mut writer = BitWriter::new(&mut words);
                writer.push(number.cast_unsigned().into(), n);
                writer.finish();
                let same = BitReader::new(&words).signed(n) == i32::from(number);
                let fits = (-1_i32 << (n - 1)..1 << (n - 1)).contains(&number.into());
                assert_eq!(same, fits, "{number} in {n} bits");
            }
        }
    }
}
