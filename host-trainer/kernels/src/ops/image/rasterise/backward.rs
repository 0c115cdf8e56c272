//! From the pixels' gradient to the splats'.

use std::hint::select_unpredictable;

use pocketsplat_format::rules::ALPHA_MAX;
use rayon::prelude::*;

use super::row::{ALL_ROWS, LOOK_EVERY, Row, SplatRows, live_rows, reduce, set_bits, step_row};
use super::{TILE_VALUES, Tile, TileSplat, TiledImage};
use crate::ops::image::project::{Footprint, Splat};
use crate::ops::image::tiles::{TILE_PX, TileLists};
use crate::ops::simd::Level;
use crate::real::Real;

/// Gradient of [`forward`](super::forward()) with respect to every splat.
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
    backward_through(&mut Vec::new(), level, splats, footprints, lists, image, d_image)
}

/// [`backward`] with a buffer for the gradients of all (tile, splat) pairs, which is kept from step to step: new memory would take longer
/// than what is written there.
pub fn backward_through<R: Real>(
    d_pairs: &mut Vec<Splat<R>>,
    level: Level,
    splats: &[Splat<R>],
    footprints: &[Footprint<R>],
    lists: &TileLists,
    image: &TiledImage<R>,
    d_image: &TiledImage<R>,
) -> Vec<Splat<R>> {
    // What is there is written over.
    d_pairs.resize(lists.entries.len(), Splat::default());
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

/// Gradient of [`forward`](super::forward()) with respect to the background: Σ T·∂L/∂C over the pixels.
///
/// * `image`: what forward returned. * `d_image`: dL/d(image), tile order, zero beyond the image's edge.
pub fn background_gradient<R: Real>(image: &TiledImage<R>, d_image: &TiledImage<R>) -> [R; 3] {
    let mut sums = [R::ZERO; 3];
    let tiles = image.transmittance.chunks_exact(TILE_VALUES).zip(d_image.colour.chunks_exact(3 * TILE_VALUES));
    for (through, d_tile) in tiles {
        for (sum, d_plane) in sums.iter_mut().zip(d_tile.chunks_exact(TILE_VALUES)) {
            *sum += through.iter().zip(d_plane).map(|(t, d)| *t * *d).sum::<R>();
        }
    }
    sums
}

fn add<R: Real>(sum: &mut Splat<R>, part: &Splat<R>) {
    for i in 0..2 {
        sum.mean_px[i] += part.mean_px[i];
    }
    for i in 0..3 {
        sum.colour[i] += part.colour[i];
    }
    sum.shear += part.shear;
    sum.row_precision += part.row_precision;
    sum.column_precision += part.column_precision;
    sum.opacity += part.opacity;
}

/// Lane sums of one (tile, splat) pair's gradient; dp is dL/d(power), dy the distance to the
/// splat's centre across rows, dx that to the row's centre along it.
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
    /// From power = −½(p·dx² + k·dy²) with dx = x − mean − s·dy.
    #[inline(always)]
    fn gradient(&self, splat: &Splat<R>) -> Splat<R> {
        let sum = |row: &Row<R>| {
            reduce(
                row,
                #[inline(always)]
                |a, b| a + b,
            )
        };
        let Splat { shear, row_precision, column_precision, .. } = *splat;
        let half = R::real(-0.5);
        let (along, across) = (row_precision * sum(&self.dp_dx), column_precision * sum(&self.dp_dy));
        Splat {
            mean_px: [along, across - shear * along],
            shear: row_precision * sum(&self.dp_dx_dy),
            row_precision: half * sum(&self.dp_dx_dx),
            column_precision: half * sum(&self.dp_dy_dy),
            opacity: sum(&self.opacity),
            colour: [sum(&self.colour[0]), sum(&self.colour[1]), sum(&self.colour[2])],
        }
    }
}

#[inline(always)]
fn backward_tile<R: Real>(tile: &Tile<R>, image: &[R], d_image: &[R], d_pairs: &mut [Splat<R>]) {
    let zero = [R::ZERO; TILE_PX];
    let mut transmittance = [[R::ONE; TILE_PX]; TILE_PX];
    let mut live = ALL_ROWS;
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
    for (n, (TileSplat { splat, reach }, d_pair)) in tile.splats.iter().zip(&mut *d_pairs).enumerate() {
        if n % LOOK_EVERY == 1 {
            live = live_rows(live, &transmittance);
            if live == 0 {
                d_pairs[n..].fill(Splat::default());
                break;
            }
        }
        let rows = SplatRows::new(splat, *reach, tile.x, &tile.ys);
        let reached = rows.reached & live;
        if reached == 0 {
            *d_pair = Splat::default();
            continue;
        }
        let [red, green, blue] = splat.colour;
        let mut sums = PairSums::<R>::default();
        for y in set_bits(reached) {
            let dy = rows.dy[y];
            let (mut alpha, bell, dx) = rows.alpha(y, splat.opacity);
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
                let d_alpha = select_unpredictable(follows, d_alpha, R::ZERO);
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
    }
}
