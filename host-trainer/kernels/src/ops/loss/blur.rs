//! A Gaussian blur of planes: 11 taps, σ 1.5 px, zero beyond the border.

use crate::real::Real;

/// Taps of the window.
const TAPS: usize = 11;
/// Pixels it reaches to each side.
const RADIUS: usize = TAPS / 2;
const SIGMA: f64 = 1.5;

/// The window's weights, which add up to 1.
pub fn window<R: Real>() -> [R; TAPS] {
    let bell: [f64; TAPS] = std::array::from_fn(|i| {
        let d = i as f64 - RADIUS as f64;
        (-d * d / (2.0 * SIGMA * SIGMA)).exp()
    });
    let sum: f64 = bell.iter().sum();
    bell.map(|b| R::real(b / sum))
}

/// Lanes that are summed in registers before they are stored.
const LANES: usize = 16;

/// `out[i] = Σ_tap window[tap]·source(tap)[i]`, in registers over the taps.
#[inline(always)]
fn weighted_sum<'a, R: Real>(window: &[R; TAPS], out: &mut [R], source: impl Fn(usize) -> &'a [R]) {
    let n = out.len();
    let mut start = 0;
    while start + LANES <= n {
        let mut sum = [R::ZERO; LANES];
        for (tap, w) in window.iter().enumerate() {
            let values = &source(tap)[start..start + LANES];
            for i in 0..LANES {
                sum[i] += *w * values[i];
            }
        }
        out[start..start + LANES].copy_from_slice(&sum);
        start += LANES;
    }
    for i in start..n {
        let mut sum = R::ZERO;
        for (tap, w) in window.iter().enumerate() {
            sum += *w * source(tap)[i];
        }
        out[i] = sum;
    }
}

/// Blurs `N` planes over rows `y0..y0 + rows` at once; `fill(n, y, line)` writes row y of plane n.
///
/// * returns `[N][rows · width]`.
#[inline(always)]
pub(super) fn blur<R: Real, const N: usize>(
    window: &[R; TAPS],
    [width, height]: [usize; 2],
    y0: usize,
    rows: usize,
    fill: impl Fn(usize, usize, &mut [R]),
) -> [Vec<R>; N] {
    let mut padded = vec![R::ZERO; width + 2 * RADIUS];
    let mut across = vec![R::ZERO; (rows + 2 * RADIUS) * width];
    let mut planes: [Vec<R>; N] = [const { Vec::new() }; N];
    for (n, out) in planes.iter_mut().enumerate() {
        for (dy, line) in across.chunks_exact_mut(width).enumerate() {
            let Some(y) = (y0 + dy).checked_sub(RADIUS).filter(|y| *y < height) else {
                line.fill(R::ZERO);
                continue;
            };
            fill(n, y, &mut padded[RADIUS..RADIUS + width]);
            weighted_sum(window, line, |tap| &padded[tap..tap + width]);
        }
        out.resize(rows * width, R::ZERO);
        for (dy, line) in out.chunks_exact_mut(width).enumerate() {
            weighted_sum(window, line, |tap| &across[(dy + tap) * width..(dy + tap + 1) * width]);
        }
    }
    planes
}
