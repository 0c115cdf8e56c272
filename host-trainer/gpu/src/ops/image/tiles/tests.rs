//! Against the CPU: the same lists. Bound: none, but for tiles that a splat's box comes within 0.002 px of, where either may list it.

use super::*;
use crate::parity::{SIZES, gpu};
use pocketsplat_kernels::finite_difference::random;
use pocketsplat_kernels::ops::image::tiles as cpu;

const SIZE: [usize; 2] = [150, 90];

/// Splats on, beside and larger than the image; coarse depths, so that there are ties; some slots empty.
fn random_splats(n: usize, reach_px: f64) -> (Vec<Splat<f32>>, Vec<Footprint<f32>>) {
    random(n as u64 + 3, n * 6)
        .chunks_exact(6)
        .map(|v| {
            let mean_px = [75.0 + 90.0 * v[0], 45.0 + 60.0 * v[1]].map(|m| m as f32);
            let depth = if v[5] < -0.5 { 0.0 } else { 0.3 + (v[4] * 40.0).abs().floor() as f32 };
            let half_extent_px = [reach_px * v[2].abs(), reach_px * v[3].powi(4)].map(|e| e as f32);
            (Splat { mean_px, ..Splat::default() }, Footprint { depth, half_extent_px })
        })
        .unzip()
}

/// Lists of tiles as slots.
fn build(gpu: &Gpu, splats: &[Splat<f32>], footprints: &[Footprint<f32>], size_px: [usize; 2]) -> Vec<Vec<u32>> {
    let mut tiles = Tiles::new(gpu).expect("room");
    let splat_buffer = Buffer::upload(gpu, "splats", splats).expect("room");
    let footprint_buffer = Buffer::upload(gpu, "footprints", footprints).expect("room");
    let n_pairs = tiles.build(gpu, Commands::new(gpu), &splat_buffer, &footprint_buffer, size_px).expect("runs");
    let read = |buffer: &Buffer<u32>| buffer.read(gpu).expect("runs");
    let (entries, slots, starts) = (read(tiles.entries()), read(&tiles.slot_of_pair), read(&tiles.starts));
    assert_eq!((entries.len(), slots.len(), *starts.last().expect("a tile") as usize), (n_pairs, n_pairs, n_pairs));
    // The pairs of a slot stand together.
    let (first, n) = (read(&tiles.first_pair), read(&tiles.n_tiles));
    for slot in 0..splats.len() {
        let pairs = first[slot] as usize..(first[slot] + n[slot]) as usize;
        assert!(slots[pairs].iter().all(|s| *s as usize == slot), "slot {slot}");
    }
    let list =
        |bounds: &[u32]| entries[bounds[0] as usize..bounds[1] as usize].iter().map(|e| slots[*e as usize]).collect();
    starts.windows(2).map(list).collect()
}

fn compare(gpu: &Gpu, splats: &[Splat<f32>], footprints: &[Footprint<f32>], size_px: [usize; 2]) {
    // The CPU takes no empty slots.
    let drawn: Vec<usize> = (0..splats.len()).filter(|i| footprints[*i].depth > 0.0).collect();
    let of_drawn = drawn.iter().map(|i| (splats[*i], footprints[*i]));
    let (some_splats, some_footprints): (Vec<_>, Vec<_>) = of_drawn.unzip();
    let expected = cpu::build(&some_splats, &some_footprints, size_px);
    let found = build(gpu, splats, footprints, size_px);
    assert_eq!(found.len(), expected.n_tiles());
    for (t, list) in found.iter().enumerate() {
        let expected: Vec<u32> = expected.tile(t).iter().map(|s| drawn[*s as usize] as u32).collect();
        let [x, y] = [t % expected_across(size_px) * TILE_PX, t / expected_across(size_px) * TILE_PX];
        let is_close = |slot: u32| {
            let (splat, footprint) = (&splats[slot as usize], &footprints[slot as usize]);
            [x, y].iter().enumerate().any(|(i, start)| {
                let (mean, half) = (f64::from(splat.mean_px[i]), f64::from(footprint.half_extent_px[i]));
                let centres = [*start as f64 + 0.5, (start + TILE_PX).min(size_px[i]) as f64 - 0.5];
                [mean - half, mean + half]
                    .iter()
                    .any(|edge| centres.iter().any(|c| (edge - c).abs() < 2e-3 + 2e-5 * half))
            })
        };
        let clear = |list: &[u32]| list.iter().copied().filter(|slot| !is_close(*slot)).collect::<Vec<_>>();
        assert_eq!(clear(list), clear(&expected), "tile {t}");
        let depth_and_slot = |slot: u32| (footprints[slot as usize].depth, slot);
        assert!(list.windows(2).all(|pair| depth_and_slot(pair[0]) < depth_and_slot(pair[1])), "tile {t} out of order");
    }
}

fn expected_across(size_px: [usize; 2]) -> usize {
    size_px[0].div_ceil(TILE_PX)
}

#[test]
fn tiles_agree_with_the_cpu() {
    let Some(gpu) = gpu() else { return };
    for n in SIZES {
        for reach_px in [2.0, 60.0] {
            let (splats, footprints) = random_splats(n, reach_px);
            compare(gpu, &splats, &footprints, SIZE);
        }
    }
    // One tile with thousands of splats of one depth.
    let splats = vec![Splat { mean_px: [7.0, 7.0], ..Splat::default() }; 5000];
    let footprints = vec![Footprint { depth: 1.0, half_extent_px: [3.0, 3.0] }; 5000];
    compare(gpu, &splats, &footprints, [16, 16]);
    compare(gpu, &splats, &footprints, SIZE);
    // Splats far larger than the image, and of no extent.
    let (splats, mut footprints) = random_splats(40, 10.0);
    for (i, footprint) in footprints.iter_mut().enumerate() {
        footprint.half_extent_px = if i % 2 == 0 { [1e9, 1e9] } else { [0.0, 0.0] };
    }
    compare(gpu, &splats, &footprints, SIZE);
}
