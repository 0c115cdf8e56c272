//! Fixed-width integers packed without gaps, least significant bit first.

/// Reads integers of up to 24 bits; past the end it reads zeros.
#[derive(Clone, Copy, Debug)]
pub struct BitReader<'a> {
    rest: &'a [u8],
    /// Bits taken from the stream and not yet handed out, the next one lowest.
    pending: u32,
    n_pending: u32,
}

impl<'a> BitReader<'a> {
    /// Starts at the lowest bit of the first byte.
    #[must_use]
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, pending: 0, n_pending: 0 }
    }

    /// The next `n_bits` bits, at most 24, as an unsigned integer.
    ///
    /// ```
    /// let mut bits = pocketsplat_core::entropy::BitReader::new(&[0b101_11010, 0b1]);
    /// assert_eq!((bits.take(5), bits.take(4)), (0b11010, 0b1101));
    /// ```
    pub fn take(&mut self, n_bits: u32) -> u32 {
        let n_bits = n_bits.min(24);
        while self.n_pending < n_bits {
            let (byte, rest) = self.rest.split_first().unwrap_or((&0, &[]));
            self.rest = rest;
            // Fewer than 24 bits are pending, so the byte fits.
            self.pending |= u32::from(*byte) << (self.n_pending & 31);
            self.n_pending = self.n_pending.wrapping_add(8);
        }
        let mask = (1_u32 << n_bits).wrapping_sub(1);
        let value = self.pending & mask;
        self.pending >>= n_bits;
        self.n_pending = self.n_pending.wrapping_sub(n_bits);
        value
    }
}
