use rand::RngExt;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::train::config::{Backbone, ExposureChoice, HalfSize};
use crate::train::limits::{Finished, LimitProbe, LimitShares, MeasuredShares};
use crate::train::modules::{Modules, Rdo};
use crate::train::run::checkpoint::VERSION;
use crate::train::test_capture::{SIZE_PX, edit, tiny_capture, tiny_config, tiny_hac_config};
use crate::train::{TrainConfig, TrainError, Trainer};
use pocketsplat_capture::dataset::Mask;

fn saved(trainer: &Trainer<'_>) -> Vec<u8> {
    let mut bytes = Vec::new();
    trainer.save(&mut bytes).unwrap();
    bytes
}

/// Everything but the time it took.
fn timeless(trainer: &Trainer<'_>) -> Vec<u8> {
    let mut trainer = trainer.clone();
    (trainer.state.seconds, trainer.state.processor_seconds) = (0.0, 0.0);
    saved(&trainer)
}

/// Runs of each backbone, each stopped at ten random iterations and every time taken up again by a new trainer.
#[test]
fn a_run_taken_up_again_ends_in_the_same_bits() {
    taken_up_again(tiny_config(90), None);
    let half_size = HalfSize { until: 0.4, least_px: 12 };
    let exposure = ExposureChoice::On;
    let odd = TrainConfig { learns_background: true, refine_poses: true, half_size, exposure, ..tiny_config(90) };
    taken_up_again(odd, None);
    taken_up_again(tiny_hac_config(90), None);
    taken_up_again(TrainConfig { backbone: Backbone::ContextGs, ..tiny_hac_config(90) }, None);
    let modules = Modules { rdo: Some(Rdo::default()), ..Modules::default() };
    taken_up_again(
        TrainConfig { modules, ..tiny_hac_config(90) },
        Some(LimitProbe { measure: &draws_150, limits_bytes: true }),
    );
}

/// A device that draws 150 anchors, and holds the bytes of half as many more.
fn draws_150(finished: &Finished) -> MeasuredShares {
    let anchors = &finished.scene.anchors;
    let n = (0..anchors.len()).filter(|anchor| anchors.has_drawn(*anchor)).count() as f64;
    Ok(LimitShares { ram: n / 150.0, bytes: n / 225.0, ..LimitShares::default() })
}

fn taken_up_again(config: TrainConfig, limits: Option<LimitProbe<'_>>) {
    let (capture, iterations) = (tiny_capture(), config.iterations);
    let mut whole = Trainer::new(&capture, config).unwrap().fitting(limits);
    let mut along_the_way = vec![saved(&whole)];
    let mut n_anchors = vec![whole.state.learned.scene.anchors.len()];
    while !whole.is_done() {
        whole.advance().unwrap();
        along_the_way.push(saved(&whole));
        n_anchors.push(whole.state.learned.scene.anchors.len());
    }
    assert!(n_anchors.windows(2).any(|n| n[1] > n[0]), "the run must grow: {n_anchors:?}");
    assert!(n_anchors.windows(2).any(|n| n[1] < n[0]), "the run must prune: {n_anchors:?}");
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut stops: Vec<usize> = (0..10).map(|_| rng.random_range(0..iterations as usize)).collect();
    stops.sort_unstable();
    let mut last = along_the_way[0].clone();
    for stop in stops.into_iter().chain([iterations as usize]) {
        let Restored { run: mut trainer, written_by } = Trainer::restore(&capture, &last).unwrap();
        assert_eq!(written_by, trainer.kernels());
        assert_eq!(saved(&trainer), last, "restoring and saving is the identity");
        trainer = trainer.fitting(limits);
        while (trainer.state.iteration as usize) < stop {
            trainer.advance().unwrap();
        }
        let expected = Trainer::restore(&capture, &along_the_way[stop]).unwrap().run;
        assert!(timeless(&trainer) == timeless(&expected), "{:?} after {stop}", config.backbone);
        last = saved(&trainer);
    }
}

#[test]
fn a_fork_decides_about_exposures_anew_where_it_is_asked_to() {
    let capture = tiny_capture();
    let begun = |exposure| {
        let mut trainer = Trainer::new(&capture, TrainConfig { exposure, ..tiny_config(60) }).unwrap();
        for _ in 0..20 {
            trainer.advance().unwrap();
        }
        saved(&trainer)
    };
    let [on, off] = [ExposureChoice::On, ExposureChoice::Off];
    for (before, after) in [(on, on), (on, off), (off, on)] {
        let config = TrainConfig { exposure: after, ..tiny_config(60) };
        let mut fork = Trainer::fork(&capture, &begun(before), config).unwrap().run;
        fork.advance().unwrap();
        fork.advance().unwrap();
        assert_eq!(fork.exposure_stops().is_some(), after == on, "{before:?} → {after:?}");
    }
}

