//! What a survey has: the families of methods, each at its rates.

use anyhow::{Context as _, Result};
use pocketsplat_baselines::{
    Baseline, Compact3dgs, LightGaussian, RdoGaussian, SelfOrganizing, TrainedScene, Unreadable,
};
use pocketsplat_gaussians::{Degree, Gaussians};
use pocketsplat_trainer::train::TrainError;

/// Makes the bytes of a method's file.
type Compress = dyn Fn(&TrainedScene<'_>) -> Result<Vec<u8>, TrainError>;

/// Compresses the scene that 3D Gaussian Splatting made.
pub(super) struct Compressor {
    pub(super) method: &'static str,
    pub(super) rate: &'static str,
    compress: Box<Compress>,
    decode: fn(&[u8]) -> Result<Gaussians, Unreadable>,
}

/// The methods that start from trained Gaussians; the first rate of each is the best.
pub(super) fn compressors() -> Vec<Compressor> {
    vec![
        of("pruned=0.66", LightGaussian::default()),
        of("pruned=0.85", LightGaussian { pruned_share: 0.85 }),
        of("lambda=0.0001", RdoGaussian::default()),
        of("lambda=0.0005", RdoGaussian { rate_weight: 5e-4 }),
        of("harmonics", SelfOrganizing::default()),
        of("no harmonics", SelfOrganizing { degree: Degree::Zero, ..SelfOrganizing::default() }),
        of("mask=0.0005", Compact3dgs::default()),
        of("mask=0.004", Compact3dgs::SYNTHETIC),
    ]
}

fn of<B: Baseline + 'static>(rate: &'static str, method: B) -> Compressor {
    let compress = Box::new(move |scene: &TrainedScene<'_>| Ok(B::encode(&method.compress(scene)?)));
    Compressor { method: B::NAME, rate, compress, decode: B::decode }
}

impl Compressor {
    /// The bytes of its file.
    pub(super) fn file_of(&self, scene: &TrainedScene<'_>) -> Result<Vec<u8>> {
        (self.compress)(scene).with_context(|| format!("{} ({}) could not compress the scene", self.method, self.rate))
    }

    /// The Gaussians of its file, normalised frame.
    pub(super) fn gaussians_of(&self, bytes: &[u8]) -> Result<Gaussians> {
        (self.decode)(bytes).with_context(|| format!("a file of {} ({}) is damaged", self.method, self.rate))
    }
}

/// Trains anchors, which become a bundle.
pub(super) struct Anchors {
    pub(super) method: &'static str,
    pub(super) rate: &'static str,
    /// Options of `train`.
    pub(super) options: &'static [&'static str],
}

/// The methods of anchors, as published: with the weights of the bits of their papers' ends, and no module of this program. Then the default
/// backbone and module of `train`.
pub(super) const ANCHORS: [Anchors; 9] = [
    anchors("Scaffold-GS", "default", &[PUBLISHED, "--backbone=scaffold"]),
    anchors("HAC", "lambda=0.0005", &[PUBLISHED, "--backbone=hac", "--lambda=0.0005"]),
    anchors("HAC", "lambda=0.004", &[PUBLISHED, "--backbone=hac", "--lambda=0.004"]),
    anchors("HAC++", "lambda=0.0005", &[PUBLISHED, "--backbone=hac-plus", "--lambda=0.0005"]),
    anchors("HAC++", "lambda=0.004", &[PUBLISHED, "--backbone=hac-plus", "--lambda=0.004"]),
    anchors("ContextGS", "lambda=0.0005", &[PUBLISHED, "--backbone=contextgs", "--lambda=0.0005"]),
    anchors("ContextGS", "lambda=0.004", &[PUBLISHED, "--backbone=contextgs", "--lambda=0.004"]),
    anchors("pocketsplat", "lambda=0.0005", &["--lambda=0.0005"]),
    anchors("pocketsplat", "lambda=0.004", &["--lambda=0.004"]),
];

const fn anchors(method: &'static str, rate: &'static str, options: &'static [&'static str]) -> Anchors {
    Anchors { method, rate, options }
}

/// Without the modules of this program.
const PUBLISHED: &str = "--modules=none";

/// What all of them share: heads that see the view, Gaussians of three deviations, and photographs as they are, which the explicit methods
/// take too.
pub(super) const SHARED: [&str; 1] = ["--effects=+view-colour,+view-geometry,+anisotropy,-exposure"];
