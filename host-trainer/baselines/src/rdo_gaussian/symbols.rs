//! Symbols in a file: their frequencies, and the stream of an entropy coder that has them for a model. It is the coder of bundles.

use pocketsplat_codec::bundle::{SlotList, frequencies};
use pocketsplat_format::entropy::{AnsReader, FREQUENCY_TOTAL, Slot, SymbolModel};

use crate::baseline::Unreadable;
use crate::packed::{Body, put_count, put_words};

/// Frequencies of symbols, which fill the slots of the coder.
struct Table {
    frequencies: Vec<u16>,
    /// Of each the sum of those before it.
    starts: Vec<u16>,
}

impl Table {
    fn new(frequencies: &[u16]) -> Self {
        let before = |sum: &mut u16, frequency: &u16| Some(std::mem::replace(sum, *sum + frequency));
        Self { frequencies: frequencies.to_vec(), starts: frequencies.iter().scan(0, before).collect() }
    }

    fn slot_of(&self, symbol: u16) -> Slot<u16> {
        let index = usize::from(symbol);
        Slot { symbol, start: self.starts[index], frequency: self.frequencies[index] }
    }
}

impl SymbolModel for Table {
    type Symbol = u16;

    fn slot(&self, quantile: u16) -> Slot<u16> {
        // The first begins at 0, and of those that begin at one place all but the last have frequency 0.
        let symbol = self.starts.partition_point(|start| *start <= quantile) - 1;
        self.slot_of(u16::try_from(symbol).expect("4,096 symbols at most"))
    }
}

/// Frequencies that fill the slots, each at least 1 where the weight is above 0; none where there is no weight at all.
///
/// * `weights`: of each symbol, 0 or more.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "positive, and far below 2⁶⁴")]
pub(super) fn frequencies_of(weights: &[f32]) -> Vec<u16> {
    let total: f64 = weights.iter().map(|weight| f64::from(*weight)).sum();
    let parts = weights.iter().map(|weight| (f64::from(*weight) / total * f64::from(1 << 30)).ceil() as u64);
    let found = if total > 0.0 { frequencies(&parts.collect::<Vec<_>>(), None) } else { Vec::new() };
    found.into_iter().map(|frequency| u16::try_from(frequency).expect("4,096 slots")).collect()
}

/// Appends frequencies, and symbols by them.
///
/// * `frequencies`: of each symbol that comes up at least 1, in all [`FREQUENCY_TOTAL`].
pub(super) fn put_symbols(symbols: &[u16], frequencies: &[u16], body: &mut Vec<u8>) {
    let table = Table::new(frequencies);
    let mut slots = SlotList::default();
    symbols.iter().for_each(|symbol| slots.append(&table.slot_of(*symbol)));
    let words = slots.into_bytes();
    for count in [frequencies.len(), words.len() / 2] {
        put_count(count, body);
    }
    put_words(frequencies.iter().copied(), body);
    body.extend(words);
}

/// The frequencies, and `n` symbols.
///
/// # Errors
/// Bytes that end early, frequencies that do not fill the slots, and a stream that has not `n` symbols. Memory: `n` of them.
pub(super) fn symbols(body: &mut Body<'_>, n: usize, what: &str) -> Result<(Vec<u16>, Vec<u16>), Unreadable> {
    let [n_frequencies, n_words] = [body.count(what)?, body.count(what)?];
    let frequencies = body.words(n_frequencies, what)?;
    let needed = if n > 0 { u64::from(FREQUENCY_TOTAL) } else { 0 };
    let total: u64 = frequencies.iter().copied().map(u64::from).sum();
    if total != needed || n_frequencies > usize::from(FREQUENCY_TOTAL) {
        return Err(Unreadable(format!(
            "{n_frequencies} frequencies of {what} add up to {total}, needed: {FREQUENCY_TOTAL} at most that add up to {needed}; write the file again"
        )));
    }
    let table = Table::new(&frequencies);
    let words = body.bytes(n_words.saturating_mul(2), what)?.as_chunks().0;
    let mut reader = AnsReader::new(words);
    let symbols = (0..n).map(|_| reader.symbol(&table)).collect();
    if let Err(left) = reader.finish() {
        return Err(Unreadable(format!(
            "a stream of {what} does not end after {n} symbols, {left} bytes are left; write the file again"
        )));
    }
    Ok((frequencies, symbols))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn symbols_come_back_in_as_many_bits_as_they_have(weights in prop::collection::vec(0..40u16, 1..300), n in 0..3000usize) {
            let any = weights.iter().any(|weight| *weight > 0);
            let drawn: Vec<u16> = (0u16..).zip(&weights).flat_map(|(symbol, n)| vec![symbol; usize::from(*n)]).collect();
            let n = if any { n } else { 0 };
            let symbols_in: Vec<u16> = (0..n).map(|i| drawn[i * 7919 % drawn.len()]).collect();
            let weights: Vec<f32> = weights.iter().map(|weight| f32::from(*weight) * f32::from(u8::from(n > 0))).collect();
            let frequencies = frequencies_of(&weights);
            let mut bytes = Vec::new();
            put_symbols(&symbols_in, &frequencies, &mut bytes);
            let mut body = Body(&bytes);
            let read = symbols(&mut body, n, "symbols");
            prop_assert_eq!(body.end(), Ok(()));
            let bits: f64 = symbols_in.iter().map(|s| 12.0 - f64::from(frequencies[usize::from(*s)]).log2()).sum();
            let stream = bytes.len() - 8 - 2 * frequencies.len();
            prop_assert!(8.0 * stream as f64 <= bits * 1.001 + 33.0, "{stream} bytes for {bits} bits");
            prop_assert_eq!(read, Ok((frequencies, symbols_in)));
            prop_assert!(symbols(&mut Body(&bytes[..bytes.len() - 1]), n, "symbols").is_err());
        }
    }

    #[test]
    fn frequencies_that_leave_slots_are_refused() {
        let mut bytes = Vec::new();
        put_symbols(&[0, 1, 1], &[96, 4000], &mut bytes);
        assert_eq!(symbols(&mut Body(&bytes), 3, "codes"), Ok((vec![96, 4000], vec![0, 1, 1])));
        bytes[8] -= 1;
        let said = symbols(&mut Body(&bytes), 3, "codes").unwrap_err().to_string();
        assert_eq!(
            said,
            "2 frequencies of codes add up to 4095, needed: 4096 at most that add up to 4096; write the file again"
        );
    }
}
