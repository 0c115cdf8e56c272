//! A trial: what the opacity target and pruning by opacity of the plug-and-play paper give explicit Gaussians.
//!
//! `TRIAL=/path/to/capture cargo test -p pocketsplat-baselines --lib modules_trial -- --ignored --nocapture`

use pocketsplat_capture::dataset::{Capture, LoadOptions, load};
use pocketsplat_gaussians::Gaussians;
use pocketsplat_kernels::ops::loss::opacity_target::forward_backward;
use pocketsplat_kernels::real::Real as _;
use pocketsplat_metrics::psnr_db;
use pocketsplat_trainer::explicit::optimiser::CloudOptimiser;
use pocketsplat_trainer::explicit::render::Renderer;
use pocketsplat_trainer::explicit::train::CloudTrainer;
use pocketsplat_trainer::explicit::{Cloud, CloudConfig};
use rand::seq::SliceRandom;

use crate::baseline::TrainedScene;
use crate::light_gaussian::significance::significance;
use crate::tuning::{Tuning, picked};

/// Steps before the event, and again behind it, beside a run of 30,000.
const STEPS: u32 = 5_000;
/// As the module's.
const BETA: f64 = 1e-3;

#[derive(Clone, Copy, Debug)]
enum Goes {
    Lowest,
    OfThePool,
    LeastSignificant,
}

fn steps(tuning: &mut Tuning<'_>, cloud: &mut Cloud<f32>, weight: f32) {
    let mut optimiser = CloudOptimiser::new(cloud.len());
    tuning
        .stage(STEPS, |turn, _| {
            let mut gradients = turn.gradients(cloud)?;
            let opacities: Vec<f32> =
                gradients.drawn.iter().map(|i| cloud.opacity_logits[*i as usize].sigmoid()).collect();
            let n = opacities.len();
            let (_, slope) = forward_backward(opacities.iter().sum(), n, (BETA * n as f64) as f32, weight);
            for (d, o) in gradients.stored.iter_mut().zip(opacities) {
                d.opacity_logit += slope * o * (1.0 - o);
            }
            Ok(turn.apply(&mut optimiser, cloud, &gradients))
        })
        .unwrap();
}

fn trial(scene: &TrainedScene<'_>, weight: f32, share: f64, goes: Goes) -> Gaussians {
    let mut tuning = Tuning::new(scene).unwrap();
    let mut cloud = tuning.cloud();
    steps(&mut tuning, &mut cloud, weight);
    let n = cloud.len();
    let scores: Vec<f64> = match goes {
        Goes::LeastSignificant => significance(tuning.level, &cloud, &tuning.cameras),
        _ => cloud.opacity_logits.iter().map(|logit| f64::from(*logit)).collect(),
    };
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| scores[*a].total_cmp(&scores[*b]));
    if let Goes::OfThePool = goes {
        let pool = (n as f64 * share / 0.75) as usize;
        order[..pool.min(n)].shuffle(&mut tuning.random());
    }
    let mut kept = order[(n as f64 * share) as usize..].to_vec();
    kept.sort_unstable();
    let mut cloud = picked(&cloud, kept);
    steps(&mut tuning, &mut cloud, 0.0);
    Gaussians::from(cloud)
}

fn psnr(gaussians: &Gaussians, capture: &Capture) -> f64 {
    let renderer = Renderer::new(gaussians);
    let of = |view: &pocketsplat_capture::dataset::View| {
        let photograph = view.photograph().unwrap();
        psnr_db(&renderer.image(&view.camera, capture.background), &photograph.image)
    };
    capture.test.iter().map(of).sum::<f64>() / capture.test.len() as f64
}

#[test]
#[ignore = "a trial of minutes"]
fn what_the_modules_give_explicit_gaussians() {
    let options = LoadOptions { max_resolution: Some(200), n_random_points: 30_000, ..LoadOptions::default() };
    let (capture, _) = load(std::env::var("TRIAL").unwrap().as_ref(), &options).unwrap();
    println!("seed,weight,share,goes,gaussians,psnr_db");
    for seed in 42..45 {
        let config = CloudConfig { seed, ..CloudConfig::hurried(2000) };
        let mut run = CloudTrainer::new(&capture, config).unwrap();
        while !run.is_done() {
            run.advance().unwrap();
        }
        let gaussians = run.gaussians();
        println!("{seed},,,trained,{},{:.3}", gaussians.len(), psnr(&gaussians, &capture));
        let scene = TrainedScene { gaussians: &gaussians, capture: &capture, config: &config };
        for (weight, share, goes) in [
            (0.0, 0.0, Goes::Lowest),
            (1e-7, 0.3, Goes::OfThePool),
            (1e-5, 0.3, Goes::OfThePool),
            (1e-3, 0.3, Goes::OfThePool),
            (0.0, 0.3, Goes::OfThePool),
            (0.0, 0.3, Goes::Lowest),
            (0.0, 0.3, Goes::LeastSignificant),
            (1e-3, 0.6, Goes::Lowest),
            (0.0, 0.6, Goes::Lowest),
            (0.0, 0.6, Goes::LeastSignificant),
        ] {
            let found = trial(&scene, weight, share, goes);
            println!("{seed},{weight},{share},{goes:?},{},{:.3}", found.len(), psnr(&found, &capture));
        }
    }
}