#[test]
fn a_fork_without_a_limit_of_bytes_weighs_bits_as_its_configuration_says() {
    let capture = tiny_capture();
    let config = tiny_config(20);
    let mut begun = Trainer::new(&capture, config).unwrap();
    begun.state.learned.lambda = 16.0 * config.hac.lambda;
    let bytes = saved(&begun);
    let lambda_of = |limits| Trainer::fork(&capture, &bytes, config).unwrap().run.fitting(limits).state.learned.lambda;
    let probe = |limits_bytes| LimitProbe { measure: &|_| unreachable!("nothing is trained"), limits_bytes };
    assert_eq!(lambda_of(None), config.hac.lambda);
    assert_eq!(lambda_of(Some(probe(false))), config.hac.lambda);
    assert_eq!(lambda_of(Some(probe(true))), 16.0 * config.hac.lambda, "a limit goes on from where it came");
}

#[test]
fn a_fork_without_refined_poses_begins_with_those_of_the_capture() {
    let capture = tiny_capture();
    let refining = TrainConfig { refine_poses: true, ..tiny_config(200) };
    let mut begun = Trainer::new(&capture, refining).unwrap();
    for _ in 0..120 {
        begun.advance().unwrap();
    }
    let given: Vec<_> =
        Trainer::new(&capture, tiny_config(200)).unwrap().cameras().iter().map(|c| c.rotation).collect();
    let of_fork = |config| {
        let fork = Trainer::fork(&capture, &saved(&begun), config).unwrap().run;
        fork.cameras().iter().map(|camera| camera.rotation).collect::<Vec<_>>()
    };
    assert_eq!(of_fork(tiny_config(200)), given);
    assert!(of_fork(refining).iter().zip(&given).all(|(moved, given)| moved != given));
}

#[test]
fn images_are_halved_up_to_the_switch_and_only_where_enough_is_left() {
    let mut capture = tiny_capture();
    edit(&mut capture.train[0], |photograph| {
        let valid = (0..SIZE_PX * SIZE_PX).map(|i| i % 7 > 0).collect();
        photograph.mask = Some(Mask { width_px: SIZE_PX, height_px: SIZE_PX, valid });
    });
    let n_half = |half_size| {
        let mut trainer = Trainer::new(&capture, TrainConfig { half_size, ..tiny_config(20) }).unwrap();
        let mut is_half = || {
            trainer.advance().unwrap();
            let splats = trainer.machine.device.workspace.blocks().iter().flat_map(|block| &block.splats);
            splats.map(|splat| splat.mean_px[0]).fold(0.0, f32::max) < 0.6 * SIZE_PX as f32
        };
        let sizes: Vec<bool> = (0..20).map(|_| is_half()).collect();
        assert!(sizes.is_sorted_by_key(|half| !half), "{sizes:?}");
        sizes.into_iter().filter(|half| *half).count()
    };
    assert_eq!(n_half(HalfSize::default()), 0);
    assert_eq!(n_half(HalfSize { until: 0.25, least_px: SIZE_PX / 2 }), 5);
    assert_eq!(n_half(HalfSize { until: 1.0, least_px: SIZE_PX / 2 }), 18, "growth ends at 0.9");
    assert_eq!(n_half(HalfSize { until: 0.25, least_px: SIZE_PX / 2 + 1 }), 0, "too small");
}

#[test]
fn no_damage_passes() {
    let capture = tiny_capture();
    let mut trainer = Trainer::new(&capture, tiny_config(20)).unwrap();
    trainer.advance().unwrap();
    let bytes = saved(&trainer);
    let fault = |bytes: &[u8]| match Trainer::restore(&capture, bytes) {
        Err(RestoreError::Fault(fault)) => fault,
        other => panic!("{:?}", other.map(|restored| restored.run.iteration())),
    };
    for cut in (0..bytes.len()).step_by(997).chain([0, 1, 7, 8, 11, 12, 15, bytes.len() - 1]) {
        fault(&bytes[..cut]);
    }
    for at in (0..bytes.len()).step_by(499) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x10;
        fault(&damaged);
    }
    let mut newer = bytes.clone();
    newer[8] += 1;
    assert_eq!(fault(&newer), CheckpointFault::Version { found: VERSION + 1 });
    assert_eq!(fault(b"PNG"), CheckpointFault::Magic);
    let mut longer = bytes[..bytes.len() - 4].to_vec();
    longer.extend([0; 8]);
    let checksum = crc32fast::hash(&longer);
    longer.extend(checksum.to_le_bytes());
    assert!(matches!(fault(&longer), CheckpointFault::Content { found: 8, .. }), "{:?}", fault(&longer));
}

