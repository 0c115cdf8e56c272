use std::num::NonZeroU16;

use constriction::stream::Decode;
use constriction::stream::model::{DecoderModel, EntropyModel};
use constriction::stream::stack::AnsCoder;
use pocketsplat_format::Bundle;
use pocketsplat_format::entropy::{AnsReader, FREQUENCY_TOTAL, Slot, SymbolModel};
use proptest::prelude::*;

use super::{SMALL, TABLES, decoded_rows, write_random};
use crate::bundle::ChannelCoding;
use crate::bundle::chunk::{ChunkRows, Models};

/// A table over 0..n, for both readers.
#[derive(Clone, Debug)]
struct Model {
    ends: Vec<u16>,
}

impl SymbolModel for Model {
    type Symbol = usize;

    fn slot(&self, quantile: u16) -> Slot<usize> {
        let symbol = self.ends.partition_point(|&end| end <= quantile);
        let start = if symbol == 0 { 0 } else { self.ends[symbol - 1] };
        Slot { symbol, start, frequency: self.ends[symbol] - start }
    }
}

impl EntropyModel<12> for Model {
    type Symbol = usize;
    type Probability = u16;
}

impl DecoderModel<12> for Model {
    fn quantile_function(&self, quantile: u16) -> (usize, u16, NonZeroU16) {
        let slot = self.slot(quantile);
        (slot.symbol, slot.start, NonZeroU16::new(slot.frequency).expect("a slot that contains a quantile"))
    }
}

fn models() -> impl Strategy<Value = Model> {
    proptest::collection::vec(1..FREQUENCY_TOTAL, 1..40).prop_map(|mut ends| {
        ends.push(FREQUENCY_TOTAL);
        ends.sort_unstable();
        Model { ends }
    })
}

proptest! {
    /// On any words whatever, sound stream or not, both readers give the same symbols and agree on whether it ended.
    #[test]
    fn our_reader_and_constriction_agree_on_any_words(
        words in proptest::collection::vec(any::<u16>(), 0..60),
        models in proptest::collection::vec(models(), 1..5),
        n_symbols in 0..400_usize,
    ) {
        // constriction refuses a leading zero word; ours reports it at the end.
        prop_assume!(words.first() != Some(&0));
        let bytes: Vec<[u8; 2]> = words.iter().map(|word| word.to_le_bytes()).collect();
        let stack: Vec<u16> = words.iter().rev().copied().collect();
        let mut reference = AnsCoder::<u16, u32>::from_compressed(stack).expect("no leading zero");
        let mut reader = AnsReader::new(&bytes);
        for i in 0..n_symbols {
            let model = &models[i % models.len()];
            let Ok(expected) = reference.decode_symbol(model);
            prop_assert_eq!(reader.symbol(model), expected, "symbol {}", i);
        }
        prop_assert_eq!(reader.finish().is_ok(), reference.is_empty());
    }
}

/// Expects one known slot, as a decoder would that knows what comes.
struct Expected {
    start: u16,
    frequency: u16,
}

impl EntropyModel<12> for Expected {
    type Symbol = bool;
    type Probability = u16;
}

impl DecoderModel<12> for Expected {
    fn quantile_function(&self, quantile: u16) -> (bool, u16, NonZeroU16) {
        let inside = (self.start..self.start + self.frequency).contains(&quantile);
        (inside, self.start, NonZeroU16::new(self.frequency).expect("a coded slot"))
    }
}

/// What our reader makes of a bundle is what constriction's own decoder finds in its streams, slot by slot.
#[test]
fn constriction_reads_real_streams_as_our_reader_does() {
    for coder in [TABLES, ChannelCoding::Context] {
        let (_, bytes) = write_random(coder, SMALL, 500, 71, 64);
        let bundle = Bundle::parse(&bytes).expect("a sound bundle");
        let models = Models::of(&bundle);
        let chunks_start = bytes.len() - bundle.tier(0).expect("the only tier").end as usize;
        let mut rows = decoded_rows(&bundle).into_iter();
        for chunk in bundle.chunks() {
            let (sites, symbols): (Vec<_>, Vec<_>) = rows.by_ref().take(chunk.n_anchors().into()).unzip();
            let (lattice, drawn): (Vec<_>, Vec<_>) = sites.iter().map(|site| (site.lattice, site.mask)).unzip();
            let list = models.slots(ChunkRows { lattice: &lattice, drawn: &drawn, symbols: &symbols.concat() });
            let stream = &bytes[chunks_start + chunk.offset() as usize..][..chunk.n_bytes()];
            let stack: Vec<u16> = stream.as_chunks().0.iter().rev().map(|&word| u16::from_le_bytes(word)).collect();
            let mut reference = AnsCoder::<u16, u32>::from_compressed(stack).expect("no leading zero");
            for (i, [start, frequency]) in list.slots().enumerate() {
                let Ok(inside) = reference.decode_symbol(Expected { start, frequency });
                assert!(inside, "{coder:?}, chunk {}, slot {i}", chunk.index());
            }
            assert!(reference.is_empty(), "{coder:?}, chunk {}: all is read", chunk.index());
            assert_eq!(list.into_bytes(), stream, "{coder:?}, chunk {}: coded again", chunk.index());
        }
    }
}
