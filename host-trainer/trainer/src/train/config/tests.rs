use super::*;
use crate::train::modules::Detail;
use crate::train::test_capture::tiny_capture;
use glam::DVec3;

#[test]
fn a_rate_stays_and_then_falls_on_a_geometric_path() {
    let rate = LearningRate { start: 1e-2, end: 1e-4, from: 0.8 };
    for (progress, expected) in [(0.0, 1e-2), (0.8, 1e-2), (0.9, 1e-3), (1.0, 1e-4)] {
        assert!((rate.at(progress) / expected - 1.0).abs() < 1e-9, "{progress}: {}", rate.at(progress));
    }
    assert!((LearningRate::falling(1e-2, 1e-4).at(0.5) / 1e-3 - 1.0).abs() < 1e-9);
    assert_eq!(rate.times(0.0).at(0.9), 0.0);
}

#[test]
fn the_defaults_of_each_backbone_are_accepted() {
    for backbone in [Backbone::Scaffold, Backbone::Hac, Backbone::HacPlus, Backbone::ContextGs] {
        assert_eq!(TrainConfig { backbone, ..TrainConfig::default() }.validate(), Ok(()));
    }
}

#[test]
fn phases_follow_each_other_at_their_shares_of_the_run() {
    let config = TrainConfig { backbone: Backbone::Hac, iterations: 30_000, ..TrainConfig::default() };
    for (iteration, phase) in [
        (1, Phase::Raw),
        (3_000, Phase::Raw),
        (3_001, Phase::Noise),
        (10_000, Phase::Noise),
        (10_001, Phase::Context),
        (25_500, Phase::Context),
        (25_501, Phase::IntegerModel),
        (30_000, Phase::IntegerModel),
    ] {
        assert_eq!(config.phase(iteration), phase, "{iteration}");
        assert_eq!(TrainConfig::default().phase(iteration), Phase::Raw);
    }
    assert!(!config.pauses_at(2_999) && config.pauses_at(3_000) && config.pauses_at(3_999) && !config.pauses_at(4_000));
    assert!(!TrainConfig::default().pauses_at(3_500));
}

#[test]
fn anchors_grow_from_a_twentieth_to_the_middle_of_a_run() {
    let config = TrainConfig { iterations: 30_000, ..TrainConfig::default() };
    let Densification { statistics_from, from, until, interval, levels, gradient_threshold, .. } = config.densification;
    let at = [statistics_from, from, until].map(|share| config.iteration_at(share));
    assert_eq!((at, interval, levels, gradient_threshold), ([500, 1_500, 15_000], 100, 3, 2e-4));
}

#[test]
fn a_detail_head_is_the_modules() {
    let mut config = TrainConfig::default();
    config.shape.detail_hidden = 5;
    assert_eq!(config.validate(), Err(ConfigError::DetailHidden { found: 5, needed: 0 }));
    config.modules.detail = Some(Detail { hidden: 7, ..Detail::default() });
    assert_eq!(config.validate(), Err(ConfigError::DetailHidden { found: 5, needed: 7 }));
    config.shape = config.modules.shape(config.shape);
    assert_eq!(config.validate(), Ok(()));
}

#[test]
fn some_anchor_is_kept() {
    let mut config = TrainConfig::default();
    config.densification.kept_anchors = Some(0);
    let error = config.validate().unwrap_err().to_string();
    assert!(error.contains("train.densification.kept_anchors is 0, needs 1 to"), "{error}");
}

#[test]
fn points_fit_the_lattice_of_a_bundle() {
    let mut capture = tiny_capture();
    capture.points_origin = PointsOrigin::Capture;
    let close = TrainConfig::default().voxel_size_for(&capture);
    assert!(close > 1e-3, "{close}");
    // Half of the points lie close to one another, and one far away.
    capture.points.iter_mut().for_each(|point| *point *= 1e-4);
    capture.points.push(DVec3::splat(1000.0));
    let config = TrainConfig::default();
    assert!((config.voxel_size_for(&capture) / (1000.0 / 2_097_151.0) - 1.0).abs() < 0.02);
    assert_eq!(config.check_voxel_size(&capture), Ok(()));
    let error = TrainConfig { voxel_size: Some(1e-6), ..config }.check_voxel_size(&capture).unwrap_err().to_string();
    assert!(error.contains("train.voxel_size is 1e-6, needs at least 4.8"), "{error}");
}

#[test]
fn a_few_views_are_held_out_where_there_are_enough() {
    let held_out = |every: u32, n: usize| {
        let config = TrainConfig { validation_every: every, ..TrainConfig::default() };
        (0..n).filter(|i| config.holds_out(*i, n)).collect::<Vec<_>>()
    };
    assert!(held_out(24, 11).is_empty());
    assert_eq!(held_out(24, 12), [11]);
    assert_eq!(held_out(24, 100), [11, 35, 59, 83]);
    assert_eq!(held_out(2, 12), [1, 3, 5, 7, 9, 11]);
    assert!(held_out(0, 100).is_empty());
    let refused = TrainConfig { validation_every: 1, ..TrainConfig::default() }.validate();
    assert_eq!(refused, Err(ConfigError::NoViewLeft));
}
