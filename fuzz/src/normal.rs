//! Any words are symbols of a Gaussian.

use pocketsplat_format::entropy::{self, AnsReader, NormalModel, SymbolModel, UniformByte};

/// A raw byte from here on says that two more are the symbol.
const ESCAPE_SPELT: u8 = 254;

/// Whatever words a Gaussian model reads symbols from, its slots for those symbols are where they were read; or the symbol was spelt out
/// byte by byte, which is allowed where it need not be (FORMAT.md, section 7).
pub fn normal(bytes: &[u8]) {
    let (head, words) = bytes.split_at(bytes.len().min(2));
    let [mean, scale] = [0, 1].map(|at| i32::from(head.get(at).copied().unwrap_or(0).cast_signed()));
    let model = NormalModel::new(mean, scale);
    let (words, _) = words.as_chunks();
    let mut reader = AnsReader::new(words);
    for _ in 0..words.len() {
        let before = reader;
        let symbol = model.symbol(&mut reader);
        if spelt_out(&model, before) == Some(symbol) {
            continue;
        }
        let mut copy = before;
        for &(start, frequency) in model.slots(symbol).as_slice() {
            let slot = Slot { start, frequency };
            assert!(copy.symbol(&slot), "symbol {symbol} under {model:?}: not in {start} + {frequency}");
        }
    }
}

/// The symbol that follows an escape as two bytes, if that is what follows.
fn spelt_out(model: &NormalModel, mut reader: AnsReader<'_>) -> Option<i16> {
    (reader.symbol(model).is_none() && reader.symbol(&UniformByte) >= ESCAPE_SPELT)
        .then(|| i16::from_be_bytes([reader.symbol(&UniformByte), reader.symbol(&UniformByte)]))
}

/// A slot on its own: was the symbol that was read in it?
struct Slot {
    start: u16,
    frequency: u16,
}

impl SymbolModel for Slot {
    type Symbol = bool;

    fn slot(&self, quantile: u16) -> entropy::Slot<bool> {
        let inside = quantile >= self.start && quantile - self.start < self.frequency;
        entropy::Slot { symbol: inside, start: self.start, frequency: self.frequency }
    }
}
