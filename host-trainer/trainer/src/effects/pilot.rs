//! Pilots: short runs that differ in their effects.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};

use pocketsplat_core::{Budget, Bundle, Camera, DecodeError, Decoder, MaxSplats, Plan};

use super::search::{Pilots, search};
use super::{Effect, PilotFigures, Price};
use crate::device::Limits;
use crate::encode::{CoderChoice, EncodeError, Encoding};
use crate::train::config::{Backbone, ExposureChoice, MIN_VIEWS_TO_HOLD_OUT};
use crate::train::modules::Modules;
use crate::train::{TrainConfig, TrainError, Trainer};
use pocketsplat_capture::dataset::{Capture, Image, PhotographError, View};
use pocketsplat_codec::render::decoder::image_of;
use pocketsplat_instructions::{Processor, predict};
use pocketsplat_kernels::camera::core_camera;
use pocketsplat_kernels::step::SharedDevice;
use pocketsplat_metrics::psnr_db_masked;

/// Runs below this many iterations are too short for pilots of them to say anything.
///
/// Lego with view direction is 0.6 dB worse than without after pilots of 500 iterations and 1.7 dB better after 2,000: with more inputs
/// there is more to learn (`docs/experiments/2026-11-21-neural-or-plain-gaussians.md`).
pub const LEAST_ITERATIONS: u32 = 16_000;
/// Share of the run's iterations that each pilot takes.
///
/// At half the resolution and for the image alone an iteration takes about a quarter of one of the run's with `hac`.
const PILOT_SHARE: f64 = 0.125;
/// Time of the six to nine pilots, against that of the run.
pub const PILOTS_TIME_SHARE: f64 = 0.25;
/// Of so many training views one is held out to measure with.
const HOLD_OUT_EVERY: usize = 8;

/// A capture for pilots.
#[derive(Debug)]
pub struct PilotCapture {
    /// At half the resolution, in memory where the capture is; its test views are training views that are held out here.
    reduced: Capture,
    /// Held-out views as they were.
    held_out: Vec<View>,
}

impl PilotCapture {
    /// Whether `capture` has enough training views to spare some.
    pub fn can_be_of(capture: &Capture) -> bool {
        capture.train.len() >= MIN_VIEWS_TO_HOLD_OUT
    }

    /// Halves the views of `capture` and holds some of those it trains on out; never looks at its test views. `None` where it has
    /// too few to spare any.
    pub fn of(capture: &Capture) -> Option<Self> {
        if !Self::can_be_of(capture) {
            return None;
        }
        let views = |held_out: bool| {
            let is_held_out = |i: usize| i % HOLD_OUT_EVERY == HOLD_OUT_EVERY / 2;
            capture.train.iter().enumerate().filter(move |(i, _)| is_held_out(*i) == held_out).map(|(_, view)| view)
        };
        let reduced = Capture {
            train: views(false).map(View::halved).collect(),
            test: views(true).map(View::halved).collect(),
            points: capture.points.clone(),
            point_colours: capture.point_colours.clone(),
            made_points: None,
            ..*capture
        };
        Some(Self { reduced, held_out: views(true).cloned().collect() })
    }
}

