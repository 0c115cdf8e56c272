//! The rate loss alone: forward and backward over 20,000 anchors of 68 values, per instruction set, on one thread.
//!
//! `cargo bench -p pocketsplat-trainer --bench rate`.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use pocketsplat_kernels::ops::rate::normal_bits;
use pocketsplat_kernels::ops::simd::Level;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const N_VALUES: usize = 20_000 * 68;

fn benchmark(criterion: &mut Criterion) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut random = |scale: f32| (0..N_VALUES).map(|_| scale * rng.random_range(-1.0..1.0)).collect::<Vec<f32>>();
    let (values, means, log2_scales) = (random(4.0), random(2.0), random(3.0));
    let [mut bits, mut d_values, mut d_log2_scales] = [(); 3].map(|()| vec![0.0f32; N_VALUES]);
    let mut group = criterion.benchmark_group("rate");
    group.throughput(Throughput::Elements(N_VALUES as u64));
    for level in Level::available() {
        group.bench_function(level.to_string(), |bencher| {
            bencher.iter(|| {
                level.run(
                    #[inline(always)]
                    || {
                        normal_bits::forward_backward(
                            &values,
                            &means,
                            &log2_scales,
                            &mut bits,
                            &mut d_values,
                            &mut d_log2_scales,
                        );
                    },
                );
            });
        });
    }
    group.finish();
}

criterion_group!(benches, benchmark);
criterion_main!(benches);
