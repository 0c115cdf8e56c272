//! What an entropy decoder needs to know about the next symbol.

pub use pocketsplat_half::{FREQUENCY_TOTAL, PRECISION_BITS};

/// The piece of `0..FREQUENCY_TOTAL` that stands for one symbol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Slot<S> {
    /// The symbol.
    pub symbol: S,
    /// Sum of the frequencies of all symbols before it.
    pub start: u16,
    /// Its frequency, at least 1.
    pub frequency: u16,
}

/// A distribution over symbols; static tables implement it, and so can a context model that is computed per symbol.
///
/// The slots of a model must be disjoint and fill `0..FREQUENCY_TOTAL`.
pub trait SymbolModel {
    /// What is decoded.
    type Symbol;

    /// The slot that contains `quantile`, which is below [`FREQUENCY_TOTAL`].
    fn slot(&self, quantile: u16) -> Slot<Self::Symbol>;
}

/// All 256 values of a byte, equally frequent: eight raw bits inside the stream.
#[derive(Clone, Copy, Debug)]
pub struct UniformByte;

impl SymbolModel for UniformByte {
    type Symbol = u8;

    #[inline]
    fn slot(&self, quantile: u16) -> Slot<u8> {
        const FREQUENCY: u16 = FREQUENCY_TOTAL >> 8;
        let [symbol, ..] = (quantile >> (PRECISION_BITS - 8)).to_le_bytes();
        Slot { symbol, start: quantile & !(FREQUENCY - 1), frequency: FREQUENCY }
    }
}
