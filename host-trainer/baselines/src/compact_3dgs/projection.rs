//! Colours that a network gives, as harmonics of degree 3.
//!
//! cᵢ = ∫ Yᵢ(d)·Y₀·f(d) over all directions d, by Gauss's rule of six heights and twelve directions at each: exact where f is a polynomial
//! of degree 8 at most. What f has beyond degree 3 is lost.

use pocketsplat_gaussians::Degree;
use pocketsplat_kernels::ops::image::spherical_harmonics::{MOST, basis};
use pocketsplat_kernels::ops::simd::Level;
use rayon::prelude::*;

use super::field::{Field, input};
use super::grid::{contracted, features};
use super::network;

/// Gauss–Legendre heights and weights; the other three are below (Abramowitz and Stegun 1964, table 25.4).
const HEIGHTS: [(f64, f64); 3] = [
    (0.238_619_186_083_196_9, 0.467_913_934_572_691),
    (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (0.932_469_514_203_152, 0.171_324_492_379_170_3),
];

/// Directions at a height.
const AROUND: usize = 12;

/// Gaussians of one task.
const BLOCK: usize = 64;

/// A direction, and Yᵢ(d)·Y₀ times the area that it stands for.
type Node = ([f32; 3], [f32; MOST]);

/// The harmonics `[N · 16]` of places.
pub(super) fn harmonics(field: &Field<f32>, centres: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let nodes = nodes();
    let level = Level::detect();
    let mut out = vec![[0.0; 3]; MOST * centres.len()];
    out.par_chunks_mut(BLOCK * MOST).zip(centres.par_chunks(BLOCK)).for_each(|(out, centres)| {
        level.run(
            #[inline(always)]
            || {
                for (out, centre) in out.chunks_exact_mut(MOST).zip(centres) {
                    let features = features(&field.levels, &field.rows, contracted(*centre));
                    for (direction, shares) in &nodes {
                        let colour = network::forward(&field.weights, &input(&features, *direction)).out;
                        for (c, share) in out.iter_mut().zip(shares) {
                            (0..3).for_each(|channel| c[channel] += share * colour[channel]);
                        }
                    }
                }
            },
        );
    });
    out
}

#[expect(clippy::cast_possible_truncation, reason = "single precision")]
fn nodes() -> Vec<Node> {
    let half = 0.75f64.sqrt();
    let quarter = [(1.0, 0.0), (half, 0.5), (0.5, half)];
    // Of twelve directions each quarter is the one before, turned.
    let around = (0..4).flat_map(|turn| {
        quarter.map(|(x, y)| match turn {
            0 => (x, y),
            1 => (-y, x),
            2 => (-x, -y),
            _ => (y, -x),
        })
    });
    let heights = HEIGHTS.into_iter().flat_map(|(z, weight)| [(z, weight), (-z, weight)]);
    let node = |((z, weight), (x, y)): ((f64, f64), (f64, f64))| {
        let radius = (1.0f64 - z * z).sqrt();
        let direction = [radius * x, radius * y, z];
        let area = weight * 2.0 * std::f64::consts::PI / AROUND as f64;
        let values = basis(Degree::Three, direction);
        (direction.map(|x| x as f32), values.map(|value| (value * values[0] * area) as f32))
    };
    heights.flat_map(|height| around.clone().map(move |turn| node((height, turn)))).collect()
}

#[cfg(test)]
mod tests {
    use pocketsplat_kernels::finite_difference::random;

    use super::*;

    #[test]
    fn harmonics_of_degree_three_come_back() {
        let c = random(1, MOST);
        let nodes = nodes();
        assert_eq!(nodes.len(), 72);
        let mut found = [0.0; MOST];
        for (direction, shares) in &nodes {
            let values = basis(Degree::Three, direction.map(f64::from));
            // A colour that needs degree 3, and some of degree 4, which is orthogonal to it.
            let [x, y, z] = direction.map(f64::from);
            let colour =
                values.iter().zip(&c).map(|(y, c)| y * c).sum::<f64>() / values[0] + x * y * (7.0 * z * z - 1.0);
            found.iter_mut().zip(shares).for_each(|(found, share)| *found += f64::from(*share) * colour);
        }
        for (found, c) in found.iter().zip(&c) {
            assert!((found - c).abs() < 1e-5, "{found}, expected {c}");
        }
    }
}
