//! Gaussians over integers, as tables: what a context model's mean and scale make of the next symbol.
//!
//! A table holds the frequencies of d = −D..=D under N(phase/8, σ): the mass of [d − ½, d + ½] in units of 2⁻¹², at least
//! one each, and what is left is the escape's. Scales are σ = 2^((s − 32)/8) with s < 64, so neighbours differ by 9 %;
//! means are in eighths, of which five tables do, because a mean of −p/8 is the mirror image of +p/8. Means and scales
//! between those of the tables cost 0.1 % of the bits. `tools/src/bin/normal_tables.rs` writes them.

mod tables;

use super::{AnsReader, FREQUENCY_TOTAL, PRECISION_BITS, Slot, SymbolModel, UniformByte};
use tables::{BOUNDS, SCALES};

/// Number of scales.
pub const N_SCALES: usize = 64;
/// Scale index of σ = 1.
pub const SCALE_ONE: i32 = 32;
/// Scale indices an octave, and parts of a step in which means are counted.
pub const EIGHTHS: i32 = 8;
/// Tables of one scale: means of 0, ⅛, ¼, ⅜ and ½.
pub const N_PHASES: usize = 5;

/// Pieces of the range that have a short cut into the tables.
const N_NORMAL_SHORT_CUTS: usize = 32;

/// Bounds that a model looks at; the longest table has 125. A power of two makes every index a sound one without a
/// comparison.
const NORMAL_WINDOW: usize = 128;

/// An escape byte up to here holds how far beyond the table, and the sign; above it, the symbol follows as two bytes.
const ESCAPE_NEAR: u8 = 253;

/// The tables of one scale.
#[derive(Debug, PartialEq, Eq)]
struct Scale {
    /// Where the table of each δ begins in [`BOUNDS`], δ from −4 to 3; those of −δ and δ are the same.
    first: [u16; EIGHTHS as usize],
    /// D, the farthest symbol that has an entry.
    reach: u16,
    /// For each piece of the range an entry that begins at or before the piece's start, whatever the phase.
    short_cuts: [u8; N_NORMAL_SHORT_CUTS],
}

/// The distribution N(mean, σ) of an integer symbol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NormalModel {
    /// The symbol nearest to the mean; halves go up.
    centre: i32,
    /// The mean lies below `centre`: the table is read as its mirror image.
    mirrored: bool,
    scale: &'static Scale,
    /// Where each entry begins, where the escape begins and where it ends; then those of other tables.
    bounds: &'static [u16; NORMAL_WINDOW],
}

/// The slots that stand for one symbol, in the order in which a decoder reads them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SymbolSlots {
    slots: [(u16, u16); 4],
    n: usize,
}

impl SymbolSlots {
    /// (start, frequency) of each slot.
    #[must_use]
    pub fn as_slice(&self) -> &[(u16, u16)] {
        self.slots.get(..self.n).unwrap_or_default()
    }

    fn push(&mut self, start: u16, frequency: u16) {
        if let Some(slot) = self.slots.get_mut(self.n) {
            *slot = (start, frequency);
            self.n = self.n.saturating_add(1);
        }
    }

    fn push_byte(&mut self, byte: u8) {
        const FREQUENCY: u16 = FREQUENCY_TOTAL >> 8;
        self.push(u16::from(byte) << (PRECISION_BITS - 8), FREQUENCY);
    }
}

/// Stands where no table does, which is nowhere.
const ANY_TABLE: &[u16; NORMAL_WINDOW] = match BOUNDS.first_chunk() {
    Some(table) => table,
    None => panic!("the tables are longer"),
};

impl NormalModel {
    /// The model of mean `mean_eighths`/8 and σ = 2^((`scale` − 32)/8), `scale` limited to 0..=63.
    #[inline]
    #[must_use]
    pub fn new(mean_eighths: i32, scale: i32) -> Self {
        Self::from_shifted(mean_eighths.saturating_add(EIGHTHS / 2), scale)
    }

    /// The model of mean (`shifted` − 4)/8.
    #[inline(always)]
    pub(crate) fn from_shifted(shifted: i32, scale: i32) -> Self {
        let [narrowest, ..] = &SCALES;
        let scale = SCALES.get(scale.clamp(0, 63) as usize).unwrap_or(narrowest);
        // δ + 4: how far the mean lies from half a step below the centre.
        let part = shifted & (EIGHTHS - 1);
        let first = scale.first.get(part as usize).map_or(0, |&first| usize::from(first));
        let bounds = BOUNDS.get(first..).and_then(|bounds| bounds.first_chunk()).unwrap_or(ANY_TABLE);
        Self { centre: shifted >> 3, mirrored: part < EIGHTHS / 2, scale, bounds }
    }

