//! The palette of harmonics: clusters of Gaussians with like coefficients.
//!
//! Clusters come of splitting: again and again the one with the largest squared error is cut at its mean along the coefficient that
//! varies most, until there are as many as wanted. It takes the work of a sort, where k-means with tens of thousands of clusters takes
//! minutes.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::MAX_PALETTE;
use crate::Gaussians;

/// Gaussians for each entry of the palette.
const GAUSSIANS_PER_ENTRY: usize = 4;

/// Numbers of one entry, RGB by coefficient.
type Entry = Vec<[f32; 3]>;

pub(super) struct Palette {
    pub(super) entries: Vec<Entry>,
    /// The entry of each Gaussian.
    pub(super) labels: Vec<u16>,
}

impl Palette {
    /// Entries follow the Gaussians that `order` lists first, so that labels of neighbours are near each other.
    pub(super) fn of(gaussians: &Gaussians, order: &[usize]) -> Self {
        let wanted = order.len().div_ceil(GAUSSIANS_PER_ENTRY).clamp(1, MAX_PALETTE);
        let mut open = BinaryHeap::from([Cluster::of(gaussians, (0..order.len()).collect())]);
        while open.len() < wanted {
            match open.pop() {
                Some(worst) if worst.error > 0.0 => {
                    let (below, above) = worst.split(gaussians);
                    open.push(below);
                    open.push(above);
                }
                Some(exact) => {
                    open.push(exact);
                    break;
                }
                None => break,
            }
        }
        let clusters = open.into_vec();
        let mut cluster_of = vec![0; order.len()];
        for (number, cluster) in clusters.iter().enumerate() {
            for &member in &cluster.members {
                cluster_of[member] = number;
            }
        }
        let mut label_of = vec![None; clusters.len()];
        let mut entries = Vec::with_capacity(clusters.len());
        let mut labels = vec![0; order.len()];
        for &index in order {
            let cluster = cluster_of[index];
            let label = *label_of[cluster].get_or_insert_with(|| {
                entries.push(clusters[cluster].mean.chunks_exact(3).map(|rgb| [rgb[0], rgb[1], rgb[2]]).collect());
                (entries.len() - 1) as u16
            });
            labels[index] = label;
        }
        Self { entries, labels }
    }
}

/// Some of the Gaussians.
struct Cluster {
    members: Vec<usize>,
    /// Mean coefficients, beyond the constant one.
    mean: Vec<f32>,
    /// Σ of the squared distances to the mean.
    error: f64,
    /// The coefficient with the largest share of it.
    widest: usize,
}

/// The coefficients of Gaussian `index` beyond the constant one.
fn numbers(gaussians: &Gaussians, index: usize) -> &[f32] {
    gaussians.harmonics_of(index)[1..].as_flattened()
}

impl Cluster {
    fn of(gaussians: &Gaussians, members: Vec<usize>) -> Self {
        let n_numbers = 3 * (gaussians.degree.n_coefficients() - 1);
        let (mut sums, mut squares) = (vec![0.0f64; n_numbers], vec![0.0f64; n_numbers]);
        for &member in &members {
            for (number, &value) in numbers(gaussians, member).iter().enumerate() {
                sums[number] += f64::from(value);
                squares[number] += f64::from(value).powi(2);
            }
        }
        let n = members.len().max(1) as f64;
        let errors: Vec<f64> =
            sums.iter().zip(&squares).map(|(sum, square)| (square - sum * sum / n).max(0.0)).collect();
        let widest = (0..n_numbers).fold(0, |best, number| if errors[number] > errors[best] { number } else { best });
        // What rounding leaves of equal numbers is no spread.
        let is_one = members.iter().all(|&member| numbers(gaussians, member) == numbers(gaussians, members[0]));
        let error = if is_one { 0.0 } else { errors.iter().sum() };
        Self { members, mean: sums.iter().map(|sum| (sum / n) as f32).collect(), error, widest }
    }

    fn split(self, gaussians: &Gaussians) -> (Self, Self) {
        let value = |member: usize| numbers(gaussians, member)[self.widest];
        let (mut below, mut above): (Vec<_>, Vec<_>) =
            self.members.iter().partition(|&&member| value(member) <= self.mean[self.widest]);
        // A mean that rounding moved beyond all of them.
        if above.is_empty() || below.is_empty() {
            let mut all = self.members.clone();
            all.sort_by(|&a, &b| value(a).total_cmp(&value(b)).then(a.cmp(&b)));
            above = all.split_off(all.len() / 2);
            below = all;
        }
        (Self::of(gaussians, below), Self::of(gaussians, above))
    }
}

impl PartialEq for Cluster {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Cluster {}

impl PartialOrd for Cluster {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Cluster {
    /// By error; clusters share no member, so the first one breaks ties the same way each time.
    fn cmp(&self, other: &Self) -> Ordering {
        self.error.total_cmp(&other.error).then(self.members.first().cmp(&other.members.first()))
    }
}
