//! Blends splats tile by tile, and takes the image's gradient back to them.
//!
//! Per pixel, front to back: α = min(0.99, o·exp(−½·dᵀ·Σ'⁻¹·d)), skipped below 1/255; the pixel stops before a splat
//! that would bring its transmittance below 1e-4; colour += T·α·c, T ← T·(1 − α); at the end colour += T·background
//! (Kerbl et al. 2023, eq. 3 and their constants).
//!
//! One row of a tile is one vector of [`TILE_PX`] lanes, and the same loop runs under AVX-512, AVX2 or the baseline,
//! chosen at run time. No multiplication is fused with an addition, so all of them give the same bits. Gradients go to
//! one slot per (tile, splat) pair and are summed per splat in tile order: no result depends on the number of threads.

use rayon::prelude::*;

use super::Real;
use super::project::{ALPHA_CUTOFF, Footprint, Splat};
use super::simd::Level;
use super::tiles::{TILE_PX, TileLists};

/// Largest opacity of one contribution.
const ALPHA_MAX: f64 = 0.99;
/// A pixel stops before its transmittance falls below this: what lies behind moves no 8-bit channel by half a step.
const TRANSMITTANCE_STOP: f64 = 1e-4;

/// Values of one channel of a tile.
const TILE_VALUES: usize = TILE_PX * TILE_PX;

type Row<R> = [R; TILE_PX];

/// An image in tile order with the transmittance that is left, as [`forward`] writes and [`backward`] reads it.
#[derive(Clone, Debug, Default)]
pub struct TiledImage<R> {
    /// `[n_tiles, 3, 16, 16]` colour, background included.
    pub colour: Vec<R>,
}

/// Copies between tile order and planes `[3, height, width]`.
impl<R: Real> TiledImage<R> {
    /// An image of zeros for a grid of tiles.
    pub fn zeros(grid: [usize; 2]) -> Self {
        Self { colour: vec![R::ZERO; grid[0] * grid[1] * 3 * TILE_VALUES] }
    }

    /// Row-major planes `[3, height, width]`.
    pub fn to_planes(&self, size_px: [usize; 2]) -> Vec<R> {
        let [width, height] = size_px;
        let across = width.div_ceil(TILE_PX);
        let mut planes = vec![R::ZERO; 3 * width * height];
        planes.par_chunks_mut(width).enumerate().for_each(|(i, row)| {
            let (channel, y) = (i / height, i % height);
            for (tx, out) in row.chunks_mut(TILE_PX).enumerate() {
                let at = ((y / TILE_PX * across + tx) * 3 + channel) * TILE_VALUES + y % TILE_PX * TILE_PX;
                out.copy_from_slice(&self.colour[at..at + out.len()]);
            }
        });
        planes
    }

    /// The reverse of [`Self::to_planes`]; pixels beyond the image are zero.
    pub fn from_planes(planes: &[R], size_px: [usize; 2]) -> Self {
        let [width, height] = size_px;
        let grid = size_px.map(|s| s.div_ceil(TILE_PX));
        let mut image = Self::zeros(grid);
        image.colour.par_chunks_mut(TILE_VALUES).enumerate().for_each(|(i, tile)| {
            let (t, channel) = (i / 3, i % 3);
            let (x, y) = (t % grid[0] * TILE_PX, t / grid[0] * TILE_PX);
            let n = TILE_PX.min(width - x);
            for (dy, out) in tile.chunks_exact_mut(TILE_PX).enumerate().take(height - y) {
                let at = (channel * height + y + dy) * width + x;
                out[..n].copy_from_slice(&planes[at..at + n]);
            }
        });
        image
    }
}