    /// Decodes the next symbol of `reader`, an escaped one included.
    ///
    /// # Budget
    /// About 45 instructions on a Cortex-M4.
    #[inline(always)]
    pub fn symbol(&self, reader: &mut AnsReader<'_>) -> i16 {
        // Means that a context computes stay below 4096, so the sum is an i16.
        self.wide_symbol(reader) as i16
    }

    /// The next symbol, not yet cut to 16 bits.
    #[inline(always)]
    pub(crate) fn wide_symbol(&self, reader: &mut AnsReader<'_>) -> i32 {
        let (entry, start, frequency) = self.find(reader.quantile());
        reader.advance(start, frequency);
        let distance = (entry as i32).wrapping_sub(self.reach());
        if distance > self.reach() { self.escaped(reader) } else { self.centre.wrapping_add(self.signed(distance)) }
    }

    /// The symbol after an escape.
    #[inline(always)]
    fn escaped(&self, reader: &mut AnsReader<'_>) -> i32 {
        let near @ ..=ESCAPE_NEAR = reader.symbol(&UniformByte) else { return reader.escaped().into() };
        let beyond = self.reach().wrapping_add(1).wrapping_add(i32::from(near >> 1));
        let distance = if near & 1 == 0 { beyond } else { beyond.wrapping_neg() };
        self.centre.wrapping_add(self.signed(distance))
    }

    /// A distance from the centre in the table's orientation, or back.
    #[inline(always)]
    fn signed(&self, distance: i32) -> i32 {
        if self.mirrored { distance.wrapping_neg() } else { distance }
    }

    /// The slots of `symbol`, for encoders.
    #[must_use]
    pub fn slots(&self, symbol: i16) -> SymbolSlots {
        let mut slots = SymbolSlots::default();
        let distance = self.signed(i32::from(symbol).saturating_sub(self.centre));
        let entry =
            distance.clamp(self.reach().wrapping_neg(), self.reach().wrapping_add(1)).wrapping_add(self.reach());
        let entry = if distance.abs() > self.reach() { self.reach().wrapping_mul(2).wrapping_add(1) } else { entry };
        let start = self.bound(entry.unsigned_abs());
        let frequency = self.bound(entry.unsigned_abs().wrapping_add(1)).wrapping_sub(start);
        slots.push(start as u16, frequency as u16);
        if distance.abs() <= self.reach() {
            return slots;
        }
        let beyond = distance.unsigned_abs().saturating_sub(self.reach().unsigned_abs()).saturating_sub(1);
        let near = beyond.saturating_mul(2).saturating_add(u32::from(distance < 0));
        match u8::try_from(near) {
            Ok(near @ ..=ESCAPE_NEAR) => slots.push_byte(near),
            _ => {
                slots.push_byte(u8::MAX);
                let [high, low] = symbol.to_be_bytes();
                slots.push_byte(high);
                slots.push_byte(low);
            }
        }
        slots
    }

    /// D: symbols farther than this from the centre are escaped.
    #[inline]
    fn reach(&self) -> i32 {
        self.scale.reach.into()
    }

    /// Bound `index` of the table.
    #[inline(always)]
    fn bound(&self, index: u32) -> u32 {
        const LAST: u32 = NORMAL_WINDOW as u32 - 1;
        self.bounds.get((index & LAST) as usize).map_or(0, |&bound| bound.into())
    }

    /// Entry, start and frequency of the slot that contains `quantile`; the entry after the last is the escape.
    ///
    /// Walks from the short cut of the quantile's piece: one to three steps, whatever the scale.
    #[inline(always)]
    fn find(&self, quantile: u32) -> (u32, u32, u32) {
        const PIECE_BITS: u32 = PRECISION_BITS - N_NORMAL_SHORT_CUTS.ilog2();
        let mut entry = self.scale.short_cuts.get((quantile >> PIECE_BITS) as usize).map_or(0, |&entry| entry.into());
        let mut start = self.bound(entry);
        loop {
            let next = entry.wrapping_add(1);
            let end = self.bound(next);
            // The last bound is beyond every quantile.
            if quantile < end {
                return (entry, start, end.wrapping_sub(start));
            }
            (entry, start) = (next, end);
        }
    }
}

impl SymbolModel for NormalModel {
    /// Distance from the centre, in the table's orientation; `None` is the escape.
    type Symbol = Option<i32>;

