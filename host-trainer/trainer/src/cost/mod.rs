//! What accuracy costs in time: one bundle drawn in many ways, each measured against the f64 reference, the photographs and
//! the instructions that it takes.

mod arithmetic;
mod counter;
mod front;
mod setting;

use std::sync::Arc;
use std::time::Instant;

use pocketsplat_core::{Arithmetic, Budget, Bundle, Camera, DecodeError, Decoder, FrameReport, Plan, Stage};

pub use arithmetic::{ArithmeticChoice, WithArithmetic};
pub use counter::{CountError, Counter, MOST_VIEWS};
pub use front::on_front;
pub use setting::{Setting, parameters, quality_grid};

use pocketsplat_capture::dataset::{Image, Photograph};
use pocketsplat_codec::render::decoder::image_of;
use pocketsplat_instructions::{Processor, predict};
use pocketsplat_metrics::{psnr_db, psnr_db_masked};

/// A view to draw, and what it is compared with.
pub struct Sight {
    /// The camera, in the bundle's frame.
    pub camera: Camera,
    /// What the f64 reference draws of the whole scene.
    pub reference: Image,
    /// What was photographed.
    pub photograph: Arc<Photograph>,
    /// Whether its instructions are among those of a setting.
    pub counts: bool,
}

/// Instructions of a frame, in the order of [`Stage::ALL`].
pub type Stages = [f64; Stage::ALL.len()];

/// Instructions of a frame on a target, and how they are known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instructions {
    /// Of each stage.
    pub stages: Stages,
    /// Whether an emulated board counted them; predicted from what the frame consists of, if not.
    pub counted: bool,
}

impl Instructions {
    /// Of all stages.
    pub fn total(&self) -> f64 {
        self.stages.iter().sum()
    }
}

/// What a setting does; means over the views where nothing else is said.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// What was set.
    pub setting: Setting,
    /// PSNR to the f64 reference of the worst view, dB; infinite when all bytes agree.
    pub psnr_to_reference_db: f64,
    /// Largest difference of a channel to the reference, of all views, 255ths.
    pub worst_channel: u8,
    /// PSNR to the photographs, dB.
    pub psnr_db: f64,
    /// Time of a frame on this machine, s.
    pub host_s: f64,
    /// Instructions of a frame on each target, of the views that [count](Sight::counts); predicted ones are of the target's
    /// [arithmetic](ArithmeticChoice::of) alone, whose costs were counted.
    pub instructions: Vec<Option<Instructions>>,
    /// Scratch memory of the plan, bytes.
    pub scratch_bytes: usize,
    /// Splats of all views that had no place in it.
    pub splats_dropped: u32,
}

/// Draws all views as `setting` says within `budget`, and measures.
///
/// Cost: two frames a view, one by one: the first warms the caches for the second, which is timed.
///
/// # Errors
/// [`DecodeError`] when the budget is too small or the bundle damaged.
///
/// # Panics
/// Without views.
pub fn measure(
    bundle: &Bundle<'_>,
    sights: &[Sight],
    setting: &Setting,
    budget: Budget,
    targets: &[Processor],
) -> Result<Measured, DecodeError> {
    setting.arithmetic.call(Measurement { bundle, sights, setting, budget, targets })
}

/// The arguments of [`measure`].
struct Measurement<'a, 'b> {
    bundle: &'a Bundle<'b>,
    sights: &'a [Sight],
    setting: &'a Setting,
    budget: Budget,
    targets: &'a [Processor],
}

impl WithArithmetic for Measurement<'_, '_> {
    type Output = Result<Measured, DecodeError>;

    fn call<A: Arithmetic>(self) -> Self::Output {
        measure_in::<A>(&self)
    }
}

fn measure_in<A: Arithmetic>(of: &Measurement<'_, '_>) -> Result<Measured, DecodeError> {
    let Measurement { bundle, sights, setting, budget, targets } = *of;
    assert!(!sights.is_empty(), "views to measure with");
    let plan = Plan::new(bundle, &setting.of(budget))?;
    let mut scratch = vec![0; plan.scratch_len()];
    let mut decoder = Decoder::bind_in::<A>(bundle, plan, &mut scratch)?;
    let (n, n_counted) = (sights.len() as f64, sights.iter().filter(|sight| sight.counts).count() as f64);
    let mut predicted = vec![[0.0; Stage::ALL.len()]; targets.len()];
    let mut measured = Measured {
        setting: Setting {
            pruning_rate: setting::pruning_rate(bundle, plan.n_tiers()).unwrap_or_default(),
            ..setting.clone()
        },
        psnr_to_reference_db: f64::INFINITY,
        worst_channel: 0,
        psnr_db: 0.0,
        host_s: 0.0,
        instructions: Vec::new(),
        scratch_bytes: plan.scratch_len(),
        splats_dropped: 0,
    };
    for sight in sights {
        image_of(&mut decoder, &sight.camera)?;
        let started = Instant::now();
        let (image, report): (Image, FrameReport) = image_of(&mut decoder, &sight.camera)?;
        measured.host_s += started.elapsed().as_secs_f64() / n;
        measured.splats_dropped += report.splats_dropped;
        let Photograph { image: truth, mask } = &*sight.photograph;
        measured.psnr_db += psnr_db_masked(&image, truth, mask.as_ref()) / n;
        measured.psnr_to_reference_db = measured.psnr_to_reference_db.min(psnr_db(&image, &sight.reference));
        let differences = image.rgb.iter().zip(&sight.reference.rgb).map(|(a, b)| a.abs_diff(*b));
        measured.worst_channel = measured.worst_channel.max(differences.max().unwrap_or(0));
        if sight.counts {
            let size_px = [sight.camera.width_px, sight.camera.height_px];
            for (sums, target) in predicted.iter_mut().zip(targets) {
                let stages = predict(target.instruction_set(), bundle, &plan, &report, size_px);
                sums.iter_mut().zip(stages).for_each(|(sum, stage)| *sum += stage / n_counted);
            }
        }
    }
    let of_target = |(stages, target): ([f64; Stage::ALL.len()], &Processor)| {
        let is_counted = setting.arithmetic == ArithmeticChoice::of(*target);
        is_counted.then_some(Instructions { stages, counted: false })
    };
    measured.instructions = predicted.into_iter().zip(targets).map(of_target).collect();
    Ok(measured)
}
