//! Against the CPU. Bounds: both compute the same sums of at most nine products in f32, so they differ by some 1e-6 of the largest
//! product; needles and grazing Gaussians lose two digits of it to differences, the gradients another one.

use super::*;
use crate::ops::image::prefilter::tests::camera;
use crate::parity::{Bound, SIZES, assert_close, gpu, largest};
use pocketsplat_kernels::finite_difference::random;
use pocketsplat_kernels::ops::image::project as cpu;

fn random_gaussians(n: usize) -> Vec<Gaussian<f32>> {
    let of = |v: &[f64]| {
        let norm = v[6..10].iter().map(|q| q * q).sum::<f64>().sqrt();
        Gaussian {
            // Some behind the camera, some beside the image.
            centre: [2.0 * v[0], 2.0 * v[1], 3.0 * v[2]].map(|x| x as f32),
            scale: [v[3], v[4], v[5]].map(|s| (0.2 * s.abs().powi(3) + 1e-4) as f32),
            rotation: [v[6], v[7], v[8], v[9]].map(|q| (q / norm) as f32),
            // A third of the slots is empty.
            opacity: if v[10] < -0.3 { 0.0 } else { v[10].abs() as f32 },
            colour: [v[11], v[12], v[13]].map(|c| c.abs() as f32),
        }
    };
    random(n as u64 + 7, 14 * n).chunks_exact(14).map(of).collect()
}

/// Needles, pancakes, points, the near plane, the edge of the image, opacity 0, 1 and at the cutoff.
fn hard_gaussians() -> Vec<Gaussian<f32>> {
    let camera = camera();
    let at = |cam: [f32; 3]| camera.gradient_to_world(std::array::from_fn(|i| cam[i] - camera.translation[i]));
    let plain = Gaussian {
        centre: at([0.1, 0.1, 2.0]),
        scale: [0.05; 3],
        rotation: [0.8, 0.2, -0.3, 0.48],
        opacity: 0.9,
        colour: [0.5; 3],
    };
    let with_scale = |scale| Gaussian { scale, ..plain };
    let with_centre = |cam| Gaussian { centre: at(cam), ..plain };
    let with_opacity = |opacity| Gaussian { opacity, ..plain };
    vec![
        with_scale([0.5, 1e-3, 1e-3]),
        with_scale([0.4, 0.4, 1e-4]),
        with_scale([30.0, 1e-4, 1e-4]),
        with_scale([0.0, 0.0, 0.0]),
        with_scale([1e18, 1e18, 1e18]),
        with_centre([0.05, -0.04, 0.201]),
        with_centre([0.0, 0.0, 0.199]),
        with_centre([0.0, 0.0, -30.0]),
        Gaussian { scale: [0.6; 3], ..with_centre([1.9, 0.0, 1.5]) },
        with_centre([1e6, 0.0, 1.0]),
        with_opacity(0.0),
        with_opacity(1.0),
        with_opacity(1.0 / 256.0),
        with_opacity(0.004),
    ]
}

fn flat(splat: &Splat<f32>) -> [f32; 9] {
    bytemuck::cast(*splat)
}

/// Both ways over `gaussians`; gives how many splats only one of CPU and device draws.
fn compare(gpu: &Gpu, gaussians: &[Gaussian<f32>], compensated: bool) -> usize {
    let n = gaussians.len();
    let (camera, project) = (camera(), Project::new(gpu));
    let sources = Buffer::upload(gpu, "Gaussians", gaussians).expect("room");
    // What was there before does not matter.
    let splats = Buffer::upload(gpu, "splats", &vec![Splat { opacity: 9.0, ..Splat::default() }; n]).expect("room");
    let footprints =
        Buffer::upload(gpu, "footprints", &vec![Footprint { depth: 9.0, ..Footprint::default() }; n]).expect("room");
    let d_splat: Vec<Splat<f32>> = random(3, 9 * n)
        .chunks_exact(9)
        .map(|v| bytemuck::cast::<[f32; 9], _>(std::array::from_fn(|i| v[i] as f32)))
        .collect();
    let d_splats = Buffer::upload(gpu, "gradients of splats", &d_splat).expect("room");
    let before = Gaussian { opacity: 0.5, ..Gaussian::default() };
    let d_gaussians = Buffer::upload(gpu, "gradients of Gaussians", &vec![before; n]).expect("room");
    let mut commands = Commands::new(gpu);
    project.forward(&mut commands, &camera, compensated, &sources, &splats, &footprints);
    project.backward(&mut commands, &camera, compensated, &sources, &footprints, &d_splats, &d_gaussians);
    commands.submit().expect("runs");
    let (splats, footprints) = (splats.read(gpu).expect("runs"), footprints.read(gpu).expect("runs"));
    let d_gaussians = d_gaussians.read(gpu).expect("runs");
    let mut n_differ = 0;
    for (i, gaussian) in gaussians.iter().enumerate() {
        let name = |what: &str| format!("{what} of {gaussian:?}, compensated {compensated}");
        let is_drawn = footprints[i].depth > 0.0;
        let Some((splat, footprint)) = cpu::forward(&camera, gaussian, compensated) else {
            n_differ += usize::from(is_drawn);
            continue;
        };
        if !is_drawn {
            n_differ += 1;
            assert_eq!(splats[i], Splat::default());
            continue;
        }
        assert_close(&name("mean"), &splats[i].mean_px, &splat.mean_px, Bound { relative: 1e-5, absolute: 1e-3 });
        let shape =
            |s: &Splat<f32>| [s.row_precision, s.column_precision, s.opacity, s.colour[0], s.colour[1], s.colour[2]];
        assert_close(&name("splat"), &shape(&splats[i]), &shape(&splat), Bound { relative: 2e-4, absolute: 0.0 });
        assert_close(&name("shear"), &[splats[i].shear], &[splat.shear], Bound { relative: 1e-4, absolute: 1e-5 });
        assert_close(
            &name("depth"),
            &[footprints[i].depth],
            &[footprint.depth],
            Bound { relative: 1e-5, absolute: 1e-6 },
        );
        let reach = (&footprints[i].half_extent_px, &footprint.half_extent_px);
        assert_close(&name("reach"), reach.0, reach.1, Bound { relative: 1e-4, absolute: 1e-2 });
        assert!(flat(&splats[i]).iter().all(|v| v.is_finite()));

        let mut expected = before;
        expected.add(&cpu::backward(&camera, gaussian, compensated, &d_splat[i]));
        let groups = |g: &Gaussian<f32>| {
            [g.centre.to_vec(), g.scale.to_vec(), g.rotation.to_vec(), vec![g.opacity], g.colour.to_vec()]
        };
        for (found, expected) in groups(&d_gaussians[i]).iter().zip(&groups(&expected)) {
            let bound = Bound { relative: 0.0, absolute: 2e-3 * largest(expected).max(1e-12) };
            assert_close(&name("gradient"), found, expected, bound);
        }
    }
    n_differ
}

#[test]
fn project_agrees_with_the_cpu() {
    let Some(gpu) = gpu() else { return };
    for n in SIZES {
        for compensated in [false, true] {
            // Only where a rounding decides whether a pixel centre is reached.
            assert!(compare(gpu, &random_gaussians(n), compensated) <= n / 500, "{n} Gaussians");
        }
    }
    for compensated in [false, true] {
        assert_eq!(compare(gpu, &hard_gaussians(), compensated), 0);
    }
}
