//! The coder's side of section 9: slots in the order in which a decoder meets them, as words.

use pocketsplat_format::entropy::{FREQUENCY_TOTAL, PRECISION_BITS};

/// Where a symbol's slots begin, and how many they are.
pub type Slots = (u16, u16);

/// The slots of a raw byte.
pub fn raw(byte: u8) -> Slots {
    const EACH: u16 = FREQUENCY_TOTAL >> 8;
    (u16::from(byte) * EACH, EACH)
}

/// The words of a stream of `slots`, as bytes.
///
/// A decoder's step `state = (state div 4096)·frequency + q − start` is undone from the last symbol to the first.
pub fn words(slots: &[Slots]) -> Vec<u8> {
    let (mut state, mut words) = (0_u32, Vec::new());
    for &(start, frequency) in slots.iter().rev() {
        assert!(frequency > 0, "a symbol without slots at {start} cannot be coded");
        if state >> (u32::BITS - PRECISION_BITS) >= frequency.into() {
            words.push(state as u16);
            state >>= 16;
        }
        let (rest, part) = (state / u32::from(frequency), state % u32::from(frequency));
        state = (rest << PRECISION_BITS) + u32::from(start) + part;
    }
    while state > 0 {
        words.push(state as u16);
        state >>= 16;
    }
    words.iter().rev().flat_map(|word| word.to_le_bytes()).collect()
}

/// Frequencies in the proportions of `counts` that add up to `total`; a count of 0 gets none. All are 0 where nothing is counted.
pub fn frequencies(counts: &[u32], total: u16) -> Vec<u16> {
    let sum: u64 = counts.iter().map(|&n| u64::from(n)).sum();
    let share = |n: u32| (u64::from(n) * u64::from(total)).checked_div(sum).map_or(0, |share| share as u16);
    let mut frequencies: Vec<u16> = counts.iter().map(|&n| if n == 0 { 0 } else { share(n).max(1) }).collect();
    let Some(largest) = (0..counts.len()).filter(|&i| counts[i] > 0).max_by_key(|&i| frequencies[i]) else {
        return frequencies;
    };
    let others: u16 = frequencies.iter().sum::<u16>() - frequencies[largest];
    frequencies[largest] = total - others;
    frequencies
}
