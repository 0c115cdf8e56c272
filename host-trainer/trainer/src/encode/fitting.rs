//! A scene cut until its bundle keeps the limits of a device.

use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{Capture, View};
use pocketsplat_core::{Bundle, DecodeError, Plan};
use pocketsplat_format::bundle::TierMeasures;
use pocketsplat_instructions::level;

use super::choice::{CoderChoice, judged_psnr_db};
use super::sizes::{DevicePlans, frame_of, level_needs, measured_cameras, most_instructions};
use super::{EncodeError, Encoding};
use crate::device::Limits;
use crate::train::limits::{Finished, Search};
use pocketsplat_codec::bundle::{CodedScene, WriteError, Written};
use pocketsplat_codec::manifest::{compare, count, mean_psnr_db};

/// A cut goes on until this share of the limit is used, or for so many codings.
const CUTTING: Search = Search { tolerance: 0.015, most_trials: 14 };
/// A scene that takes at most so much more than the memory in two strips is cut until it does not. Any other may be drawn in more
/// strips, which take less memory and more time.
const WORTH_CUTTING: f64 = 1.1;
/// The part of the anchors that may go for the instructions of a frame; a frame that would take more still takes longer instead.
const MOST_CUT_FOR_TIME: f64 = 0.5;

/// A bundle within its limits.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The bundle.
    pub written: Written,
    /// What it holds.
    pub finished: Finished,
    /// What was left out for it, if anything.
    pub cut: Option<Cut>,
    /// How the device draws all of it, where its memory is limited.
    pub plan: Option<Plan>,
    /// Instructions predicted for its slowest frame, where there is a processor.
    pub instructions: Option<u64>,
}

/// What a scene lost to its limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cut {
    /// Anchors that were left out.
    pub n_anchors: usize,
    /// Bytes of the bundle that would have held them.
    pub flash_bytes: u64,
    /// Scratch memory that would have done, where it is limited.
    pub ram_bytes: Option<u64>,
    /// Instructions that a frame would have taken, where there is a processor.
    pub instructions: Option<u64>,
    /// PSNR over the held-out views with them, dB.
    pub psnr_db: Option<f32>,
}

/// What a bundle takes of a limit.
#[derive(Clone, Copy)]
struct Need {
    limit: &'static str,
    available: u64,
    needed: u64,
}

impl Need {
    fn share(&self) -> f64 {
        self.needed as f64 / self.available.max(1) as f64
    }
}

/// A coded scene and what it takes.
struct Attempt {
    finished: Finished,
    coded: CodedScene,
    /// What drawing takes, where a limit asks for it.
    counts: Option<Vec<TierMeasures>>,
    plan: Option<Plan>,
    /// Scratch memory of the whole scene, where it is limited.
    ram_bytes: Option<u64>,
    /// Of the memory, or another bound of the level, that leaves least room.
    memory: Option<Need>,
    /// Of a frame's instructions.
    time: Option<Need>,
}

/// A scene of which no part keeps a limit.
struct Unfit {
    whole: Attempt,
    /// The fewest anchors that were tried, and what they take.
    least: (usize, Need),
}

impl Attempt {
    /// The file, with every tier measured.
    fn fitted(self, cut: Option<Cut>, cameras: &[Camera], held_out: &[View]) -> Result<Fitted, EncodeError> {
        let Self { finished, coded, counts, plan, time, .. } = self;
        let bundle = coded.bundle().map_err(WriteError::ReadBack)?;
        let mut measures = match counts {
            Some(counts) => counts,
            None => count(&bundle, cameras)?,
        };
        compare(&bundle, &mut measures, held_out)?;
        let written = coded.into_file(&measures)?;
        Ok(Fitted { written, finished, cut, plan, instructions: time.map(|time| time.needed) })
    }
}

