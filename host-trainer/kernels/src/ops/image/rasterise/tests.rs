//! The rasteriser against plain loops, against finite differences, and against itself on other instruction sets.

use super::*;
use crate::finite_difference::{assert_gradient, assert_piecewise_gradient, random};
use crate::ops::image::tiles;
use crate::ops::simd::Level;

const SIZE: [usize; 2] = [37, 21];

fn unpack(x: &[f64]) -> Vec<Splat<f64>> {
    x.chunks_exact(9)
        .map(|v| Splat {
            mean_px: [v[0], v[1]],
            shear: v[2],
            row_precision: v[3],
            column_precision: v[4],
            opacity: v[5],
            colour: [v[6], v[7], v[8]],
        })
        .collect()
}

fn pack(splats: &[Splat<f64>]) -> Vec<f64> {
    let of = |s: &Splat<f64>| {
        [&s.mean_px[..], &[s.shear, s.row_precision, s.column_precision, s.opacity], &s.colour].concat()
    };
    splats.iter().flat_map(of).collect()
}

fn footprints(splats: &[Splat<f64>]) -> Vec<Footprint<f64>> {
    splats
        .iter()
        .enumerate()
        .map(|(i, s)| {
            let reach = 2.0 * (255.0 * s.opacity).ln();
            let yy = 1.0 / s.column_precision;
            let half_extent_px = [1.0 / s.row_precision + s.shear * s.shear * yy, yy].map(|v| (reach * v).sqrt());
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
            [
                SIZE[0] as f64 * (0.5 + 0.6 * v[0]),
                SIZE[1] as f64 * (0.5 + 0.6 * v[1]),
                rho * sx / sy,
                1.0 / (sx * sx * (1.0 - rho * rho)),
                1.0 / (sy * sy),
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
            let [a, b] = [s.row_precision, -s.row_precision * s.shear];
            let c = s.column_precision - b * s.shear;
            let power = -0.5 * (a * dx * dx + c * dy * dy) - b * dx * dy;
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
fn no_row_that_draws_is_left_out() {
    // From specks to needles, all over and far from the tile, in the numbers of training.
    let (mut n_drawn, mut n_left_out) = (0, 0);
    for v in random(9, 20_000 * 7).chunks_exact(7) {
        let variances = [v[0], v[1]].map(|v| 10f64.powf(2.0 + 4.0 * v));
        let (sin, cos) = (3.2 * v[2]).sin_cos();
        let xx = variances[0] * cos * cos + variances[1] * sin * sin + 0.3;
        let yy = variances[0] * sin * sin + variances[1] * cos * cos + 0.3;
        let xy = (variances[0] - variances[1]) * sin * cos;
        let det = variances[0] * variances[1] + 0.3 * (variances[0] + variances[1]) + 0.09;
        let opacity = (1.0 / 255.0 + v[3].abs().powi(4)) as f32;
        let reach = 2.0 * (opacity * 255.0).ln();
        let extent = |variance: f64| f64::from((reach.max(0.0) * variance as f32).sqrt());
        let splat = Splat {
            mean_px: [v[4] * (16.0 + extent(xx)), v[5] * (16.0 + extent(yy))].map(|c| c as f32),
            shear: (xy / yy) as f32,
            row_precision: (yy / det) as f32,
            column_precision: (1.0 / yy) as f32,
            opacity,
            colour: [0.5; 3],
        };
        let footprint = Footprint { depth: 1.0, half_extent_px: [extent(xx) as f32, extent(yy) as f32] };
        let lists = TileLists { grid: [1, 1], starts: vec![0, 1], entries: vec![0], ..TileLists::default() };
        let tile = Tile::new(&[splat], &[footprint], &lists, 0);
        let rows = row::SplatRows::new(&splat, tile.splats[0].reach, tile.x, &tile.ys);
        for y in 0..TILE_PX {
            let draws = rows.alpha(y, opacity).0.iter().any(|a| *a > 0.0);
            let is_reached = rows.reached >> y & 1 == 1;
            assert!(is_reached || !draws, "row {y} of {splat:?}");
            n_drawn += u32::from(draws);
            n_left_out += u32::from(!is_reached);
        }
    }
    assert!(n_drawn > 10_000 && n_left_out > 10_000, "{n_drawn} drawn, {n_left_out} left out");
}

#[test]
fn what_is_blended_is_counted() {
    for (seed, opacity) in [(1, 1.0), (2, 0.2), (3, 1.4)] {
        let splats = unpack(&scene(seed, 60, opacity));
        // Whole tiles are drawn: an image of them has no pixels beyond its edge.
        let size = SIZE.map(|px| px.next_multiple_of(TILE_PX));
        let counts = count(&splats, &footprints(&splats), &tiles::build(&splats, &footprints(&splats), size));
        let mut blended = 0;
        for p in 0..size[0] * size[1] {
            let (px, py) = ((p % size[0]) as f64 + 0.5, (p / size[0]) as f64 + 0.5);
            let mut t = 1.0;
            for s in &splats {
                let dy = py - s.mean_px[1];
                let dx = px - s.mean_px[0] - s.shear * dy;
                let power = -0.5 * (s.row_precision * dx * dx + s.column_precision * dy * dy);
                let alpha = (s.opacity * power.exp()).min(0.99);
                if alpha >= 1.0 / 255.0 {
                    if t * (1.0 - alpha) < 1e-4 {
                        break;
                    }
                    blended += 1;
                    t *= 1.0 - alpha;
                }
            }
        }
        assert_eq!(counts.blended, blended);
        assert!(counts.evaluated >= counts.blended && counts.evaluated.is_multiple_of(16), "{counts:?}");
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
            shear: round(s.shear),
            row_precision: round(s.row_precision),
            column_precision: round(s.column_precision),
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
        let d_image = TiledImage { colour: image.colour.iter().map(|c| c - 0.3).collect(), ..TiledImage::default() };
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
        assert_gradient("background", &background, &background_gradient(&image, &d_image), |background| {
            let background = [background[0], background[1], background[2]];
            let planes = forward(Level::detect(), &splats, &footprints(&splats), &lists, background).to_planes(SIZE);
            planes.iter().zip(&weights).map(|(p, w)| p * w).sum()
        });
    }
}
