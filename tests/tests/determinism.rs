//! Same seed, same machine, any number of threads: the same bundle, byte for byte.

use pocketsplat_capture::dataset::{Capture, LoadOptions, load};
use pocketsplat_capture::synth::{SynthOptions, write_capture};
use pocketsplat_kernels::scene::{ModelShape, Scene};
use pocketsplat_kernels::step::StepReport;
use pocketsplat_trainer::encode::Encoding;
use pocketsplat_trainer::train::config::Backbone;
use pocketsplat_trainer::train::{Observer, TrainConfig, Trainer};

/// Keeps the number of anchors after each step.
#[derive(Default)]
struct AnchorCounts(Vec<usize>);

impl Observer for AnchorCounts {
    fn step(&mut self, _iteration: u32, _report: &StepReport<f32>, scene: &Scene<f32>) {
        self.0.push(scene.anchors.len());
    }
}

fn small_capture() -> Capture {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let options =
        SynthOptions { size_px: 40, n_train: 8, n_test: 1, seed: 1, samples_per_axis: 2, ..SynthOptions::default() };
    write_capture(folder.path(), &options).expect("the capture is written");
    load(folder.path(), &LoadOptions::default()).expect("the capture loads").0
}

fn train(capture: &Capture, backbone: Backbone, seed: u64, n_threads: usize) -> (Vec<u8>, Vec<usize>) {
    let config = TrainConfig {
        backbone,
        shape: ModelShape { feature_dim: 8, n_offsets: 3, ..TrainConfig::default().shape },
        iterations: 420,
        seed,
        // A third of the capture's points, with which a step takes a third of the time.
        voxel_size: Some(0.2),
        ..TrainConfig::default()
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().expect("threads start");
    pool.install(|| {
        let mut counts = AnchorCounts::default();
        let mut trainer = Trainer::new(capture, config).expect("the capture trains");
        trainer.run(&mut counts).expect("no step is dropped");
        let finished = trainer.finish().expect("the context has an integer form");
        let fitted = Encoding::default().encode(finished, capture, &[]).expect("the scene is finite");
        (fitted.written.bytes, counts.0)
    })
}

#[test]
fn threads_change_no_byte_and_the_seed_changes_many() {
    let capture = small_capture();
    for backbone in [Backbone::Scaffold, Backbone::Hac] {
        let (one, counts) = train(&capture, backbone, 7, 1);
        let (two, _) = train(&capture, backbone, 7, 2);
        let (three, _) = train(&capture, backbone, 7, 3);
        assert!(one == two && one == three, "the bundle depends on the number of threads");
        let grown = counts.windows(2).any(|n| n[1] > n[0]);
        let pruned = counts.windows(2).any(|n| n[1] < n[0]);
        assert!(grown || pruned, "the run must go through densification: {counts:?}");
        let (other, _) = train(&capture, backbone, 8, 2);
        assert_ne!(one, other, "the seed must matter");
    }
}
