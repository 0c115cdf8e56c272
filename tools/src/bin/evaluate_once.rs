//! What a scene that sees the direction of view looks like when a part of its chunks does not: their Gaussians, evaluated for the mean
//! of the directions that training views see each anchor from, are the same in every frame, and could be evaluated when bound.

use std::path::PathBuf;

use anyhow::ensure;
use clap::Parser;
use glam::DVec3;
use pocketsplat_capture::dataset::{self, FrameSize, LoadOptions, View};
use pocketsplat_core::Bundle;
use pocketsplat_trainer::bundle;
use pocketsplat_trainer::metrics::psnr_db_masked;
use pocketsplat_trainer::ops::{head, neural_gaussians};
use pocketsplat_trainer::render::reference::{ReferenceScene, to_image};
use pocketsplat_trainer::scene::{MASK_THRESHOLD, ModelShape};

/// Prints PSNR over held-out views while more and more chunks, the least sensitive to the view first, are evaluated once.
#[derive(Parser)]
struct Args {
    /// The bundle; its heads see the direction of view, and nothing else of it.
    bundle: PathBuf,
    /// The capture it was trained on.
    capture: PathBuf,
    /// The frames it was trained on, where the capture's are larger.
    #[arg(long, value_name = "WxH")]
    resolution: Option<FrameSize>,
    /// Held-out views, evenly picked.
    #[arg(long, default_value_t = 8)]
    views: usize,
}

fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let bytes = bundle::load(&args.bundle)?;
    let bundle = Bundle::parse(&bytes)?;
    let header = bundle.header();
    let scene = Scene::new(ReferenceScene::from_bundle(&bundle)?)?;
    let options = LoadOptions { frame: args.resolution, ..LoadOptions::default() };
    let (capture, _) = dataset::load(&args.capture, &options)?;
    ensure!(
        bundle::normalisation_of(&bundle) == capture.normalisation,
        "the capture is normalised otherwise than the bundle: load it as training did"
    );

    let eyes: Vec<DVec3> = capture.train.iter().map(|view| view.camera.centre_world()).collect();
    let means: Vec<DVec3> = (0..scene.len()).map(|anchor| scene.mean_direction(anchor, &eyes)).collect();
    let mut begin = 0;
    let mut chunks: Vec<(f64, std::ops::Range<usize>)> = bundle
        .chunks()
        .map(|chunk| {
            let anchors = begin..begin + usize::from(chunk.n_anchors());
            begin = anchors.end;
            let change: f64 = anchors.clone().map(|anchor| scene.change(anchor, means[anchor], &eyes)).sum();
            (change / anchors.len() as f64, anchors)
        })
        .collect();
    chunks.sort_by(|(a, _), (b, _)| a.total_cmp(b));

    let n = capture.test.len().min(args.views);
    let views: Vec<&View> = (0..n).map(|i| &capture.test[i * capture.test.len() / n]).collect();
    let background = header.background.map(|channel| f64::from(channel) / 255.0);
    let mut fixed = vec![None; scene.len()];
    let mut next = chunks.into_iter();
    println!("evaluated once: chunks, share of anchors, PSNR in dB over {n} views");
    for n_fixed in 0.. {
        let share = fixed.iter().flatten().count() as f64 / scene.len() as f64;
        let psnr_db = views.iter().map(|view| {
            let frame = scene.seen_from(view.camera.centre_world(), &fixed).render(&view.camera, background);
            let image = to_image(&frame, view.camera.width_px, view.camera.height_px);
            psnr_db_masked(&image, &view.image, view.mask.as_ref())
        });
        println!("{n_fixed:4} {share:6.2} {:7.2}", psnr_db.sum::<f64>() / n as f64);
        let Some((_, anchors)) = next.next() else { break };
        anchors.for_each(|anchor| fixed[anchor] = Some(means[anchor]));
    }
    Ok(())
}

/// A scene whose directions of view stand with the features: heads read both, one behind the other, so that each anchor may have its
/// own.
struct Scene(ReferenceScene);

impl Scene {
    fn new(scene: ReferenceScene) -> anyhow::Result<Self> {
        let shape = scene.shape;
        let plain = ModelShape { view_colour: true, view_geometry: true, ..ModelShape::plain(shape.feature_dim, 1) };
        let expected = ModelShape { n_offsets: shape.n_offsets, colour_hidden: shape.colour_hidden, ..plain };
        ensure!(
            ModelShape { dilation_compensation: false, anisotropic: true, ..shape } == expected,
            "the scene has other effects than the direction of view; needs one trained with view-colour and view-geometry alone"
        );
        Ok(Self(scene))
    }

