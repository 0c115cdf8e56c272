//! 256 numbers that stand for all: k-means on a line.

const ENTRIES: usize = 256;

/// Rounds of Lloyd's algorithm; on a line it has settled long before.
const ROUNDS: usize = 20;

/// A table that bytes index, in ascending order.
pub(super) struct Codebook(Vec<f32>);

impl Codebook {
    /// The table with a small sum of squared distances to `values`, of which there is one at least.
    pub(super) fn of(values: impl Iterator<Item = f32>) -> Self {
        let mut sorted: Vec<f32> = values.collect();
        sorted.sort_unstable_by(f32::total_cmp);
        let mut distinct = sorted.clone();
        distinct.dedup();
        if distinct.len() <= ENTRIES {
            let last = distinct.last().copied().unwrap_or(0.0);
            distinct.resize(ENTRIES, last);
            return Self(distinct);
        }
        let mut sums = vec![0.0f64];
        sums.extend(sorted.iter().scan(0.0, |sum, &value| {
            *sum += f64::from(value);
            Some(*sum)
        }));
        // Half of the entries by rank, half by distance: dense and wide parts both have some at the start.
        let (least, range) = (sorted[0], sorted[sorted.len() - 1] - sorted[0]);
        let mut entries: Vec<f32> = (0..ENTRIES / 2)
            .flat_map(|index| {
                let share = (index as f32 + 0.5) / (ENTRIES / 2) as f32;
                [sorted[(share * sorted.len() as f32) as usize], least + share * range]
            })
            .collect();
        entries.sort_unstable_by(f32::total_cmp);
        for _ in 0..ROUNDS {
            let mut start = 0;
            for index in 0..ENTRIES {
                let end = match entries.get(index + 1) {
                    Some(next) => {
                        let middle = f32::midpoint(entries[index], *next);
                        start + sorted[start..].partition_point(|&value| value <= middle)
                    }
                    None => sorted.len(),
                };
                if end > start {
                    entries[index] = ((sums[end] - sums[start]) / (end - start) as f64) as f32;
                }
                start = end;
            }
            entries.sort_unstable_by(f32::total_cmp);
        }
        Self(entries)
    }

    pub(super) fn values(&self) -> &[f32] {
        &self.0
    }

    /// The entry nearest to `value`.
    pub(super) fn index_of(&self, value: f32) -> u8 {
        let above = self.0.partition_point(|&entry| entry < value).min(ENTRIES - 1);
        let below = above.saturating_sub(1);
        let nearest = if (value - self.0[below]).abs() <= (self.0[above] - value).abs() { below } else { above };
        nearest as u8
    }
}

#[cfg(test)]
mod tests {
    use super::Codebook;

    #[test]
    fn few_numbers_are_kept_as_they_are() {
        let book = Codebook::of([3.0, -1.0, 3.0, 0.5].into_iter());
        for value in [3.0, -1.0, 0.5] {
            assert_eq!(book.values()[usize::from(book.index_of(value))], value);
        }
        assert_eq!(book.values().len(), 256);
    }

    #[test]
    fn many_numbers_are_near_their_entry() {
        let values: Vec<f32> = (0..10_000).map(|index| (index as f32 / 10_000.0).powi(3)).collect();
        let book = Codebook::of(values.iter().copied());
        let mean =
            values.iter().map(|&value| (book.values()[usize::from(book.index_of(value))] - value).abs()).sum::<f32>()
                / 10_000.0;
        assert!(mean < 0.3 / 256.0, "mean distance {mean}");
    }
}
