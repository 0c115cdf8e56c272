//! The reader of asymmetric numeral systems (Duda 2013), 32-bit state and 16-bit words.
//!
//! It reads what `constriction`'s `AnsCoder<u16, u32>` writes (Bamler 2022), its words in reverse order so that reading
//! goes forward. That coder is the reference, and tests of the writer hold the two identical.

use pocketsplat_half::Stream;

use super::model::{SymbolModel, UniformByte};

/// Decodes the symbols of one stream; [`finish`](Self::finish) tells whether it was one.
///
/// Reading past the end is harmless: it yields symbols without meaning, and `finish` fails.
#[derive(Clone, Copy, Debug)]
#[must_use = "only `finish` tells whether the symbols were sound"]
pub struct AnsReader<'a> {
    stream: Stream<'a>,
    malformed: bool,
}

impl<'a> AnsReader<'a> {
    /// Starts at the first word of a stream.
    pub fn new(words: &'a [[u8; 2]]) -> Self {
        let mut reader = Self { stream: Stream { state: 0, words }, malformed: false };
        // The encoder writes no leading zero: such a stream would hold the same symbols as a shorter one.
        reader.malformed = words.first() == Some(&[0, 0]);
        reader.stream.refill();
        reader.stream.refill();
        reader
    }

    /// Decodes one symbol; the caller brings the model the encoder had at this place.
    ///
    /// # Budget
    /// One multiplication and one look-up in the model.
    #[inline]
    pub fn symbol<M: SymbolModel>(&mut self, model: &M) -> M::Symbol {
        // 12 bits, so nothing is cut off.
        let slot = model.slot(self.quantile() as u16);
        self.advance(slot.start.into(), slot.frequency.into());
        slot.symbol
    }

    /// What the next symbol's slot contains, below [`FREQUENCY_TOTAL`](super::FREQUENCY_TOTAL).
    #[inline]
    pub(crate) fn quantile(&self) -> u32 {
        self.stream.quantile()
    }

    /// Leaves the next symbol behind, whose slot contains the quantile.
    #[inline]
    pub(crate) fn advance(&mut self, start: u32, frequency: u32) {
        self.stream.advance(start, frequency);
    }

    /// The stream itself, for what reads several symbols at once.
    #[inline(always)]
    pub(crate) fn stream(&mut self) -> &mut Stream<'a> {
        &mut self.stream
    }

    /// The symbol after an escape: two raw bytes, high then low.
    #[inline(always)]
    pub(crate) fn escaped(&mut self) -> i16 {
        let high = self.symbol(&UniformByte);
        let low = self.symbol(&UniformByte);
        i16::from_be_bytes([high, low])
    }

    /// Has the stream refused at its end if not all of its symbols fit in so many bits, as two's complement.
    ///
    /// * `bits`: 1 to 16. * `spread`: `s ^ (s >> 31)` of all these symbols s, joined by "or".
    #[inline(always)]
    pub(crate) fn refuse_beyond(&mut self, bits: u8, spread: i32) {
        self.malformed |= spread.wrapping_shr(u32::from(bits).wrapping_sub(1)) != 0;
    }

    /// Ends the stream: its words must be used up and its state back at the encoder's start.
    ///
    /// # Errors
    /// The number of bytes not read; 0 when the symbols ran past the end or ended in another state.
    pub fn finish(self) -> Result<(), usize> {
        let Stream { state, words } = self.stream;
        if words.is_empty() && state == 0 && !self.malformed {
            return Ok(());
        }
        Err(words.as_flattened().len())
    }
}

#[cfg(test)]
mod tests {
    use super::AnsReader;
    use crate::entropy::UniformByte;

    #[test]
    fn bytes_come_back_in_order() {
        // By hand, last symbol first: 0 → 0x34·16, then (0x340/16)·4096 + 0x12·16.
        let words = [[0x03, 0x00], [0x20, 0x41]];
        let mut reader = AnsReader::new(&words);
        assert_eq!((reader.symbol(&UniformByte), reader.symbol(&UniformByte)), (0x12, 0x34), "the two bytes");
        assert_eq!(reader.finish(), Ok(()), "nothing left");
        let mut reader = AnsReader::new(&words);
        reader.symbol(&UniformByte);
        assert_eq!(reader.finish(), Err(0), "a symbol is left in the state");
    }

    #[test]
    fn leftover_words_are_counted() {
        let words = [[1, 0], [2, 0], [3, 0], [4, 0]];
        let reader = AnsReader::new(&words);
        assert_eq!(reader.finish(), Err(4), "two words not read");
    }

    #[test]
    fn an_empty_stream_is_sound() {
        assert_eq!(AnsReader::new(&[]).finish(), Ok(()), "no words, no symbols");
    }
}