impl Encoding {
    /// Codes a finished scene in tiers, again and again without its least important anchors, until the bundle is within the flash
    /// and the whole of it keeps the level and is drawn within the RAM and, as far as half of the anchors suffice for that, within the processor's
    /// instructions; measures each tier over training views and an orbit, and assembles the file.
    ///
    /// * `held_out`: views that were not trained on, whose photographs the tiers are compared with.
    ///
    /// # Errors
    /// [`EncodeError`].
    pub fn encode(&self, finished: Finished, capture: &Capture, held_out: &[View]) -> Result<Fitted, EncodeError> {
        if !self.chooses_within_bytes() || finished.scene.context.is_none() {
            return self.cut(finished, capture, held_out);
        }
        // Each is cut for itself: a few bytes that tables save may cost decibels.
        let cut = |coder| Self { coder, ..self.clone() }.cut(finished.clone(), capture, held_out);
        match (cut(CoderChoice::Context), cut(CoderChoice::Static)) {
            (Ok(context), Ok(tables)) => {
                let psnr_db = |fitted: &Fitted| {
                    let bundle = Bundle::parse(&fitted.written.bytes).map_err(WriteError::ReadBack)?;
                    judged_psnr_db(&bundle, &capture.train)
                };
                Ok(if psnr_db(&context)? >= psnr_db(&tables)? { context } else { tables })
            }
            (Err(EncodeError::TooLarge { .. }), only) | (only, Err(EncodeError::TooLarge { .. })) => only,
            (Err(error), _) | (_, Err(error)) => Err(error),
        }
    }

    fn cut(&self, finished: Finished, capture: &Capture, held_out: &[View]) -> Result<Fitted, EncodeError> {
        let cameras = measured_cameras(capture);
        let attempt = |n: usize| {
            let mut fewer = finished.clone();
            keep(&mut fewer, n);
            self.attempt(fewer, capture, &cameras)
        };
        let n = n_kept(&finished);
        let whole = attempt(n)?;
        let lost = LostBy::of(&whole);
        let (n_held, held) = match largest_fitting(n, 1, whole, |found| found.memory, attempt)? {
            Ok(found) => found,
            Err(Unfit { least: (n_anchors, Need { limit, available, needed }), .. }) => {
                return Err(EncodeError::TooLarge { limit, available, needed, n_anchors });
            }
        };
        let at_least = (n as f64 * (1.0 - MOST_CUT_FOR_TIME)) as usize;
        let (n_left, best) = largest_fitting(n_held, at_least, held, |found| found.time, attempt)?
            .unwrap_or_else(|Unfit { whole, .. }| (n_held, whole));
        let cut = (n_left < n).then(|| lost.cut(n - n_left, held_out)).transpose()?;
        best.fitted(cut, &cameras, held_out)
    }

    /// Codes a scene, and says what it takes of the limits. A limit of bytes alone needs no frame to be counted.
    fn attempt(&self, finished: Finished, capture: &Capture, cameras: &[Camera]) -> Result<Attempt, EncodeError> {
        let coded = self.coded(&finished, capture)?;
        let flash = self.limits.flash_bytes.map(|available| {
            let needed = coded.file_len() as u64;
            Need { limit: "bytes of flash", available, needed }
        });
        let Limits { ram_bytes, processor, level, .. } = self.limits;
        if ram_bytes.is_none() && processor.is_none() && level.is_none() {
            return Ok(Attempt {
                finished,
                coded,
                counts: None,
                plan: None,
                ram_bytes: None,
                memory: flash,
                time: None,
            });
        }
        let counts = count(&coded.bundle().map_err(WriteError::ReadBack)?, cameras)?;
        let written = coded.clone().into_file(&counts)?;
        let ram = self.limits.ram_bytes.map(|available| ram_of(&written, capture, available));
        let (ram, plan) =
            ram.transpose().map_err(EncodeError::Measure)?.map_or((None, None), |(ram, plan)| (Some(ram), plan));
        let bundle = Bundle::parse(&written.bytes).map_err(WriteError::ReadBack)?;
        let of_level = level_needs(&self.limits, &bundle).into_iter().map(|need| {
            let level::Need { bound, needed, most } = need;
            Need { limit: bound.name(), available: most, needed }
        });
        let ram_bytes = ram.map(|ram| ram.needed);
        let memory = flash.into_iter().chain(ram).chain(of_level).max_by(|a, b| a.share().total_cmp(&b.share()));
        let time = self.time_of(&written, capture, cameras).map_err(EncodeError::Measure)?;
        Ok(Attempt { finished, coded, counts: Some(counts), plan, ram_bytes, memory, time })
    }

    /// Instructions of the slowest frame, where the processor is known and the memory suffices.
    fn time_of(&self, written: &Written, capture: &Capture, cameras: &[Camera]) -> Result<Option<Need>, DecodeError> {
        let Some(processor) = self.limits.processor else { return Ok(None) };
        let bundle = Bundle::parse(&written.bytes)?;
        let plans = DevicePlans::of(&bundle, frame_of(capture), self.limits.ram_bytes)?;
        let needed = most_instructions(&bundle, plans.drawn(), processor, cameras)?.round() as u64;
        Ok(Some(Need { limit: "instructions", available: processor.frame_instructions(), needed }))
    }
}

