//! What the signs of a hash grid would cost, coded with the share of each sign.

use crate::real::Real;

/// Shares are kept this far from 0 and 1.
pub const MARGIN: f64 = 1e-6;

/// n₊·(−log₂ p) + n₋·(−log₂(1 − p)) with p = n₊/n (Chen et al. 2024, HAC), and its gradient through the signs, which
/// passes where |row| ≤ 1.
///
/// With p depending on the counts, ∂bits/∂n₊ = log₂((1 − p)/p) while n stays; a sign that changes by 2 moves n₊ by 1.
///
/// * `rows`: every value of the grid. * `weight`: of one bit in the loss. * `d_rows`: added to. * returns the bits.
pub fn forward_backward<R: Real>(rows: &[R], weight: f64, d_rows: &mut [R]) -> f64 {
    let n_positive = rows.iter().filter(|v| **v >= R::ZERO).count();
    let p = share(rows.len(), n_positive);
    let d_sign = R::real(0.5 * weight * ((1.0 - p) / p).log2());
    for (row, d) in rows.iter().zip(d_rows) {
        if row.abs() <= R::ONE {
            *d += d_sign;
        }
    }
    bits(rows.len(), n_positive)
}

/// n₊·(−log₂ p) + n₋·(−log₂(1 − p)): the bits of `n` signs of which `n_positive` are +.
pub fn bits(n: usize, n_positive: usize) -> f64 {
    let p = share(n, n_positive);
    n_positive as f64 * -p.log2() + (n as f64 - n_positive as f64) * -(1.0 - p).log2()
}

/// p.
fn share(n: usize, n_positive: usize) -> f64 {
    (n_positive as f64 / (n as f64).max(1.0)).clamp(MARGIN, 1.0 - MARGIN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_signs_cost_a_bit_and_the_rarer_sign_is_pushed_out() {
        let mut d_rows = [0.0; 4];
        assert_eq!(forward_backward(&[0.5, -0.5, 0.1, -0.1], 1.0, &mut d_rows), 4.0);
        assert_eq!(d_rows, [0.0; 4]);
        let rows = [0.5, -0.5, 0.1, 2.0];
        let bits = forward_backward(&rows, 1.0, &mut d_rows);
        let entropy = -(0.75f64 * 0.75f64.log2() + 0.25 * 0.25f64.log2());
        assert!((bits - 4.0 * entropy).abs() < 1e-12);
        assert!(d_rows[..3].iter().all(|d| *d < 0.0), "towards more of the frequent sign: {d_rows:?}");
        assert_eq!(d_rows[3], 0.0, "beyond 1 nothing passes");
    }

    #[test]
    fn the_slope_is_that_of_the_counts() {
        let bits = |positive: usize| {
            let rows: Vec<f64> = (0..100_000).map(|i| if i < positive { 0.5 } else { -0.5 }).collect();
            let mut d = vec![0.0; rows.len()];
            (forward_backward(&rows, 1.0, &mut d), d[0])
        };
        let (middle, slope) = bits(30_000);
        let difference = 0.5 * (bits(30_001).0 - bits(29_999).0);
        assert!((2.0 * slope - difference).abs() < 1e-6, "{slope} against {difference} at {middle}");
    }
}