/// Rows `first..end` of a tile that a splat of this vertical reach has pixel centres in.
#[inline(always)]
fn rows<R: Real>(mean_y: R, half_extent_y: R, tile_y: usize) -> (usize, usize) {
    let centre: f64 = Into::<f64>::into(mean_y) - tile_y as f64 - 0.5;
    let half: f64 = half_extent_y.into();
    // The extent is rounded; the cutoff compares alpha.
    let half = half + half * 1e-5 + 1e-4;
    let limit = TILE_PX as f64;
    let first = (centre - half).larger(-1.0).smaller(limit);
    let end = (centre + half).larger(-1.0).smaller(limit);
    #[expect(clippy::cast_possible_truncation, reason = "1 to 17 after the shift by 2")]
    let bounds = ((first + 2.0) as i32, (end + 2.0) as i32);
    // ceil(first) and floor(end) + 1, with the shift taken off; truncation is floor for what is positive.
    let first = bounds.0 - 2 + i32::from(f64::from(bounds.0) < first + 2.0);
    (first.max(0) as usize, (bounds.1 - 1).clamp(0, TILE_PX as i32) as usize)
}

/// Alpha along one row, before the stop rule; zero where it is not drawn.
///
/// Also gives exp(power) and dx for the backward pass.
#[inline(always)]
fn alpha_row<R: Real>(splat: &Splat<R>, dx0: R, dy: R) -> (Row<R>, Row<R>, Row<R>) {
    let [a, b, c] = splat.conic;
    let (half_a, slope, constant) = (R::real(-0.5) * a, -(b * dy), R::real(-0.5) * c * dy * dy);
    let (mut alpha, mut bell, mut dx) = ([R::ZERO; TILE_PX], [R::ZERO; TILE_PX], [R::ZERO; TILE_PX]);
    for i in 0..TILE_PX {
        dx[i] = dx0 + R::real(i as f64);
        // Rounding can lift the exponent of a degenerate conic above zero.
        let power = (constant + (half_a * dx[i] + slope) * dx[i]).smaller(R::ZERO);
        bell[i] = power.larger(R::real(-80.0)).exp();
        let raw = splat.opacity * bell[i];
        alpha[i] = if raw < R::real(ALPHA_CUTOFF) { R::ZERO } else { raw.smaller(R::real(ALPHA_MAX)) };
    }
    (alpha, bell, dx)
}

/// Whether an ellipse's bounding box brought up a row that the ellipse does not reach.
#[inline(always)]
fn draws_nothing<R: Real>(alpha: &Row<R>) -> bool {
    let mut any = false;
    for a in alpha {
        any |= *a > R::ZERO;
    }
    !any
}

/// Applies the stop rule to one row: gives the weights T·α and moves T on.
///
/// A stopped pixel keeps its transmittance with a negative sign.
#[inline(always)]
fn step_row<R: Real>(alpha: &mut Row<R>, transmittance: &mut Row<R>) -> Row<R> {
    let mut weight = [R::ZERO; TILE_PX];
    for i in 0..TILE_PX {
        let t = transmittance[i];
        let after = t * (R::ONE - alpha[i]);
        let live = t > R::ZERO;
        let draws = live & (after >= R::real(TRANSMITTANCE_STOP));
        alpha[i] = if draws { alpha[i] } else { R::ZERO };
        weight[i] = alpha[i] * t;
        transmittance[i] = if draws {
            after
        } else if live {
            -t
        } else {
            t
        };
    }
    weight
}

/// How many splats go by between two looks for rows that have stopped; looking costs as much as a row.
const LOOK_EVERY: usize = 8;

/// Marks rows in which every pixel has stopped; says whether all have. Skipping them changes no pixel.
#[inline(always)]
fn mark_dead<R: Real>(transmittance: &[Row<R>; TILE_PX], dead: &mut [bool; TILE_PX]) -> bool {
    let mut all = true;
    for (row, dead) in transmittance.iter().zip(dead) {
        *dead = *dead
            || !(reduce(
                row,
                #[inline(always)]
                |a, b| a.larger(b),
            ) > R::ZERO);
        all &= *dead;
    }
    all
}

/// Combines the lanes in a fixed tree, which vectorises.
#[inline(always)]
fn reduce<R: Real>(row: &Row<R>, combine: impl Fn(R, R) -> R) -> R {
    let mut lanes = *row;
    let mut width = TILE_PX / 2;
    while width > 0 {
        for i in 0..width {
            lanes[i] = combine(lanes[i], lanes[i + width]);
        }
        width /= 2;
    }
    lanes[0]
}