    fn len(&self) -> usize {
        self.0.positions.len()
    }

    fn direction(&self, anchor: usize, eye: DVec3) -> DVec3 {
        (self.0.positions[anchor] - eye).normalize_or_zero()
    }

    fn mean_direction(&self, anchor: usize, eyes: &[DVec3]) -> DVec3 {
        eyes.iter().map(|eye| self.direction(anchor, *eye)).sum::<DVec3>() / eyes.len() as f64
    }

    /// The scene as it is drawn from `eye`, but for anchors whose direction is fixed.
    fn seen_from(&self, eye: DVec3, fixed: &[Option<DVec3>]) -> ReferenceScene {
        let Self(scene) = self;
        let feature_dim = scene.shape.feature_dim + 3;
        let row = |(anchor, fixed): (usize, &Option<DVec3>)| {
            self.input(anchor, fixed.unwrap_or_else(|| self.direction(anchor, eye)))
        };
        let features = fixed.iter().enumerate().flat_map(row).collect();
        let shape = ModelShape { feature_dim, view_colour: false, view_geometry: false, ..scene.shape };
        ReferenceScene { shape, features, ..scene.clone() }
    }

    fn input(&self, anchor: usize, direction: DVec3) -> Vec<f64> {
        let f = self.0.shape.feature_dim;
        [&self.0.features[anchor * f..][..f], &direction.to_array()].concat()
    }

    /// How far the Gaussians of an anchor are from those of `direction`, mean over where it is seen from: in opacity, in opacity times
    /// colour and times the logarithms of deviations, and by the area of each Gaussian.
    fn change(&self, anchor: usize, direction: DVec3, eyes: &[DVec3]) -> f64 {
        let still = self.gaussians(anchor, direction);
        let from = |eye: &DVec3| -> f64 {
            let seen = self.gaussians(anchor, self.direction(anchor, *eye));
            seen.iter().zip(&still).map(|(seen, still)| difference(seen, still)).sum()
        };
        eyes.iter().map(from).sum::<f64>() / eyes.len() as f64
    }

    /// Opacity, colour and deviations of each offset that is drawn.
    fn gaussians(&self, anchor: usize, direction: DVec3) -> Vec<[f64; 7]> {
        let Self(scene) = self;
        let (k, n_log_scales) = (scene.shape.n_offsets, scene.shape.n_log_scales());
        let input = self.input(anchor, direction);
        let mut outputs = neural_gaussians::HeadOutputs::default();
        outputs.reset(&scene.shape, 1);
        let all = [&mut outputs.opacity, &mut outputs.covariance, &mut outputs.colour];
        for (weights, output) in scene.heads.each().zip(all) {
            head::forward(weights, &input, &mut vec![0.0; weights.n_hidden], output);
        }
        // Those of no opacity count, too: so that both directions have the same.
        let opacities: Vec<f64> = outputs.opacity.iter().map(|logit| logit.tanh().max(0.0)).collect();
        outputs.opacity.fill(1.0);
        let masks: Vec<f64> = scene.drawn[anchor * k..][..k]
            .iter()
            .map(|drawn| MASK_THRESHOLD + if *drawn { 1.0 } else { -1.0 })
            .collect();
        let (mut gaussians, mut sources) = (Vec::new(), Vec::new());
        let (log_scales, offsets) = (&scene.log_scales[anchor * n_log_scales..], &scene.offsets[anchor * k * 3..]);
        let position = [scene.positions[anchor].to_array()];
        neural_gaussians::forward(
            &scene.shape,
            &position,
            &log_scales[..n_log_scales],
            &offsets[..k * 3],
            &masks,
            &outputs,
            &mut gaussians,
            &mut sources,
        );
        let parts = gaussians.iter().zip(&sources).map(|(gaussian, source)| {
            let ([r, g, b], [x, y, z]) = (gaussian.colour, gaussian.scale);
            [opacities[source.offset as usize], r, g, b, x, y, z]
        });
        parts.collect()
    }
}

/// See [`Scene::change`].
fn difference(seen: &[f64; 7], still: &[f64; 7]) -> f64 {
    let ([o, colour @ .., x, y, z], [still_o, still_colour @ .., still_x, still_y, still_z]) = (seen, still);
    let colours = colour.iter().zip(still_colour).map(|(c, still_c)| (o * c - still_o * still_c).abs()).sum::<f64>();
    let deviations = [x / still_x, y / still_y, z / still_z].map(|ratio| ratio.ln().abs()).iter().sum::<f64>();
    let mut sides = [*x, *y, *z];
    sides.sort_by(f64::total_cmp);
    ((o - still_o).abs() + colours + o * deviations) * sides[1] * sides[2]
}
