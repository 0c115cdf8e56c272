//! A table about to be written.

use pocketsplat_core::entropy::FREQUENCY_TOTAL;

use super::histogram::Histogram;

/// Where a symbol lies among the slots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::bundle) enum Place {
    /// It has an entry: start and frequency.
    Entry(u16, u16),
    /// It is escaped: the escape's start and frequency.
    Escape(u16, u16),
}

/// A table with its frequencies settled.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::bundle) struct TableDraft {
    pub(in crate::bundle) step: f32,
    pub(in crate::bundle) min_symbol: i16,
    /// Sums of frequencies up to and with each entry; the escape has the rest, at least 1.
    pub(in crate::bundle) ends: Vec<u16>,
}

impl TableDraft {
    /// Distributes the slots: every used entry and the escape get at least one.
    pub(super) fn new(step: f32, histogram: &Histogram) -> Self {
        let trimmed = histogram.trimmed();
        let counts: Vec<u64> = trimmed.counts.iter().copied().chain([trimmed.escaped]).collect();
        let mut frequencies = frequencies(&counts);
        frequencies.pop();
        let ends = frequencies
            .iter()
            .scan(0, |sum, frequency| {
                *sum += frequency;
                Some(*sum as u16)
            })
            .collect();
        let min_symbol = i16::try_from(trimmed.first).unwrap_or(0);
        Self { step, min_symbol, ends }
    }

    /// Where `symbol` lies.
    pub(in crate::bundle) fn place(&self, symbol: i16) -> Place {
        let entry = usize::try_from(i32::from(symbol) - i32::from(self.min_symbol)).ok();
        let start = |entry: usize| if entry == 0 { 0 } else { self.ends[entry - 1] };
        match entry.and_then(|entry| self.ends.get(entry).map(|&end| (start(entry), end))) {
            Some((start, end)) if end > start => Place::Entry(start, end - start),
            _ => {
                let start = start(self.ends.len());
                Place::Escape(start, FREQUENCY_TOTAL - start)
            }
        }
    }
}

/// Integer frequencies that add up to [`FREQUENCY_TOTAL`] and code `counts` in few bits; the last count may be 0 and
/// gets a slot all the same.
fn frequencies(counts: &[u64]) -> Vec<u32> {
    let total = counts.iter().sum::<u64>().max(1) as f64;
    let slots = u32::from(FREQUENCY_TOTAL);
    let last = counts.len() - 1;
    let ideal = |n: u64| n as f64 / total * f64::from(slots);
    let mut frequencies: Vec<u32> = counts
        .iter()
        .enumerate()
        .map(|(i, &n)| if n == 0 && i != last { 0 } else { (ideal(n).round() as u32).max(1) })
        .collect();
    let mut sum: u32 = frequencies.iter().sum();
    // Bits that `n` symbols save when their frequency grows by one.
    let gain = |n: u64, frequency: u32| n as f64 * (f64::from(frequency + 1) / f64::from(frequency)).log2();
    while sum < slots {
        let best = (0..counts.len())
            .filter(|&i| frequencies[i] > 0)
            .max_by(|&i, &j| gain(counts[i], frequencies[i]).total_cmp(&gain(counts[j], frequencies[j])));
        let Some(best) = best else { break };
        frequencies[best] += 1;
        sum += 1;
    }
    while sum > slots {
        let best = (0..counts.len())
            .filter(|&i| frequencies[i] > 1)
            .min_by(|&i, &j| gain(counts[i], frequencies[i] - 1).total_cmp(&gain(counts[j], frequencies[j] - 1)));
        let Some(best) = best else { break };
        frequencies[best] -= 1;
        sum -= 1;
    }
    frequencies
}

#[cfg(test)]
mod tests {
    use super::frequencies;

    #[test]
    fn frequencies_fill_all_slots_and_spare_no_used_symbol() {
        for counts in [vec![1, 0], vec![1_000_000, 1, 1, 0, 3], vec![3; 2000], vec![0], vec![1, 0, 0, 5, 1]] {
            let frequencies = frequencies(&counts);
            assert_eq!(frequencies.iter().sum::<u32>(), 4096, "{counts:?}");
            for (i, (&count, &frequency)) in counts.iter().zip(&frequencies).enumerate() {
                let used = count > 0 || i == counts.len() - 1;
                assert_eq!(used, frequency > 0, "entry {i} of {counts:?}");
            }
        }
    }
}