#[inline(always)]
fn forward_tile<R: Real>(tile: &Tile<'_, R>, background: [R; 3], out: &mut [R]) {
    let mut transmittance = [[R::ONE; TILE_PX]; TILE_PX];
    let mut colour = [[[R::ZERO; TILE_PX]; TILE_PX]; 3];
    let mut dead = [false; TILE_PX];
    for (n, entry) in tile.entries.iter().enumerate() {
        let (splat, first, end) = tile.splat(*entry);
        let dx0 = R::real(tile.origin[0] as f64 + 0.5) - splat.mean_px[0];
        for y in first..end {
            if dead[y] {
                continue;
            }
            let dy = R::real((tile.origin[1] + y) as f64 + 0.5) - splat.mean_px[1];
            let (mut alpha, _, _) = alpha_row(splat, dx0, dy);
            if draws_nothing(&alpha) {
                continue;
            }
            let weight = step_row(&mut alpha, &mut transmittance[y]);
            for (plane, c) in colour.iter_mut().zip(splat.colour) {
                for (out, w) in plane[y].iter_mut().zip(&weight) {
                    *out += *w * c;
                }
            }
        }
        if n % LOOK_EVERY == 0 && mark_dead(&transmittance, &mut dead) {
            break;
        }
    }
    for ((plane, bg), out) in colour.iter().zip(background).zip(out.chunks_exact_mut(TILE_VALUES)) {
        for ((c, t), o) in plane.as_flattened().iter().zip(transmittance.as_flattened()).zip(out) {
            *o = *c + t.abs() * bg;
        }
    }
}

/// What one tile draws.
struct Tile<'a, R> {
    splats: &'a [Splat<R>],
    footprints: &'a [Footprint<R>],
    entries: &'a [u32],
    /// Its first pixel.
    origin: [usize; 2],
}

impl<'a, R: Real> Tile<'a, R> {
    fn new(splats: &'a [Splat<R>], footprints: &'a [Footprint<R>], lists: &'a TileLists, t: usize) -> Self {
        let origin = [t % lists.grid[0] * TILE_PX, t / lists.grid[0] * TILE_PX];
        Self { splats, footprints, entries: lists.tile(t), origin }
    }

    /// A splat and the rows of the tile that it reaches.
    #[inline(always)]
    fn splat(&self, entry: u32) -> (&'a Splat<R>, usize, usize) {
        let splat = &self.splats[entry as usize];
        let (first, end) = rows(splat.mean_px[1], self.footprints[entry as usize].half_extent_px[1], self.origin[1]);
        (splat, first, end)
    }
}

/// Draws all tiles.
///
/// * `splats`, `footprints`: `[n]`. * `background`: RGB. * returns the colour in tile order; pixels beyond the image's
///   edge are drawn like any other and dropped by [`TiledImage::to_planes`].
pub fn forward<R: Real>(
    level: Level,
    splats: &[Splat<R>],
    footprints: &[Footprint<R>],
    lists: &TileLists,
    background: [R; 3],
) -> TiledImage<R> {
    let mut image = TiledImage::zeros(lists.grid);
    image.colour.par_chunks_mut(3 * TILE_VALUES).enumerate().for_each(|(t, out)| {
        let tile = Tile::new(splats, footprints, lists, t);
        level.run(
            #[inline(always)]
            || forward_tile(&tile, background, out),
        );
    });
    image
}

/// Lane sums of one (tile, splat) pair's gradient; dp is dL/d(power), dx and dy the distance to the splat's centre.
#[derive(Default)]
struct PairSums<R> {
    dp_dx: Row<R>,
    dp_dy: Row<R>,
    dp_dx_dx: Row<R>,
    dp_dx_dy: Row<R>,
    dp_dy_dy: Row<R>,
    opacity: Row<R>,
    colour: [Row<R>; 3],
}

