//! A low-pass filter of a square plane.

/// A Gaussian filter, cut at a whole number of cells.
pub(super) struct LowPass {
    /// Of offsets 0, 1, …; the same to both sides.
    weights: Vec<f32>,
}

impl LowPass {
    /// w(d) = exp(−d²/2σ²) for |d| ≤ `reach`, in cells.
    pub(super) fn new(reach: usize, deviation: f64) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "weights are single")]
        let weight = |d: usize| (-0.5 * (d as f64 / deviation).powi(2)).exp() as f32;
        Self { weights: (0..=reach).map(weight).collect() }
    }

    /// Weighted means around each cell of a plane `[side, side]`, over what lies within it. Cost: two passes of 2·reach + 1 products a cell.
    pub(super) fn of(&self, plane: &[f32], side: usize) -> Vec<f32> {
        let offsets = || (0..side.min(self.weights.len())).flat_map(|d| [(d, true), (d, false)]).skip(1);
        let mut across = vec![0.0; plane.len()];
        let mut totals = vec![0.0; side];
        for (d, is_right) in offsets() {
            let weight = self.weights[d];
            let (to, from) = if is_right { (0, d) } else { (d, 0) };
            totals[to..][..side - d].iter_mut().for_each(|total| *total += weight);
            for (out, row) in across.chunks_exact_mut(side).zip(plane.chunks_exact(side)) {
                add(&mut out[to..][..side - d], &row[from..][..side - d], weight);
            }
        }
        let mut filtered = vec![0.0; plane.len()];
        for (y, out) in filtered.chunks_exact_mut(side).enumerate() {
            for (d, is_below) in offsets() {
                let row = if is_below { Some(y + d).filter(|row| *row < side) } else { y.checked_sub(d) };
                if let Some(row) = row {
                    add(out, &across[row * side..][..side], self.weights[d]);
                }
            }
            out.iter_mut().zip(&totals).for_each(|(value, total)| *value /= total * totals[y]);
        }
        filtered
    }
}

#[inline(always)]
fn add(out: &mut [f32], values: &[f32], weight: f32) {
    out.iter_mut().zip(values).for_each(|(out, value)| *out += weight * value);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_becomes_the_weighted_mean_of_what_is_around_it() {
        const SIDE: usize = 5;
        let plane: Vec<f32> = (0..25u8).map(|i| f32::from(i.wrapping_mul(i) % 7)).collect();
        let filtered = LowPass::new(2, 1.5).of(&plane, SIDE);
        for (cell, found) in filtered.iter().enumerate() {
            let (mut sum, mut total) = (0.0, 0.0);
            for (other, value) in plane.iter().enumerate() {
                let [dx, dy] = [cell % SIDE, cell / SIDE].map(|at| at as f64);
                let [dx, dy] = [dx - (other % SIDE) as f64, dy - (other / SIDE) as f64];
                if dx.abs() <= 2.0 && dy.abs() <= 2.0 {
                    let weight = (-(dx * dx + dy * dy) / 4.5).exp();
                    (sum, total) = (sum + weight * f64::from(*value), total + weight);
                }
            }
            assert!((f64::from(*found) - sum / total).abs() < 1e-5, "{cell}: {found}");
        }
        assert_eq!(LowPass::new(9, 3.0).of(&[4.0], 1), [4.0], "farther than the plane reaches");
    }
}
