//! From counts to integer frequencies.

use pocketsplat_format::entropy::FREQUENCY_TOTAL;

/// Frequencies that add up to [`FREQUENCY_TOTAL`] and code `counts` in few bits.
///
/// A count of 0 gets none, unless its index is `always`, which may come up all the same and gets at least one. With
/// nothing to distribute all frequencies are 0.
///
/// Rounds the ideal frequencies, then moves single slots where they change the coded length least. At most
/// [`FREQUENCY_TOTAL`] counts may be used. Cost: `O(n²)` at worst.
pub fn frequencies(counts: &[u64], always: Option<usize>) -> Vec<u32> {
    let total = counts.iter().sum::<u64>().max(1) as f64;
    let slots = u32::from(FREQUENCY_TOTAL);
    let ideal = |n: u64| n as f64 / total * f64::from(slots);
    let mut frequencies: Vec<u32> = counts
        .iter()
        .enumerate()
        .map(|(i, &n)| if n == 0 && always != Some(i) { 0 } else { (ideal(n).round() as u32).max(1) })
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
            let last = counts.len() - 1;
            let frequencies = frequencies(&counts, Some(last));
            assert_eq!(frequencies.iter().sum::<u32>(), 4096, "{counts:?}");
            for (i, (&count, &frequency)) in counts.iter().zip(&frequencies).enumerate() {
                assert_eq!(count > 0 || i == last, frequency > 0, "entry {i} of {counts:?}");
            }
        }
    }

    #[test]
    fn nothing_counted_has_no_frequency() {
        assert_eq!(frequencies(&[0, 0, 0], None), [0, 0, 0], "three unused symbols");
        assert_eq!(frequencies(&[0, 7, 0], None), [0, 4096, 0], "the only symbol is certain");
    }
}
