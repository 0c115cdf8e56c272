//! A run with the rate of HAC, from its first iteration to what it hands to the writer.

use super::*;
use crate::train::TrainConfig;
use crate::train::config::{self, Backbone};
use crate::train::context::integers::Integers;
use crate::train::limits::Finished;
use crate::train::test_capture::{self, edit, tiny_capture, tiny_config, tiny_hac_config};
use pocketsplat_kernels::scene::Anchors;
use pocketsplat_kernels::step::Phase;
use pocketsplat_kernels::step::coding::RateReport;

/// All steps of a run: phase and rate of each.
fn trained(trainer: &mut Trainer<'_>) -> Vec<(Phase, Option<RateReport>)> {
    let mut steps = Vec::new();
    while !trainer.is_done() {
        let outcome = trainer.advance().unwrap();
        assert_eq!(outcome.dropped, None);
        steps.push((trainer.setup.config.phase(trainer.state.iteration), outcome.report.rate));
    }
    steps
}

#[test]
fn the_rate_falls_and_masks_close_where_bits_weigh() {
    rate_falls(Backbone::Hac, 0.7);
    rate_falls(Backbone::ContextGs, 0.85);
}

/// * `share`: of the bits an anchor at first that is left at most.
fn rate_falls(backbone: Backbone, share: f64) {
    let capture = tiny_capture();
    let mut ends = Vec::new();
    for lambda in [0.0, 0.5] {
        let mut config = TrainConfig { backbone, ..tiny_hac_config(300) };
        config.hac = config::Hac { lambda, sample: 1.0, ..config.hac };
        let mut trainer = Trainer::new(&capture, config).unwrap();
        let steps = trained(&mut trainer);
        for (phase, rate) in &steps {
            assert_eq!(rate.is_some(), matches!(phase, Phase::Context | Phase::IntegerModel));
        }
        let rates: Vec<f64> = steps.iter().filter_map(|(_, rate)| Some(rate.as_ref()?.bits.iter().sum())).collect();
        let finished = trainer.finish().unwrap();
        let n_drawn =
            (0..finished.scene.anchors.mask_logits.len()).filter(|i| finished.scene.anchors.is_drawn(*i)).count();
        ends.push((rates[0], rates[rates.len() - 1], n_drawn));
    }
    let [free, weighed] = [ends[0], ends[1]];
    assert!(weighed.1 < share * weighed.0 && weighed.1 < 0.7 * free.1, "bits an anchor, first and last: {ends:?}");
    assert!(weighed.2 < free.2, "drawn offsets: {ends:?}");
}

#[test]
fn every_pass_over_the_views_has_an_order_of_its_own() {
    let capture = test_capture::many_views(12);
    let mut trainer = Trainer::new(&capture, tiny_config(100)).unwrap();
    let mut order = || -> Vec<u32> {
        let mut taken = Vec::new();
        for _ in 0..12 {
            let before = if trainer.state.queue.is_empty() {
                trainer.setup.views.trained.clone()
            } else {
                trainer.state.queue.clone()
            };
            trainer.advance().unwrap();
            taken.extend(before.into_iter().filter(|view| !trainer.state.queue.contains(view)));
        }
        taken
    };
    let passes = [order(), order()];
    for pass in &passes {
        let mut sorted = pass.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..12).collect::<Vec<u32>>(), "each view once");
        assert!(!pass.is_sorted() && !pass.iter().rev().is_sorted(), "{pass:?}");
    }
    assert_ne!(passes[0], passes[1]);
}

#[test]
fn a_bit_costs_what_lambda_says_in_squared_error() {
    let capture = tiny_capture();
    let mut config = tiny_hac_config(100);
    config.hac.lambda = 0.01;
    let mut trainer = Trainer::new(&capture, config).unwrap();
    while trainer.state.learned.scene.context.is_none() {
        trainer.advance().unwrap();
    }
    let found = trainer.view().worth().unwrap().bit_price;
    // As the views are drawn: mean squared error and image loss, L1 and SSIM by 8:2.
    let (mut squared, mut loss) = (0.0, 0.0);
    for view in &capture.train {
        let (drawn, truth) = (trainer.draw(view).unwrap(), view.photograph().unwrap());
        let n = truth.image.rgb.len() as f64;
        let differences = drawn.rgb.iter().zip(&truth.image.rgb).map(|(a, b)| (f64::from(*a) - f64::from(*b)) / 255.0);
        let (l1, l2) = differences.fold((0.0, 0.0), |(l1, l2), d| (l1 + d.abs() / n, l2 + d * d / n));
        squared += l2 / capture.train.len() as f64;
        loss += (0.8 * l1 + 0.2 * (1.0 - pocketsplat_metrics::ssim(&drawn, &truth.image))) / capture.train.len() as f64;
    }
    let n_values = trainer.state.learned.scene.anchors.len() * trainer.state.learned.scene.shape.values_per_anchor();
    let expected = 0.01 / n_values as f64 * 2.0 * squared / loss;
    assert!((found / expected - 1.0).abs() < 0.03, "{found}, needed: {expected}");
}

