//! Gaussians over integers, as tables: what a context model's mean and scale make of the next symbol.
//!
//! A table holds the frequencies of d = −D..=D under N(phase/8, σ): the mass of [d − ½, d + ½] in units of 2⁻¹², at least
//! one each, and what is left is the escape's. Scales are σ = 2^((s − 32)/8) with s < 64, so neighbours differ by 9 %;
//! means are in eighths, of which five tables do, because a mean of −p/8 is the mirror image of +p/8. Means and scales
//! between those of the tables cost 0.1 % of the bits. `tools/src/bin/normal_tables.rs` writes the tables.

use super::normal_tables::{ENDS, FIRST, REACH};
use super::{AnsReader, FREQUENCY_TOTAL, PRECISION_BITS, Slot, SymbolModel, UniformByte};

/// Number of scales.
pub const N_SCALES: usize = 64;
/// Scale index of σ = 1.
pub const SCALE_ONE: i32 = 32;
/// Scale indices an octave, and parts of a step in which means are counted.
pub const EIGHTHS: i32 = 8;
/// Tables of one scale: means of 0, ⅛, ¼, ⅜ and ½.
pub const N_PHASES: usize = 5;

/// An escape byte up to here holds how far beyond the table, and the sign; above it, the symbol follows as two bytes.
const ESCAPE_NEAR: u8 = 253;

/// The distribution N(mean, σ) of an integer symbol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NormalModel {
    /// The symbol nearest to the mean; halves go up.
    centre: i32,
    /// The mean lies below `centre`: the table is read as its mirror image.
    mirrored: bool,
    /// `[2D + 1]` sums of frequencies up to and with each entry.
    ends: &'static [u16],
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

impl NormalModel {
    /// The model of mean `mean_eighths`/8 and σ = 2^((`scale` − 32)/8), `scale` limited to 0..=63.
    #[inline]
    #[must_use]
    pub fn new(mean_eighths: i32, scale: i32) -> Self {
        let centre = mean_eighths.saturating_add(EIGHTHS / 2) >> 3;
        // −4..=3 whatever the mean, so nothing wraps.
        let delta = mean_eighths.wrapping_sub(centre.wrapping_mul(EIGHTHS));
        let mirrored = delta < 0;
        let phase = delta.unsigned_abs() as usize;
        let scale = scale.clamp(0, 63) as usize;
        let reach = REACH.get(scale).map_or(0, |&reach| usize::from(reach));
        let n_entries = reach.wrapping_mul(2).wrapping_add(1);
        let first = FIRST.get(scale).map_or(0, |&first| usize::from(first)).wrapping_add(phase.wrapping_mul(n_entries));
        let ends = ENDS.get(first..first.wrapping_add(n_entries)).unwrap_or_default();
        Self { centre, mirrored, ends }
    }

    /// Decodes the next symbol of `reader`, an escaped one included.
    #[inline]
    pub fn symbol(&self, reader: &mut AnsReader<'_>) -> i16 {
        let distance = match reader.symbol(self) {
            Some(distance) => distance,
            None => match reader.symbol(&UniformByte) {
                near @ ..=ESCAPE_NEAR => {
                    let beyond = self.reach().wrapping_add(1).wrapping_add(i32::from(near >> 1));
                    if near & 1 == 0 { beyond } else { beyond.wrapping_neg() }
                }
                _ => {
                    let high = reader.symbol(&UniformByte);
                    let low = reader.symbol(&UniformByte);
                    return i16::from_be_bytes([high, low]);
                }
            },
        };
        let distance = if self.mirrored { distance.wrapping_neg() } else { distance };
        // A writer codes such symbols only where the sum is an i16.
        self.centre.wrapping_add(distance) as i16
    }

    /// The slots of `symbol`, for encoders.
    #[must_use]
    pub fn slots(&self, symbol: i16) -> SymbolSlots {
        let mut slots = SymbolSlots::default();
        let distance = i32::from(symbol).saturating_sub(self.centre);
        let distance = if self.mirrored { distance.saturating_neg() } else { distance };
        let entry = usize::try_from(distance.saturating_add(self.reach())).ok();
        if let Some((index, &end)) = entry.and_then(|index| Some((index, self.ends.get(index)?))) {
            let start = self.end_before(index);
            slots.push(start, end.wrapping_sub(start));
            return slots;
        }
        let escape = self.ends.last().copied().unwrap_or_default();
        slots.push(escape, FREQUENCY_TOTAL.wrapping_sub(escape));
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
    fn reach(&self) -> i32 {
        (self.ends.len() >> 1) as i32
    }

    #[inline]
    fn end_before(&self, index: usize) -> u16 {
        index.checked_sub(1).and_then(|before| self.ends.get(before)).copied().unwrap_or_default()
    }
}

impl SymbolModel for NormalModel {
    /// Distance from the centre, in the table's orientation; `None` is the escape.
    type Symbol = Option<i32>;

    /// Searches from the middle outwards, where most symbols are: about 0.8·σ steps.
    #[inline]
    fn slot(&self, quantile: u16) -> Slot<Option<i32>> {
        let middle = self.ends.len() >> 1;
        let mut index = middle;
        let mut start = self.end_before(index);
        if quantile < start {
            // Some entry holds the quantile, at the latest the first, which begins at 0.
            while quantile < start {
                index = index.wrapping_sub(1);
                start = self.end_before(index);
            }
            let end = self.ends.get(index).copied().unwrap_or(FREQUENCY_TOTAL);
            let distance = index.wrapping_sub(middle) as i32;
            return Slot { symbol: Some(distance), start, frequency: end.wrapping_sub(start) };
        }
        for &end in self.ends.get(index..).unwrap_or_default() {
            if quantile < end {
                let distance = index.wrapping_sub(middle) as i32;
                return Slot { symbol: Some(distance), start, frequency: end.wrapping_sub(start) };
            }
            start = end;
            index = index.wrapping_add(1);
        }
        Slot { symbol: None, start, frequency: FREQUENCY_TOTAL.wrapping_sub(start) }
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
                    let signed = if model.mirrored { -distance } else { distance };
                    assert_eq!(model.centre + signed, symbol.into(), "{model:?}");
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
        let bytes: std::vec::Vec<u8> = ENDS.iter().flat_map(|end| end.to_le_bytes()).collect();
        let crc = std::format!("they have the CRC {:#010X}.", crate::bundle::crc32(&bytes));
        assert!(include_str!("../bundle/FORMAT.md").contains(&crc.replace("0X", "0x")), "{crc}");
    }
}