/// Why pilots could not be measured.
#[derive(Debug, thiserror::Error)]
pub enum PilotError {
    /// A pilot could not be trained.
    #[error(transparent)]
    Train(#[from] TrainError),
    /// Its scene has no bundle.
    #[error(transparent)]
    Encode(#[from] EncodeError),
    /// Its bundle cannot be drawn.
    #[error("a pilot's bundle cannot be drawn; please report it")]
    Draw(#[from] DecodeError),
    /// A held-out photograph that does not lie in memory could not be read.
    #[error(transparent)]
    Photograph(#[from] PhotographError),
    /// What it was worth could not be written down.
    #[error("could not write down the results of pilots")]
    Keep(#[from] io::Error),
    /// It was asked to stop.
    #[error("the measurement of effects was interrupted")]
    Interrupted,
}

/// Follows pilots, and remembers those that are done, so that no interruption makes them be trained again.
pub trait PilotLog {
    /// What a pilot with these effects and this change of the seed came to, if it is done.
    fn known(&self, effects: &[Effect], seed: u64) -> Option<PilotFigures>;

    /// A pilot begins, of so many iterations.
    fn begins(&mut self, effects: &[Effect], iterations: u32);

    /// A pilot has done this iteration.
    fn step(&mut self, iteration: u32);

    /// A pilot is done.
    ///
    /// # Errors
    /// What keeps it from being written down.
    fn done(&mut self, effects: &[Effect], seed: u64, worth: &PilotFigures) -> io::Result<()>;
}

/// What pilots are trained with.
pub struct PilotTraining<'a> {
    /// What they see.
    pub capture: &'a PilotCapture,
    /// Of the run, for whose length, seed and widths they stand; other effects than the measured are kept.
    pub config: &'a TrainConfig,
    /// What computes their steps; the CPU where there is none.
    pub device: Option<SharedDevice<f32>>,
    /// Looked at after every iteration.
    pub stop: &'a AtomicBool,
}

/// For which device pilots are drawn.
#[derive(Clone, Copy)]
struct PilotDevice {
    /// Scratch memory of the decoder, bytes; without limit where there is none.
    ram_bytes: Option<u64>,
    /// Whose instructions count.
    target: Processor,
}

/// Trains pilots without effects, with each and with those that gained something, less what does not pay among them; says what each was
/// worth, and which one is chosen.
///
/// Quality is measured on held-out views at the pilots' size, instructions at the capture's own. Cost: six to nine eighths of the
/// run's iterations, each about a quarter of one of the run's.
///
/// * `target`: whose instructions count. * `encoding`: of the run; bundles of pilots have one tier and are cut to nothing, and are
///   drawn within its RAM.
///
/// # Errors
/// [`PilotError`].
pub fn measure(
    training: &PilotTraining<'_>,
    price: &Price,
    target: Processor,
    encoding: &Encoding,
    log: &mut impl PilotLog,
) -> Result<Pilots, PilotError> {
    let PilotTraining { capture, config, .. } = *training;
    let device = PilotDevice { ram_bytes: encoding.limits.ram_bytes, target };
    // Pilots are smaller than the scene that has to fit.
    let limits = Limits { processor: encoding.limits.processor, ..Limits::default() };
    let encoding = Encoding { coder: CoderChoice::Auto, tiers: vec![0.0], limits, ..encoding.clone() };
    search(price, |effects, seed| {
        if let Some(worth) = log.known(effects, seed) {
            return Ok(worth);
        }
        let config = pilot_config(&TrainConfig { seed: config.seed ^ seed, ..*config }, effects);
        log.begins(effects, config.iterations);
        let mut trainer = Trainer::new(&capture.reduced, config)?;
        trainer.set_device(training.device.clone());
        while !trainer.is_done() {
            if training.stop.load(Ordering::Relaxed) {
                return Err(PilotError::Interrupted);
            }
            trainer.advance()?;
            log.step(trainer.iteration());
        }
        trainer.fetch()?;
        let fitted = encoding.encode(trainer.finish()?, &capture.reduced, &[])?;
        let worth = worth(&fitted.written.bytes, capture, device)?;
        log.done(effects, seed, &worth)?;
        Ok(worth)
    })
}

/// The run in short, for the image alone: so few steps leave a rate no time, and its noise would be more than what is measured.
fn pilot_config(config: &TrainConfig, effects: &[Effect]) -> TrainConfig {
    let (backbone, modules) = (Backbone::Scaffold, Modules { pruning: None, rdo: None, ..config.modules });
    let iterations = config.iteration_at(PILOT_SHARE).max(1);
    let config = TrainConfig {
        backbone,
        iterations,
        validation_every: 0,
        modules,
        exposure: ExposureChoice::Off,
        refine_poses: false,
        ..*config
    };
    Effect::measured_only(effects, &config)
}

/// What a pilot's bundle is worth on the views that were held out of it.
fn worth(bytes: &[u8], capture: &PilotCapture, device: PilotDevice) -> Result<PilotFigures, PilotError> {
    let bundle = Bundle::parse(bytes)?;
    let (mut psnr_db, mut instructions) = (0.0, 0.0);
    let n = capture.reduced.test.len() as f64;
    draw(&bundle, &capture.reduced.test, device, |view, image, _| {
        let photograph = view.photograph()?;
        psnr_db += psnr_db_masked(&image, &photograph.image, photograph.mask.as_ref()) / n;
        Ok(())
    })?;
    draw(&bundle, &capture.held_out, device, |_, _, frame_instructions| {
        instructions += frame_instructions / n;
        Ok(())
    })?;
    Ok(PilotFigures { psnr_db, instructions, bytes: bytes.len() })
}

/// Draws views by the plan that a device would make, and hands on each image and its predicted instructions.
fn draw(
    bundle: &Bundle<'_>,
    views: &[View],
    device: PilotDevice,
    mut drawn: impl FnMut(&View, Image, f64) -> Result<(), PhotographError>,
) -> Result<(), PilotError> {
    let cameras = views.iter().map(|view| core_camera(&view.camera)).collect::<Result<Vec<_>, _>>()?;
    let largest = |side: fn(&Camera) -> u16| cameras.iter().map(side).max().unwrap_or(1);
    let frame = Budget::for_frame(largest(|camera| camera.width_px), largest(|camera| camera.height_px));
    let limited = device.ram_bytes.map(|ram| frame.in_bytes(usize::try_from(ram).unwrap_or(usize::MAX)));
    // A pilot for which the memory does not suffice is measured as if it did; the run's scene will be cut until it does.
    let plan = match limited.map(|budget| Plan::new(bundle, &budget)) {
        Some(Ok(plan)) => plan,
        _ => Plan::new(bundle, &frame.with_max_splats(MaxSplats::Worst))?,
    };
    let mut scratch = vec![0; plan.scratch_len()];
    let mut decoder = Decoder::bind(bundle, plan, &mut scratch)?;
    for (view, camera) in views.iter().zip(&cameras) {
        let (image, report) = image_of(&mut decoder, camera)?;
        let size_px = [camera.width_px, camera.height_px];
        drawn(view, image, predict(device.target.instruction_set(), bundle, &plan, &report, size_px).iter().sum())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use pocketsplat_gpu::GpuStep;
    use pocketsplat_gpu::parity::gpu;

    use super::*;
    use crate::train::test_capture::{many_views, tiny_config};

    #[derive(Default)]
    struct Noted {
        begun: Vec<String>,
        n_steps: u32,
        known: Vec<(String, u64, PilotFigures)>,
    }

    impl PilotLog for Noted {
        fn known(&self, effects: &[Effect], seed: u64) -> Option<PilotFigures> {
            let name = Effect::names(effects);
            self.known.iter().find(|known| known.0 == name && known.1 == seed).map(|known| known.2)
        }

        fn begins(&mut self, effects: &[Effect], iterations: u32) {
            assert_eq!(iterations, 20, "an eighth");
            self.begun.push(Effect::names(effects));
        }

        fn step(&mut self, _iteration: u32) {
            self.n_steps += 1;
        }

        fn done(&mut self, effects: &[Effect], seed: u64, worth: &PilotFigures) -> io::Result<()> {
            self.known.push((Effect::names(effects), seed, *worth));
            Ok(())
        }
    }

    #[test]
    fn pilots_see_no_test_view_and_are_measured_on_none_that_they_train_on() {
        let mut capture = many_views(24);
        capture.test = capture.train.split_off(20);
        let pilots = PilotCapture::of(&capture).expect("views to spare");
        let names = |views: &[View]| views.iter().map(|view| view.name.clone()).collect::<Vec<_>>();
        let (trained, held_out) = (names(&pilots.reduced.train), names(&pilots.reduced.test));
        assert_eq!((trained.len(), held_out.len()), (18, 2));
        assert!(held_out.iter().all(|name| !trained.contains(name)));
        assert!(names(&capture.test).iter().all(|name| !trained.contains(name) && !held_out.contains(name)));
        assert_eq!(names(&pilots.held_out), held_out);
        assert_eq!(pilots.reduced.train[0].camera.width_px, capture.train[0].camera.width_px / 2);
        capture.train.truncate(MIN_VIEWS_TO_HOLD_OUT - 1);
        assert!(PilotCapture::of(&capture).is_none(), "too few to spare");
    }

    #[test]
    fn every_measured_effect_has_a_pilot_and_what_costs_too_much_is_not_chosen() {
        let capture = many_views(12);
        let pilots = PilotCapture::of(&capture).expect("views to spare");
        let dear = Price { effect_db: 1e3, ..Price::default() };
        let measured = |log: &mut Noted, stop: bool| {
            let (config, stop) = (tiny_config(160), AtomicBool::new(stop));
            let training = PilotTraining { capture: &pilots, config: &config, device: None, stop: &stop };
            measure(&training, &dear, Processor::CortexM4, &Encoding::default(), log)
        };
        let mut log = Noted::default();
        assert!(matches!(measured(&mut log, true), Err(PilotError::Interrupted)));
        log = Noted::default();
        let trials = measured(&mut log, false).expect("pilots");
        assert_eq!(log.begun, ["none", "none", "view-colour", "view-geometry", "detail", "anisotropy"]);
        assert_eq!(log.n_steps, 6 * 20);
        // As after an interruption: what is known is not trained again, and what comes of it is the same.
        log.known.remove(2);
        log.begun.clear();
        assert_eq!(measured(&mut log, false).expect("pilots"), trials);
        assert_eq!(log.begun, ["view-colour"]);
        assert!(trials.chance_db > 0.0, "two seeds, two scenes");
        assert!(trials.each.iter().all(|trial| trial.worth.instructions > 0.0 && trial.worth.psnr_db.is_finite()));
        let chosen: Vec<_> = trials.each.iter().filter(|trial| trial.chosen).map(|trial| &trial.effects).collect();
        assert_eq!(chosen, [&Vec::new()]);
    }

    /// Bound: 0.3 dB, as in 20 steps no rounding goes far.
    #[test]
    fn pilots_on_a_gpu_come_to_the_same() {
        let Some(gpu) = gpu() else { return };
        let capture = many_views(12);
        let pilots = PilotCapture::of(&capture).expect("views to spare");
        let measured = |device: Option<SharedDevice<f32>>| {
            let (config, stop, mut log) = (tiny_config(160), AtomicBool::new(false), Noted::default());
            let training = PilotTraining { capture: &pilots, config: &config, device, stop: &stop };
            measure(&training, &Price::default(), Processor::CortexM4, &Encoding::default(), &mut log).expect("pilots");
            log.known
        };
        let device: SharedDevice<f32> = Arc::new(Mutex::new(GpuStep::new(gpu).expect("room")));
        // The loss of a run's first steps, which leave the photographs of the whole capture behind.
        let first_steps = |device: Option<SharedDevice<f32>>| -> f64 {
            let mut trainer = Trainer::new(&capture, tiny_config(160)).expect("a run");
            trainer.set_device(device);
            (0..12).map(|_| f64::from(trainer.advance().expect("a step").report.loss)).sum()
        };
        let expected = first_steps(None);
        let check = |found: f64| assert!((found / expected - 1.0).abs() < 1e-3, "{found}, on the CPU {expected}");
        check(first_steps(Some(device.clone())));
        let on_device = measured(Some(device.clone()));
        check(first_steps(Some(device)));
        for ((name, _, here), (_, _, there)) in measured(None).iter().zip(&on_device).take(6) {
            assert!(
                (here.psnr_db - there.psnr_db).abs() < 0.3,
                "{name}: {} dB, {} on the device",
                here.psnr_db,
                there.psnr_db
            );
        }
    }
}
