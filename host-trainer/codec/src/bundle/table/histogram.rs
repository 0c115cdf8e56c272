//! How often each symbol occurs, and what it costs to code them.

/// Bits of a table entry.
const ENTRY_BITS: f64 = 16.0;
/// Bits of a table without its entries: fixed fields and its place in the list of tables.
const TABLE_BITS: f64 = 160.0;
/// Bits of an escaped symbol after the escape.
const ESCAPE_BITS: f64 = 16.0;
/// Most entries of a table: 4 KiB of flash, and fewer than there are slots.
const MAX_ENTRIES: usize = 2048;
/// The escape has at least one slot of so many.
const SLOTS: f64 = 4096.0;

/// Counts of the symbols `first..first + counts.len()`; both ends are used.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Histogram {
    first: i32,
    counts: Vec<u64>,
}

/// A histogram's middle, its tails left to the escape.
pub(super) struct Trimmed<'h> {
    /// Symbol of the first count.
    pub(super) first: i32,
    pub(super) counts: &'h [u64],
    /// Symbols outside.
    pub(super) escaped: u64,
    /// Bits of the table and of all symbols, with ideal frequencies.
    pub(super) bits: f64,
}

impl Histogram {
    /// Counts symbols.
    pub(super) fn count(symbols: impl Iterator<Item = i16>) -> Self {
        let mut all = vec![0_u64; 1 << 16];
        for symbol in symbols {
            all[(i32::from(symbol) - i32::from(i16::MIN)) as usize] += 1;
        }
        let used = |count: &u64| *count > 0;
        let Some(start) = all.iter().position(used) else { return Self { first: 0, counts: Vec::new() } };
        let end = all.iter().rposition(used).map_or(start, |last| last + 1);
        Self { first: start as i32 + i32::from(i16::MIN), counts: all[start..end].to_vec() }
    }

    /// The counts of both.
    pub(super) fn merged(&self, other: &Self) -> Self {
        if self.counts.is_empty() || other.counts.is_empty() {
            return if self.counts.is_empty() { other.clone() } else { self.clone() };
        }
        let first = self.first.min(other.first);
        let end = |h: &Self| h.first + h.counts.len() as i32;
        let mut counts = vec![0; (end(self).max(end(other)) - first) as usize];
        for histogram in [self, other] {
            let at = (histogram.first - first) as usize;
            for (sum, count) in counts[at..].iter_mut().zip(&histogram.counts) {
                *sum += count;
            }
        }
        Self { first, counts }
    }

    /// Cuts the tails off as long as the escapes cost less than the entries they save, and until the entries fit.
    pub(super) fn trimmed(&self) -> Trimmed<'_> {
        let total = self.counts.iter().sum::<u64>() as f64;
        // Bits of n symbols of one kind; the escape's frequency is at least one slot.
        let coded = |n: u64| if n == 0 { 0.0 } else { -(n as f64) * (n as f64 / total).log2() };
        let escape = |n: u64| {
            if n == 0 { 0.0 } else { n as f64 * (ESCAPE_BITS - (n as f64 / total).max(1.0 / SLOTS).log2()) }
        };
        let mut range = 0..self.counts.len();
        let mut escaped = 0;
        let mut kept_bits: f64 = self.counts.iter().map(|&n| coded(n)).sum();
        loop {
            let kept = &self.counts[range.clone()];
            // Each end with the unused symbols beside it, and what dropping it changes.
            let drop_at = |gap: usize, count: u64| {
                let change = escape(escaped + count) - escape(escaped) - coded(count);
                (gap, count, change - ENTRY_BITS * gap as f64)
            };
            let run = |mut counts: &mut dyn Iterator<Item = &u64>| {
                let count = *counts.next()?;
                let gap = 1 + (&mut counts).take_while(|&&n| n == 0).count();
                Some(drop_at(gap, count))
            };
            let (Some(low), Some(high)) = (run(&mut kept.iter()), run(&mut kept.iter().rev())) else { break };
            let at_low = low.2 < high.2;
            let (gap, count, change) = if at_low { low } else { high };
            if change >= 0.0 && kept.len() <= MAX_ENTRIES {
                break;
            }
            range = if at_low { range.start + gap..range.end } else { range.start..range.end.saturating_sub(gap) };
            range.end = range.end.max(range.start);
            escaped += count;
            kept_bits -= coded(count);
        }
        let bits = TABLE_BITS + ENTRY_BITS * range.len() as f64 + kept_bits + escape(escaped);
        let first = self.first + range.start as i32;
        Trimmed { first, counts: &self.counts[range], escaped, bits }
    }
}

#[cfg(test)]
mod tests {
    use super::Histogram;

    #[test]
    fn an_outlier_is_left_to_the_escape() {
        let symbols = (0..1000).map(|i| (i % 7) as i16).chain([5000]);
        let histogram = Histogram::count(symbols);
        let trimmed = histogram.trimmed();
        assert_eq!((trimmed.first, trimmed.counts.len(), trimmed.escaped), (0, 7, 1), "seven symbols and one escape");
    }

    #[test]
    fn merging_adds_counts() {
        let a = Histogram::count([1, 1, 2].into_iter());
        let b = Histogram::count([-1, 2].into_iter());
        assert_eq!(a.merged(&b), Histogram::count([1, 1, 2, -1, 2].into_iter()), "same as counting together");
    }

    #[test]
    fn flat_histograms_keep_to_the_largest_table() {
        let histogram = Histogram::count(-10_000..10_000);
        assert!(histogram.trimmed().counts.len() <= super::MAX_ENTRIES, "at most so many entries");
    }
}