impl<R: Real> PairSums<R> {
    /// From power = −½(a·dx² + c·dy²) − b·dx·dy.
    #[inline(always)]
    fn gradient(&self, splat: &Splat<R>) -> Splat<R> {
        let sum = |row: &Row<R>| {
            reduce(
                row,
                #[inline(always)]
                |a, b| a + b,
            )
        };
        let [a, b, c] = splat.conic;
        let half = R::real(-0.5);
        let (dx, dy) = (sum(&self.dp_dx), sum(&self.dp_dy));
        Splat {
            mean_px: [a * dx + b * dy, b * dx + c * dy],
            conic: [half * sum(&self.dp_dx_dx), -sum(&self.dp_dx_dy), half * sum(&self.dp_dy_dy)],
            opacity: sum(&self.opacity),
            colour: [sum(&self.colour[0]), sum(&self.colour[1]), sum(&self.colour[2])],
        }
    }
}

#[inline(always)]
fn backward_tile<R: Real>(tile: &Tile<'_, R>, image: &[R], d_image: &[R], d_pairs: &mut [Splat<R>]) {
    let zero = [R::ZERO; TILE_PX];
    let mut transmittance = [[R::ONE; TILE_PX]; TILE_PX];
    let mut dead = [false; TILE_PX];
    let mut d_rows = [[zero; TILE_PX]; 3];
    // What of g·C has not been blended yet: ∂L/∂α_i = T_i·(c_i·g) − rest_i/(1 − α_i), and rest shrinks front to back,
    // so that the pass can run in the order of the forward pass and stop where it stopped.
    let mut rest = [zero; TILE_PX];
    for (channel, plane) in d_rows.iter_mut().enumerate() {
        for (y, row) in plane.iter_mut().enumerate() {
            let at = channel * TILE_VALUES + y * TILE_PX;
            row.copy_from_slice(&d_image[at..at + TILE_PX]);
            for i in 0..TILE_PX {
                rest[y][i] += image[at + i] * row[i];
            }
        }
    }
    for (n, (entry, d_pair)) in tile.entries.iter().zip(d_pairs).enumerate() {
        let (splat, first, end) = tile.splat(*entry);
        let dx0 = R::real(tile.origin[0] as f64 + 0.5) - splat.mean_px[0];
        let [red, green, blue] = splat.colour;
        let mut sums = PairSums::<R>::default();
        for y in first..end {
            if dead[y] {
                continue;
            }
            let dy = R::real((tile.origin[1] + y) as f64 + 0.5) - splat.mean_px[1];
            let (mut alpha, bell, dx) = alpha_row(splat, dx0, dy);
            if draws_nothing(&alpha) {
                continue;
            }
            let before = transmittance[y];
            let weight = step_row(&mut alpha, &mut transmittance[y]);
            let [d_red, d_green, d_blue] = [&d_rows[0][y], &d_rows[1][y], &d_rows[2][y]];
            let mut d_power = zero;
            for i in 0..TILE_PX {
                let shade = red * d_red[i] + green * d_green[i] + blue * d_blue[i];
                rest[y][i] -= weight[i] * shade;
                let d_alpha = before[i] * shade - rest[y][i] / (R::ONE - alpha[i]);
                // Neither a skipped nor a saturated alpha follows its splat.
                let follows = (alpha[i] > R::ZERO) & (alpha[i] < R::real(ALPHA_MAX));
                let d_alpha = if follows { d_alpha } else { R::ZERO };
                d_power[i] = d_alpha * alpha[i];
                sums.opacity[i] += d_alpha * bell[i];
            }
            for i in 0..TILE_PX {
                sums.colour[0][i] += weight[i] * d_red[i];
                sums.colour[1][i] += weight[i] * d_green[i];
                sums.colour[2][i] += weight[i] * d_blue[i];
            }
            for i in 0..TILE_PX {
                let dp_dx = d_power[i] * dx[i];
                let dp_dy = d_power[i] * dy;
                sums.dp_dx[i] += dp_dx;
                sums.dp_dy[i] += dp_dy;
                sums.dp_dx_dx[i] += dp_dx * dx[i];
                sums.dp_dx_dy[i] += dp_dx * dy;
                sums.dp_dy_dy[i] += dp_dy * dy;
            }
        }
        *d_pair = sums.gradient(splat);
        if n % LOOK_EVERY == 0 && mark_dead(&transmittance, &mut dead) {
            break;
        }
    }
}