    #[inline]
    fn slot(&self, quantile: u16) -> Slot<Option<i32>> {
        let (entry, start, frequency) = self.find(quantile.into());
        let distance = (entry as i32).wrapping_sub(self.reach());
        let symbol = (distance <= self.reach()).then_some(distance);
        Slot { symbol, start: start as u16, frequency: frequency as u16 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn models() -> impl Iterator<Item = NormalModel> {
        (0..N_SCALES as i32).flat_map(|scale| (-9..=9).map(move |mean| NormalModel::new(mean, scale)))
    }

    #[test]
    fn slots_fill_the_range_and_every_quantile_finds_its_own() {
        for model in models() {
            let mut quantile = 0;
            while quantile < FREQUENCY_TOTAL {
                let slot = model.slot(quantile);
                assert_eq!(slot.start, quantile, "{model:?}");
                assert!(slot.frequency > 0, "{model:?}");
                let last = slot.start + slot.frequency - 1;
                assert_eq!(model.slot(last), slot, "{model:?}");
                quantile += slot.frequency;
            }
            assert_eq!(quantile, FREQUENCY_TOTAL);
        }
    }

    #[test]
    fn an_encoder_and_a_decoder_mean_the_same_slot() {
        for model in models() {
            for symbol in -90..=90_i16 {
                let slots = model.slots(symbol);
                let &(start, frequency) = slots.as_slice().first().expect("at least one slot");
                let slot = model.slot(start);
                assert_eq!((slot.start, slot.frequency), (start, frequency), "{symbol} under {model:?}");
                if let Some(distance) = slot.symbol {
                    assert_eq!(model.centre + model.signed(distance), symbol.into(), "{model:?}");
                    assert_eq!(slots.as_slice().len(), 1);
                }
            }
        }
    }

    /// Φ by an alternating series; slow, and not how the tables were made.
    fn cumulative(x: f64) -> f64 {
        let mut term = x;
        let mut sum = x;
        for k in 1..400_u32 {
            let k = f64::from(k);
            term *= -x * x / (2.0 * k);
            sum += term / (2.0 * k + 1.0);
        }
        0.5 + sum / (2.0 * std::f64::consts::PI).sqrt()
    }

    #[test]
    fn frequencies_are_the_gaussians_masses() {
        for scale in 0..N_SCALES as i32 {
            let sigma = 2f64.powf(f64::from(scale - SCALE_ONE) / 8.0);
            for mean in -4..4 {
                let model = NormalModel::new(mean, scale);
                for symbol in -6..=6_i16 {
                    let [low, high] =
                        [-0.5, 0.5].map(|half| (f64::from(symbol) + half - f64::from(mean) / 8.0) / sigma);
                    if low.abs().max(high.abs()) > 5.0 {
                        continue;
                    }
                    let expected = (cumulative(high) - cumulative(low)) * f64::from(FREQUENCY_TOTAL);
                    let slots = model.slots(symbol);
                    if let [(_, frequency)] = slots.as_slice() {
                        // What lifts the tails to 1 is taken from all others in proportion.
                        let off = (f64::from(*frequency) - expected).abs();
                        let tolerance = 1.0 + 0.02 * expected;
                        assert!(off < tolerance, "σ {sigma}, mean {mean}/8, {symbol}: {frequency} against {expected}");
                    }
                }
            }
        }
    }

    #[test]
    fn far_symbols_take_a_byte_or_three() {
        let model = NormalModel::new(0, SCALE_ONE);
        let reach = model.reach() as i16;
        assert_eq!(model.slots(reach).as_slice().len(), 1);
        assert_eq!(model.slots(reach + 1).as_slice().len(), 2);
        assert_eq!(model.slots(-(reach + 127)).as_slice().len(), 2);
        assert_eq!(model.slots(reach + 128).as_slice().len(), 4);
        assert_eq!(model.slots(i16::MIN).as_slice().len(), 4);
        assert_eq!(NormalModel::new(i32::MAX, 99).slots(i16::MAX).as_slice().len(), 4, "whatever the mean");
    }

    #[test]
    fn the_format_names_the_checksum_of_the_tables() {
        let tables = &BOUNDS[..BOUNDS.len() - NORMAL_WINDOW];
        let bytes: std::vec::Vec<u8> = tables.iter().flat_map(|bound| bound.to_le_bytes()).collect();
        let crc = std::format!("the CRC {:#010X}.", crate::bundle::crc32(&bytes));
        assert!(include_str!("../bundle/FORMAT.md").contains(&crc.replace("0X", "0x")), "{crc}");
    }

    #[test]
    fn short_cuts_never_lead_beyond_a_quantile() {
        for model in models() {
            for quantile in 0..u32::from(FREQUENCY_TOTAL) {
                let (_, start, frequency) = model.find(quantile);
                assert!(start <= quantile && quantile < start + frequency, "{quantile} of {model:?}");
            }
        }
    }
}