/// Cuts `whole`, a scene of `n` anchors, until the need that `of` names is no more than there is: the most anchors that keep it, of
/// which `at_least` so many have to stay, and the attempt with them.
fn largest_fitting(
    n: usize,
    at_least: usize,
    whole: Attempt,
    of: impl Fn(&Attempt) -> Option<Need>,
    attempt: impl Fn(usize) -> Result<Attempt, EncodeError>,
) -> Result<Result<(usize, Attempt), Unfit>, EncodeError> {
    let Some(need) = of(&whole).filter(|need| need.needed > need.available) else {
        return Ok(Ok((n, whole)));
    };
    let (mut best, mut least) = (None, (n, need));
    CUTTING.largest(n, |n_next| {
        if n_next == n {
            return Ok(need.share());
        }
        // As if it fitted, so that the search goes back up.
        if n_next < at_least {
            return Ok(0.5);
        }
        let found = attempt(n_next)?;
        let found_need = of(&found);
        let share = found_need.map_or(0.0, |need| need.share());
        match found_need.filter(|_| share > 1.0) {
            Some(need) => least = (n_next, need),
            None => best = Some((n_next, found)),
        }
        Ok::<_, EncodeError>(share)
    })?;
    Ok(best.ok_or(Unfit { whole, least }))
}

/// Scratch memory of the whole scene, and the plan where it suffices.
fn ram_of(written: &Written, capture: &Capture, available: u64) -> Result<(Need, Option<Plan>), DecodeError> {
    let bundle = Bundle::parse(&written.bytes)?;
    let DevicePlans { in_two_strips, smallest, within } = DevicePlans::of(&bundle, frame_of(capture), Some(available))?;
    let two_strips = in_two_strips.scratch_len() as u64;
    let nearly = two_strips > available && two_strips as f64 <= WORTH_CUTTING * available as f64;
    let needed = match within {
        Some(_) if nearly => two_strips,
        // What the plan takes beyond saves passes, and leaves room for anchors.
        Some(plan) if two_strips <= available => two_strips.max(plan.least_len() as u64),
        Some(plan) => plan.least_len() as u64,
        None if nearly => two_strips,
        // Halves were tried too, and were not enough.
        None => (smallest.scratch_len() as u64).max(available + 1),
    };
    Ok((Need { limit: "bytes of RAM", available, needed }, within))
}

/// What is lost when all that is too much of a scene goes.
struct LostBy {
    coded: CodedScene,
    ram_bytes: Option<u64>,
    instructions: Option<u64>,
}

impl LostBy {
    fn of(whole: &Attempt) -> Self {
        Self {
            coded: whole.coded.clone(),
            ram_bytes: whole.ram_bytes,
            instructions: whole.time.map(|time| time.needed),
        }
    }

    fn cut(self, n_anchors: usize, held_out: &[View]) -> Result<Cut, EncodeError> {
        let Self { coded, ram_bytes, instructions } = self;
        let psnr_db = mean_psnr_db(&coded.bundle().map_err(WriteError::ReadBack)?, u8::MAX, held_out)?;
        Ok(Cut { n_anchors, flash_bytes: coded.file_len() as u64, ram_bytes, instructions, psnr_db })
    }
}

/// Anchors with a drawn offset: those that are written.
fn n_kept(finished: &Finished) -> usize {
    let anchors = &finished.scene.anchors;
    (0..anchors.len()).filter(|anchor| anchors.has_drawn(*anchor)).count()
}

/// Masks all offsets of all but the `n` most important anchors; of equal ones the first stay.
fn keep(finished: &mut Finished, n: usize) {
    let anchors = &mut finished.scene.anchors;
    let mut kept: Vec<usize> = (0..anchors.len()).filter(|anchor| anchors.has_drawn(*anchor)).collect();
    kept.sort_by(|a, b| finished.importance[*b].total_cmp(&finished.importance[*a]));
    let k = finished.scene.shape.n_offsets;
    let cut: Vec<usize> = kept.drain(n.min(kept.len())..).flat_map(|anchor| anchor * k..(anchor + 1) * k).collect();
    anchors.mask(&cut);
}