#[test]
fn another_capture_is_refused_by_what_differs() {
    let capture = tiny_capture();
    let bytes = saved(&Trainer::new(&capture, tiny_config(20)).unwrap());
    let refused = |change: fn(&mut pocketsplat_capture::dataset::Capture)| {
        let mut other = tiny_capture();
        change(&mut other);
        let error = Trainer::restore(&other, &bytes).unwrap_err();
        assert!(matches!(error, RestoreError::Capture(_)), "{error}");
        error.to_string()
    };
    let begins = "this is not the capture that the run began with: ";
    for (change, message) in [
        (
            (|c| drop(c.train.pop())) as fn(&mut pocketsplat_capture::dataset::Capture),
            "it has 4 training views, the run began with 5",
        ),
        (|c| c.train[2].name.push('b'), "its training view 2 is `view_2b`, the run began with `view_2`"),
        (
            |c| edit(&mut c.train[1], |photograph| photograph.image.rgb[77] ^= 1),
            "the pixels or the mask of its view `view_1` are others",
        ),
        (
            |c| {
                let mask = Some(Mask { width_px: 24, height_px: 24, valid: vec![true; 24 * 24] });
                edit(&mut c.train[3], |photograph| photograph.mask = mask);
            },
            "the pixels or the mask of its view `view_3` are others",
        ),
        (|c| c.train[0].camera.translation.x += 1e-6, "the camera of its view `view_0` is another one"),
        (|c| c.train[0].camera.width_px = 23, "its view `view_0` has 23×24 px, the run began with 24×24"),
        (|c| c.background = [1.0; 3], "its background is [1.0, 1.0, 1.0], the run began with [0.0, 0.0, 0.0]"),
    ] {
        let found = refused(change);
        assert!(found.starts_with(&format!("{begins}{message}")), "{found}");
    }
    // What an ulp in a tangent makes of a pose is no other camera.
    let mut close = tiny_capture();
    close.train[0].camera.focal_px[0] *= 1.0 + 1e-15;
    close.test.push(close.train[0].clone());
    Trainer::restore(&close, &bytes).unwrap();
}

#[test]
fn a_fork_takes_photographs_of_another_size_but_no_other_poses() {
    let bytes = saved(&Trainer::new(&tiny_capture(), tiny_config(20)).unwrap());
    let mut larger = tiny_capture();
    for view in &mut larger.train {
        view.camera.focal_px = view.camera.focal_px.map(|focal| 2.0 * focal);
        (view.camera.width_px, view.camera.height_px) = (48, 48);
    }
    assert!(matches!(Trainer::restore(&larger, &bytes), Err(RestoreError::Capture(CaptureDifference::Size { .. }))));
    Trainer::fork(&larger, &bytes, tiny_config(20)).unwrap();
    larger.train[1].camera.translation.x += 1e-6;
    let moved = Trainer::fork(&larger, &bytes, tiny_config(20)).unwrap_err();
    assert_eq!(
        moved.to_string(),
        "this is not the capture that the run began with: the camera of its view `view_1` is another one than when the run began"
    );
}

#[test]
fn a_fork_keeps_the_context_model_once_there_is_one() {
    let (capture, config) = (tiny_capture(), tiny_hac_config(30));
    let mut trainer = Trainer::new(&capture, config).unwrap();
    let plain = TrainConfig { backbone: Backbone::Scaffold, ..config };
    let mut finer = config;
    finer.hac.base_steps.offset = 0.1;
    let early = saved(&trainer);
    for asked in [plain, finer] {
        Trainer::fork(&capture, &early, asked).unwrap();
    }
    while trainer.state.learned.scene.context.is_none() {
        trainer.advance().unwrap();
    }
    let late = saved(&trainer);
    for (asked, expected) in [
        (plain, "keeps `train.backbone` of its run, which is \"hac\", but \"scaffold\" was asked for"),
        (finer, "keeps `train.hac.base_steps.offset` of its run, which is 0.35, but 0.1 was asked for"),
    ] {
        let error = Trainer::fork(&capture, &late, asked).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn a_capture_without_views_is_no_start() {
    let mut capture = tiny_capture();
    capture.train.clear();
    assert!(matches!(Trainer::new(&capture, tiny_config(20)), Err(TrainError::NoViews)));
}