/// Gradient of [`forward`] with respect to every splat.
///
/// * `image`: what forward returned. * `d_image`: dL/d(image), tile order, zero beyond the image's edge.
/// * returns `[n]`, zero for splats that no tile lists.
pub fn backward<R: Real>(
    level: Level,
    splats: &[Splat<R>],
    footprints: &[Footprint<R>],
    lists: &TileLists,
    image: &TiledImage<R>,
    d_image: &TiledImage<R>,
) -> Vec<Splat<R>> {
    let mut d_pairs = vec![Splat::default(); lists.entries.len()];
    let mut tiles = Vec::with_capacity(lists.n_tiles());
    let mut rest = d_pairs.as_mut_slice();
    for t in 0..lists.n_tiles() {
        let (tile, after) = rest.split_at_mut(lists.tile(t).len());
        tiles.push(tile);
        rest = after;
    }
    let values = 3 * TILE_VALUES;
    tiles
        .into_par_iter()
        .zip(image.colour.par_chunks(values))
        .zip(d_image.colour.par_chunks(values))
        .enumerate()
        .for_each(|(t, ((d_pairs, image), d_image))| {
            let tile = Tile::new(splats, footprints, lists, t);
            level.run(
                #[inline(always)]
                || backward_tile(&tile, image, d_image, d_pairs),
            );
        });
    (0..splats.len())
        .into_par_iter()
        .with_min_len(1024)
        .map(|s| {
            let mut sum = Splat::default();
            for slot in lists.slots_of(s) {
                add(&mut sum, &d_pairs[*slot as usize]);
            }
            sum
        })
        .collect()
}

