//! Against the CPU. Bounds: a pixel is a sum of at most some hundred terms in one order on both, 1e-4 of the largest; but where a rounding
//! decides whether a splat is skipped (alpha 1/255) or stops a pixel (transmittance 1e-4) the two differ by what that splat gives, at most
//! 0.01, which at most one pixel in 500 may show. Gradients: 2e-3 of the largest of their kind for 99 % of the splats, 5e-2 for all.

use super::*;
use crate::parity::{Bound, SIZES, assert_close, gpu, largest};
use pocketsplat_kernels::finite_difference::random;
use pocketsplat_kernels::ops::image::project::Footprint;
use pocketsplat_kernels::ops::image::rasterise::{self as cpu, TiledImage};
use pocketsplat_kernels::ops::image::tiles as cpu_tiles;
use pocketsplat_kernels::ops::simd::Level;

fn footprint(splat: &Splat<f32>, depth: f32) -> Footprint<f32> {
    let reach = 2.0 * (255.0 * splat.opacity).ln();
    let yy = 1.0 / splat.column_precision;
    let half_extent_px = [1.0 / splat.row_precision + splat.shear * splat.shear * yy, yy].map(|v| (reach * v).sqrt());
    Footprint { depth, half_extent_px }
}

fn random_splats(seed: u64, n: usize, size_px: [usize; 2], opacity: f64) -> Vec<Splat<f32>> {
    let of = |v: &[f64]| {
        let (sx, sy, rho) = (3.0 + 2.5 * v[2], 3.0 + 2.5 * v[3], 0.8 * v[4]);
        let values = [
            size_px[0] as f64 * (0.5 + 0.6 * v[0]),
            size_px[1] as f64 * (0.5 + 0.6 * v[1]),
            rho * sx / sy,
            1.0 / (sx * sx * (1.0 - rho * rho)),
            1.0 / (sy * sy),
            opacity * (0.6 + 0.35 * v[5]),
            v[6].abs(),
            v[7].abs(),
            v[8].abs(),
        ];
        bytemuck::cast(values.map(|x| x as f32))
    };
    random(seed, n * 9).chunks_exact(9).map(of).collect()
}

/// The largest difference, and how many of the values differ by more than `bound`.
fn differences(found: &[f32], expected: &[f32], bound: f64) -> (f64, usize) {
    assert_eq!(found.len(), expected.len());
    let each = || found.iter().zip(expected).map(|(a, b)| f64::from((a - b).abs()));
    assert!(each().all(f64::is_finite));
    (each().fold(0.0, f64::max), each().filter(|d| *d > bound).count())
}

fn compare(gpu: &Gpu, splats: &[Splat<f32>], size_px: [usize; 2]) {
    // Every third slot is empty.
    let slots: Vec<Splat<f32>> = splats.iter().flat_map(|s| [*s, *s, Splat::default()]).step_by(2).collect();
    let slots: Vec<Splat<f32>> = slots.into_iter().take(splats.len()).collect();
    let n = slots.len();
    let footprints: Vec<Footprint<f32>> = (0..n)
        .map(|i| if slots[i].opacity > 0.0 { footprint(&slots[i], 1.0 + (i / 2) as f32) } else { Footprint::default() })
        .collect();
    let drawn: Vec<usize> = (0..n).filter(|i| slots[*i].opacity > 0.0).collect();
    let some_splats: Vec<_> = drawn.iter().map(|i| slots[*i]).collect();
    let some_footprints: Vec<_> = drawn.iter().map(|i| footprints[*i]).collect();
    let background = [0.2, 0.4, 0.6];
    let n_pixels = size_px[0] * size_px[1];
    let d_planes: Vec<f32> = random(5, 3 * n_pixels).into_iter().map(|v| v as f32).collect();

    let lists = cpu_tiles::build(&some_splats, &some_footprints, size_px);
    let level = Level::detect();
    let drawing = cpu::forward(level, &some_splats, &some_footprints, &lists, background);
    let expected = drawing.to_planes(size_px);
    let d_tiled = TiledImage::from_planes(&d_planes, size_px);
    let d_expected = cpu::backward(level, &some_splats, &some_footprints, &lists, &drawing, &d_tiled);
    let d_background = cpu::background_gradient(&drawing, &d_tiled);

    let splat_buffer = Buffer::upload(gpu, "splats", &slots).expect("room");
    let footprint_buffer = Buffer::upload(gpu, "footprints", &footprints).expect("room");
    let (mut tiles, mut rasterise) = (Tiles::new(gpu).expect("room"), Rasterise::new(gpu).expect("room"));
    tiles.build(gpu, Commands::new(gpu), &splat_buffer, &footprint_buffer, size_px).expect("runs");
    let image = Buffer::zeros(gpu, "image", 3 * n_pixels).expect("room");
    let transmittance = Buffer::zeros(gpu, "transmittance", n_pixels).expect("room");
    let d_image = Buffer::upload(gpu, "gradient of the image", &d_planes).expect("room");
    let d_splats =
        Buffer::upload(gpu, "gradients of splats", &vec![Splat { shear: 7.0, ..Splat::default() }; n]).expect("room");
    let mut commands = Commands::new(gpu);
    rasterise.forward(&mut commands, &splat_buffer, &tiles, size_px, background, &image, &transmittance);
    rasterise.backward(gpu, &mut commands, &splat_buffer, &tiles, size_px, &image, &d_image, &d_splats).expect("room");
    let totals = Buffer::zeros(gpu, "sums", 4).expect("room");
    rasterise.background(gpu, &mut commands, &transmittance, &d_image, &totals, 1).expect("room");
    commands.submit().expect("runs");

    let name = format!("{n} slots, {size_px:?}");
    let (worst, n_over) = differences(&image.read(gpu).expect("runs"), &expected, 1e-4);
    assert!(
        worst <= 0.02 && n_over <= 3 * n_pixels / 500,
        "{name}: image off by {worst}, {n_over} values by more than 1e-4"
    );
    let totals = totals.read(gpu).expect("runs");
    let bound = Bound { relative: 0.0, absolute: 1e-3 * (1.0 + n_pixels as f64).sqrt() };
    assert_close(&format!("{name}: background"), &totals[1..], &d_background, bound);
    let d_found = d_splats.read(gpu).expect("runs");
    for (slot, d) in d_found.iter().enumerate().filter(|(slot, _)| slots[*slot].opacity == 0.0) {
        assert_eq!(*d, Splat::default(), "slot {slot} is empty");
    }
    let values = |all: &[Splat<f32>], number: usize| -> Vec<f32> {
        all.iter().map(|d| bytemuck::cast::<_, [f32; 9]>(*d)[number]).collect()
    };
    let some_found: Vec<_> = drawn.iter().map(|i| d_found[*i]).collect();
    for number in 0..N_NUMBERS {
        let (found, expected) = (values(&some_found, number), values(&d_expected, number));
        let scale = largest(&expected).max(1e-6);
        let (worst, n_over) = differences(&found, &expected, 2e-3 * scale);
        assert!(
            worst <= 5e-2 * scale && n_over <= drawn.len() / 100,
            "{name}: number {number} off by {worst} of {scale}, {n_over} over"
        );
    }
}

