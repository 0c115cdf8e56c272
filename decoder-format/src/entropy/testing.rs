//! An ANS encoder for tests, written from `FORMAT.md`; the writer of bundles uses `constriction`.

use std::vec::Vec;

// By the names of whoever has this file as a module: the conformance crate writes bundles with it too.
use super::{FREQUENCY_TOTAL, PRECISION_BITS, Slot, SymbolModel};

/// Encodes slots that are listed in reading order.
pub(crate) struct AnsWriter;

impl AnsWriter {
    /// The words of the stream in reading order.
    pub(crate) fn words(slots: &[Slot<()>]) -> Vec<[u8; 2]> {
        let mut state = 0_u32;
        let mut words = Vec::new();
        // What is read first is written last.
        for slot in slots.iter().rev() {
            let frequency = u32::from(slot.frequency);
            if state >> (32 - PRECISION_BITS) >= frequency {
                words.push((state as u16).to_le_bytes());
                state >>= 16;
            }
            state = ((state / frequency) << PRECISION_BITS) + state % frequency + u32::from(slot.start);
        }
        while state > 0 {
            words.push((state as u16).to_le_bytes());
            state >>= 16;
        }
        words.reverse();
        words
    }
}

/// The slot of the first symbol that `is_it` accepts.
pub(crate) fn slot_of<M: SymbolModel>(model: &M, is_it: impl Fn(M::Symbol) -> bool) -> Slot<()> {
    let mut quantile = 0;
    while quantile < FREQUENCY_TOTAL {
        let Slot { symbol, start, frequency } = model.slot(quantile);
        if is_it(symbol) {
            return Slot { symbol: (), start, frequency };
        }
        quantile = start + frequency;
    }
    panic!("the model has no such symbol");
}