#[test]
fn masks_stay_once_the_integer_model_decides() {
    let capture = tiny_capture();
    let mut config = tiny_hac_config(100);
    config.hac = config::Hac { lambda: 0.5, ..config.hac };
    let mut trainer = Trainer::new(&capture, config).unwrap();
    let mut masks = Vec::new();
    while !trainer.is_done() {
        let same = masks == trainer.state.learned.scene.anchors.mask_logits;
        assert_eq!(
            same,
            trainer.setup.config.phase(trainer.state.iteration) == Phase::IntegerModel,
            "{}",
            trainer.state.iteration
        );
        masks.clone_from(&trainer.state.learned.scene.anchors.mask_logits);
        trainer.advance().unwrap();
    }
}

#[test]
fn the_last_phase_draws_the_heads_as_they_are_written() {
    let capture = tiny_capture();
    let mut trainer = Trainer::new(&capture, tiny_hac_config(100)).unwrap();
    while trainer.setup.config.phase(trainer.state.iteration + 1) != Phase::IntegerModel {
        trainer.advance().unwrap();
    }
    let mut rounded = trainer.clone();
    rounded.state.learned.scene.heads = Integers::of(&trainer.state.learned.scene).unwrap().heads;
    assert!(rounded.state.learned.scene.heads != trainer.state.learned.scene.heads);
    let losses = [&mut trainer, &mut rounded].map(|trainer| trainer.advance().unwrap().report.loss);
    assert_eq!(losses[0], losses[1], "neither draws what lies between two steps");
    let weights = trainer.state.learned.scene.heads.colour.w1.iter();
    assert!(weights.filter(|weight| (**weight * 128.0).fract() != 0.0).count() > 0, "but it moves");
    assert_eq!(trainer.finish().unwrap().head_fraction_bits, Some(7));
}

#[test]
fn a_finished_scene_keeps_its_values_and_counts_the_bits_of_its_symbols() {
    let capture = tiny_capture();
    let mut trainer = Trainer::new(&capture, tiny_hac_config(80)).unwrap();
    trained(&mut trainer);
    let Finished { scene, importance, estimated_bits, .. } = trainer.finish().unwrap();
    assert_eq!(importance.len(), scene.anchors.len());
    assert!(estimated_bits.unwrap().iter().all(|bits| *bits > 0.0));
    let masks = scene.anchors.mask_logits.clone();
    let before = Anchors { mask_logits: masks, ..trainer.state.learned.scene.anchors.clone() };
    assert!(scene.anchors == before, "only offsets that no view draws are masked");
    let mut again = trainer.clone();
    again.state.learned.scene = scene.clone();
    let again = again.finish().unwrap();
    assert!(again.scene == scene && again.importance == importance && again.estimated_bits == estimated_bits);
}

#[test]
fn held_out_views_are_never_trained_on() {
    let mut capture = tiny_capture();
    let views = capture.train.clone();
    capture.train = views.iter().cycle().take(13).cloned().collect();
    for (i, view) in capture.train.iter_mut().enumerate() {
        view.name = format!("{i}");
    }
    let config = TrainConfig { validation_every: 24, ..tiny_hac_config(60) };
    let mut trainer = Trainer::new(&capture, config).unwrap();
    assert_eq!(trainer.validation_views().map(|view| view.name.as_str()).collect::<Vec<_>>(), ["11"]);
    trained(&mut trainer);
    let mut without = capture.clone();
    edit(&mut without.train[11], |photograph| photograph.image.rgb.fill(77));
    let mut other = Trainer::new(&without, config).unwrap();
    trained(&mut other);
    assert!(trainer.state.learned.scene == other.state.learned.scene, "its pixels change nothing");
}

#[test]
fn a_learned_background_comes_to_the_colour_behind_the_scene() {
    let behind = [60, 120, 180];
    let mut capture = tiny_capture();
    for view in &mut capture.train {
        edit(view, |photograph| {
            let pixels = photograph.image.rgb.as_chunks_mut::<3>().0;
            pixels.iter_mut().filter(|pixel| **pixel == [0; 3]).for_each(|pixel| *pixel = behind);
        });
    }
    // Else splats cover all of it.
    capture.points.iter_mut().for_each(|point| *point *= 0.25);
    let trained = |learns_background: bool, iterations: u32| {
        let config = TrainConfig { learns_background, ..tiny_config(iterations) };
        let mut trainer = Trainer::new(&capture, config).unwrap();
        trained(&mut trainer);
        trainer.finish().unwrap().background
    };
    assert_eq!(trained(false, 60), [0; 3], "the capture's");
    let found = trained(true, 400);
    assert!(found.iter().zip(behind).all(|(found, behind)| found.abs_diff(behind) < 20), "{found:?}");
}
