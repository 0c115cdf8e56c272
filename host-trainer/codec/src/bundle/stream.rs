//! Slots in reading order, and the ANS words that hold them.

use std::num::NonZeroU16;
use std::ops::AddAssign;

use constriction::stream::model::{EncoderModel, EntropyModel};
use constriction::stream::stack::AnsCoder;
use pocketsplat_format::entropy::{FREQUENCY_TOTAL, PRECISION_BITS, Slot};

/// The precision as `constriction` wants it.
const PRECISION: usize = PRECISION_BITS as usize;

/// What a slot of a chunk's stream says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Position,
    Mask,
    Feature,
    LogScale,
    Offset,
}

/// Information content of a stream by what it says, bits: the ideal length, before ANS rounds to words.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct PartBits {
    /// Lattice positions.
    pub positions: f64,
    /// Which offsets are drawn.
    pub masks: f64,
    /// Features.
    pub features: f64,
    /// Log-scales.
    pub log_scales: f64,
    /// Offsets.
    pub offsets: f64,
}

impl PartBits {
    /// All parts together.
    pub fn total(&self) -> f64 {
        self.positions + self.masks + self.features + self.log_scales + self.offsets
    }

    fn of(&mut self, part: Part) -> &mut f64 {
        match part {
            Part::Position => &mut self.positions,
            Part::Mask => &mut self.masks,
            Part::Feature => &mut self.features,
            Part::LogScale => &mut self.log_scales,
            Part::Offset => &mut self.offsets,
        }
    }
}

impl AddAssign for PartBits {
    fn add_assign(&mut self, other: Self) {
        self.positions += other.positions;
        self.masks += other.masks;
        self.features += other.features;
        self.log_scales += other.log_scales;
        self.offsets += other.offsets;
    }
}

/// The slots of one stream, in the order in which a decoder meets them.
#[derive(Clone, Debug, Default)]
pub struct SlotList {
    slots: Vec<FixedSlot>,
    pub(super) bits: PartBits,
}

impl SlotList {
    /// Appends a slot of a chunk; its frequency is at least 1.
    pub(super) fn push<S>(&mut self, part: Part, slot: &Slot<S>) {
        self.append(slot);
        *self.bits.of(part) += f64::from(FREQUENCY_TOTAL).log2() - f64::from(slot.frequency).log2();
    }

    /// Appends a slot without counting its bits; its frequency is at least 1.
    pub fn append<S>(&mut self, slot: &Slot<S>) {
        debug_assert!(slot.frequency > 0, "a slot that cannot be coded");
        // What is certain changes no state and takes no bits.
        if slot.frequency < FREQUENCY_TOTAL {
            self.slots.push(FixedSlot { start: slot.start, frequency: slot.frequency });
        }
    }

    /// Start and frequency of each slot that takes bits.
    #[cfg(test)]
    pub(super) fn slots(&self) -> impl Iterator<Item = [u16; 2]> {
        self.slots.iter().map(|slot| [slot.start, slot.frequency])
    }

    /// The words of the stream in reading order, as bytes: what [`AnsReader`](pocketsplat_format::entropy::AnsReader) reads.
    pub fn into_bytes(self) -> Vec<u8> {
        let mut coder = AnsCoder::<u16, u32>::new();
        // A stack: what is read first is written last. Memory takes any number of words, and a slot without frequency,
        // which `push` rules out, would show when the bundle is read back.
        let _ = coder.encode_symbols_reverse(self.slots.iter().map(|slot| ((), *slot)));
        let Ok(words) = coder.into_compressed();
        words.iter().rev().flat_map(|word| word.to_le_bytes()).collect()
    }
}

/// One known slot, for the encoder: it codes "this slot".
#[derive(Clone, Copy, Debug)]
struct FixedSlot {
    start: u16,
    frequency: u16,
}

impl EntropyModel<PRECISION> for FixedSlot {
    type Symbol = ();
    type Probability = u16;
}

impl EncoderModel<PRECISION> for FixedSlot {
    fn left_cumulative_and_probability(&self, _symbol: impl std::borrow::Borrow<()>) -> Option<(u16, NonZeroU16)> {
        NonZeroU16::new(self.frequency).map(|frequency| (self.start, frequency))
    }
}