fn add<R: Real>(sum: &mut Splat<R>, part: &Splat<R>) {
    for i in 0..2 {
        sum.mean_px[i] += part.mean_px[i];
    }
    for i in 0..3 {
        sum.conic[i] += part.conic[i];
        sum.colour[i] += part.colour[i];
    }
    sum.opacity += part.opacity;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ops::finite_difference::{assert_piecewise_gradient, random};
    use crate::ops::tiles;

    const SIZE: [usize; 2] = [37, 21];

    fn unpack(x: &[f64]) -> Vec<Splat<f64>> {
        x.chunks_exact(9)
            .map(|v| Splat {
                mean_px: [v[0], v[1]],
                conic: [v[2], v[3], v[4]],
                opacity: v[5],
                colour: [v[6], v[7], v[8]],
            })
            .collect()
    }

    fn pack(splats: &[Splat<f64>]) -> Vec<f64> {
        splats.iter().flat_map(|s| [&s.mean_px[..], &s.conic, &[s.opacity], &s.colour].concat()).collect()
    }

    fn footprints(splats: &[Splat<f64>]) -> Vec<Footprint<f64>> {
        splats
            .iter()
            .enumerate()
            .map(|(i, s)| {
                let det = s.conic[0] * s.conic[2] - s.conic[1] * s.conic[1];
                let reach = 2.0 * (255.0 * s.opacity).ln();
                let half_extent_px = [(reach * s.conic[2] / det).sqrt(), (reach * s.conic[0] / det).sqrt()];
                Footprint { depth: 1.0 + i as f64, half_extent_px }
            })
            .collect()
    }

    fn lists(splats: &[Splat<f64>]) -> TileLists {
        tiles::build(splats, &footprints(splats), SIZE)
    }

    fn scene(seed: u64, n: usize, opacity: f64) -> Vec<f64> {
        random(seed, n * 9)
            .chunks_exact(9)
            .flat_map(|v| {
                let (sx, sy) = (3.0 + 2.5 * v[2], 3.0 + 2.5 * v[3]);
                let rho = 0.8 * v[4];
                let k = 1.0 / (1.0 - rho * rho);
                [
                    SIZE[0] as f64 * (0.5 + 0.6 * v[0]),
                    SIZE[1] as f64 * (0.5 + 0.6 * v[1]),
                    k / (sx * sx),
                    -k * rho / (sx * sy),
                    k / (sy * sy),
                    opacity * (0.6 + 0.35 * v[5]),
                    v[6].abs(),
                    v[7].abs(),
                    v[8].abs(),
                ]
            })
            .collect()
    }

    fn draw(splats: &[Splat<f64>], background: [f64; 3]) -> Vec<f64> {
        forward(Level::detect(), splats, &footprints(splats), &lists(splats), background).to_planes(SIZE)
    }

    /// The same pixels without tiles, rows or vectors.
    fn draw_plainly(splats: &[Splat<f64>], background: [f64; 3]) -> Vec<f64> {
        let [width, height] = SIZE;
        let mut planes = vec![0.0; 3 * width * height];
        for p in 0..width * height {
            let (px, py) = ((p % width) as f64 + 0.5, (p / width) as f64 + 0.5);
            let (mut t, mut colour) = (1.0, [0.0; 3]);
            for s in splats {
                let (dx, dy) = (px - s.mean_px[0], py - s.mean_px[1]);
                let power = -0.5 * (s.conic[0] * dx * dx + s.conic[2] * dy * dy) - s.conic[1] * dx * dy;
                let alpha = (s.opacity * power.exp()).min(0.99);
                if alpha < 1.0 / 255.0 {
                    continue;
                }
                if t * (1.0 - alpha) < 1e-4 {
                    break;
                }
                for i in 0..3 {
                    colour[i] += t * alpha * s.colour[i];
                }
                t *= 1.0 - alpha;
            }
            for i in 0..3 {
                planes[i * width * height + p] = colour[i] + t * background[i];
            }
        }
        planes
    }

    #[test]
    fn tiles_and_vectors_change_nothing() {
        for (seed, opacity) in [(1, 1.0), (2, 0.2), (3, 1.4)] {
            let splats = unpack(&scene(seed, 60, opacity));
            let background = [0.2, 0.4, 0.6];
            for (a, b) in draw(&splats, background).iter().zip(draw_plainly(&splats, background)) {
                assert!((a - b).abs() < 1e-12, "{a} against {b}");
            }
        }
    }

    #[test]
    fn every_simd_level_gives_the_same_bits() {
        let exact = unpack(&scene(5, 80, 1.0));
        let lists = lists(&exact);
        let round = |v: f64| v as f32;
        let splats: Vec<Splat<f32>> = exact
            .iter()
            .map(|s| Splat {
                mean_px: s.mean_px.map(round),
                conic: s.conic.map(round),
                opacity: round(s.opacity),
                colour: s.colour.map(round),
            })
            .collect();
        let reach: Vec<Footprint<f32>> = footprints(&exact)
            .iter()
            .map(|f| Footprint { depth: round(f.depth), half_extent_px: f.half_extent_px.map(round) })
            .collect();
        let draw = |level| {
            let image = forward(level, &splats, &reach, &lists, [0.0; 3]);
            let d_image = TiledImage { colour: image.colour.iter().map(|c| c - 0.3).collect() };
            let d_splats = backward(level, &splats, &reach, &lists, &image, &d_image);
            (image.colour, d_splats)
        };
        let expected = draw(Level::Baseline);
        for level in Level::available() {
            assert!(draw(level) == expected, "{level} differs from the baseline");
        }
    }

    #[test]
    fn backward_agrees_with_finite_differences() {
        // The image jumps where alpha crosses 1/255 or 0.99 and where a pixel stops: pieces, each smooth.
        for (seed, n, opacity) in [(1, 12, 1.0), (2, 25, 0.3), (3, 6, 1.03)] {
            let x = scene(seed, n, opacity);
            let splats = unpack(&x);
            let background = [0.3, 0.1, 0.7];
            let weights = random(seed + 70, 3 * SIZE[0] * SIZE[1]);
            let f = |x: &[f64]| {
                // The lists stay those of the base point, whose slack covers the steps.
                let splats = unpack(x);
                forward(Level::detect(), &splats, &footprints(&splats), &lists(&splats), background)
                    .to_planes(SIZE)
                    .iter()
                    .zip(&weights)
                    .map(|(p, w)| p * w)
                    .sum::<f64>()
            };
            let lists = lists(&splats);
            let image = forward(Level::detect(), &splats, &footprints(&splats), &lists, background);
            let d_image = TiledImage::from_planes(&weights, SIZE);
            let analytic = pack(&backward(Level::detect(), &splats, &footprints(&splats), &lists, &image, &d_image));
            assert_piecewise_gradient("rasterise", &x, &analytic, f);
        }
    }
}