#[test]
fn rasterise_agrees_with_the_cpu() {
    let Some(gpu) = gpu() else { return };
    for n in SIZES {
        for (size_px, opacity) in [([37, 21], 1.0), ([64, 48], 0.2)] {
            compare(gpu, &random_splats(n as u64, n, size_px, opacity), size_px);
        }
    }
    // One tile with thousands of splats, most behind what nothing shines through.
    compare(gpu, &random_splats(1, 5000, [16, 16], 0.9), [16, 16]);
    compare(gpu, &random_splats(2, 5000, [16, 16], 0.01), [16, 16]);
    // Needles of a thousand pixels, and points.
    let hard: Vec<Splat<f32>> = (0..40)
        .map(|i| Splat {
            mean_px: [20.0 + i as f32, 15.5],
            shear: 40.0 - 2.0 * i as f32,
            row_precision: if i % 2 == 0 { 3.0 } else { 0.5 },
            column_precision: if i % 3 == 0 { 1e-6 } else { 3.0 },
            opacity: [0.004, 0.5, 0.999, 1.0][i % 4],
            colour: [0.3, 0.6, 0.9],
        })
        .collect();
    compare(gpu, &hard, [70, 40]);
}

#[test]
fn the_same_input_gives_the_same_bits() {
    let Some(gpu) = gpu() else { return };
    let size_px = [100, 80];
    let splats = random_splats(8, 3000, size_px, 0.4);
    let footprints: Vec<_> = splats.iter().zip(0u32..).map(|(s, i)| footprint(s, 1.0 + (i % 200) as f32)).collect();
    let splat_buffer = Buffer::upload(gpu, "splats", &splats).expect("room");
    let footprint_buffer = Buffer::upload(gpu, "footprints", &footprints).expect("room");
    let d_image = Buffer::upload(gpu, "gradient", &vec![0.3; 3 * size_px[0] * size_px[1]]).expect("room");
    let run = || {
        let (mut tiles, mut rasterise) = (Tiles::new(gpu).expect("room"), Rasterise::new(gpu).expect("room"));
        tiles.build(gpu, Commands::new(gpu), &splat_buffer, &footprint_buffer, size_px).expect("runs");
        let image = Buffer::zeros(gpu, "image", 3 * size_px[0] * size_px[1]).expect("room");
        let transmittance = Buffer::zeros(gpu, "transmittance", size_px[0] * size_px[1]).expect("room");
        let d_splats = Buffer::zeros(gpu, "gradients", splats.len()).expect("room");
        let mut commands = Commands::new(gpu);
        rasterise.forward(&mut commands, &splat_buffer, &tiles, size_px, [0.0; 3], &image, &transmittance);
        rasterise
            .backward(gpu, &mut commands, &splat_buffer, &tiles, size_px, &image, &d_image, &d_splats)
            .expect("room");
        commands.submit().expect("runs");
        (image.read(gpu).expect("runs"), d_splats.read(gpu).expect("runs"))
    };
    let first = run();
    assert!(first.1.iter().any(|d| d.opacity != 0.0));
    for _ in 0..3 {
        assert!(run() == first);
    }
}
