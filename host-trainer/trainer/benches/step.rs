//! One training step of a fixed size, per instruction set, with a table of where its time goes.
//!
//! Scaffold-GS: 20,000 visible anchors, F 32, K 10. HAC in its context phase: 50,000, F 50, K 10, with three of four offsets
//! masked. Both make about 100,000 splats at 400×400 pixels. `cargo bench -p pocketsplat-trainer --bench step`; the rayon pool has
//! the machine's cores unless `RAYON_NUM_THREADS` says otherwise.

use criterion::{Criterion, criterion_group, criterion_main};
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::ops::simd::Level;
use pocketsplat_kernels::scene::Scene;
use pocketsplat_kernels::step::coding::Coding;
use pocketsplat_kernels::step::{Loss, LossWeights, StageSeconds, StepReport, TargetView, Workspace};
use pocketsplat_trainer::train::bench_scene;
use pocketsplat_trainer::train::config::Rates;
use pocketsplat_trainer::train::optimiser::Optimiser;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SIZE_PX: u32 = 400;

fn benchmark(criterion: &mut Criterion) {
    steps(criterion, "scaffold", &bench_scene::scene(20_000), &Coding::Raw);
    steps(criterion, "hac", &bench_scene::coded(50_000), &bench_scene::coding());
}

fn steps(criterion: &mut Criterion, name: &str, scene: &Scene<f32>, coding: &Coding<'_, f32>) {
    let pinhole = Pinhole::new(&bench_scene::camera([SIZE_PX; 2]));
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let truth: Vec<f32> = (0..3 * SIZE_PX * SIZE_PX).map(|_| rng.random_range(0.0..1.0)).collect();
    let target = TargetView::new(&pinhole, truth, None, [0.0; 3]);
    let mut group = criterion.benchmark_group(name);
    group.sample_size(20);
    for level in Level::available() {
        let mut workspace = Workspace::with_level(&scene.shape, level);
        let mut reports = Vec::new();
        group.bench_function(level.to_string(), |bencher| {
            bencher.iter(|| reports.push(workspace.step(scene, &target, &Loss::plain(LossWeights::default()), coding)));
        });
        print_stages(level, &reports);
    }
    let mut workspace = Workspace::new(&scene.shape);
    let mut moving = scene.clone();
    let mut optimiser = Optimiser::new(&moving);
    workspace.step(&moving, &target, &Loss::plain(LossWeights::default()), coding);
    group.bench_function("optimiser", |bencher| {
        bencher.iter(|| optimiser.apply(&mut moving, &workspace, &Rates::default(), 0.5, 5.0));
    });
    group.finish();
}

fn print_stages(level: Level, reports: &[StepReport<f32>]) {
    let Some(last) = reports.last() else { return };
    let median = |stage: fn(&StageSeconds) -> f64| {
        let mut ms: Vec<f64> = reports.iter().map(|r| 1e3 * stage(&r.stages)).collect();
        ms.sort_by(f64::total_cmp);
        ms[ms.len() / 2]
    };
    println!(
        "{level}: {} Gaussians, {} splats, {} pairs; medians in ms: context {:.1}, anchors {:.1}, tiles {:.1}, rasterise {:.1}, loss {:.1}, \
         rasterise backward {:.1}, anchors backward {:.1}, context backward {:.1}",
        last.n_gaussians,
        last.n_splats,
        last.n_pairs,
        median(|s| s.context),
        median(|s| s.anchors),
        median(|s| s.tiles),
        median(|s| s.rasterise),
        median(|s| s.loss),
        median(|s| s.rasterise_backward),
        median(|s| s.anchors_backward),
        median(|s| s.context_backward),
    );
}

criterion_group!(benches, benchmark);
criterion_main!(benches);
