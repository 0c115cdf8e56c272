//! A scene cut until its bundle keeps the limits of a device.

use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{Capture, View};
use pocketsplat_core::{Bundle, DecodeError, Plan};

use super::scale::{DevicePlans, frame_of, measured_cameras};
use super::{EncodeError, Encoding};
use crate::bundle::{WriteError, Written};
use crate::manifest::measure;
use crate::train::finish::Finished;
use crate::train::steering::Search;

/// A cut goes on until this share of the limit is used, or for so many codings.
const CUTTING: Search = Search { tolerance: 0.015, most_trials: 14 };
/// A scene that takes at most so much more than the memory in two strips is cut until it does not. Any other may be drawn in more
/// strips, which take less memory and more time.
const WORTH_CUTTING: f64 = 1.1;

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
    /// PSNR over the held-out views with them, dB.
    pub psnr_db: Option<f32>,
}

/// What a bundle takes of the limit that leaves least room.
#[derive(Clone, Copy)]
struct Need {
    memory: &'static str,
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
    written: Written,
    plan: Option<Plan>,
    need: Option<Need>,
}

impl Attempt {
    fn share(&self) -> f64 {
        self.need.map_or(0.0, |need| need.share())
    }

    fn fitted(self, cut: Option<Cut>) -> Fitted {
        let Self { written, finished, plan, .. } = self;
        Fitted { written, finished, cut, plan }
    }
}

impl Encoding {
    /// Codes a finished scene in tiers, again and again without its least important anchors, until the bundle is within the flash
    /// and the whole of it is drawn within the RAM; measures each tier over training views and an orbit, and assembles the file.
    ///
    /// * `held_out`: views that were not trained on, whose photographs the tiers are compared with.
    ///
    /// # Errors
    /// [`EncodeError`].
    pub fn encode(&self, finished: Finished, capture: &Capture, held_out: &[View]) -> Result<Fitted, EncodeError> {
        let cameras = measured_cameras(capture);
        let attempt = |finished| self.attempt(finished, capture, &cameras, held_out);
        let (n, whole) = (n_kept(&finished), attempt(finished.clone())?);
        let Some(need) = whole.need.filter(|need| need.needed > need.available) else {
            return Ok(whole.fitted(None));
        };
        let lost = lost_by(&whole)?;
        let (mut best, mut least) = (None, (n, need));
        let first = whole.share();
        CUTTING.largest(n, |n_next| {
            if n_next == n {
                return Ok(first);
            }
            let mut fewer = finished.clone();
            keep(&mut fewer, n_next);
            let found = attempt(fewer)?;
            let share = found.share();
            match found.need.filter(|_| share > 1.0) {
                Some(need) => least = (n_next, need),
                None => best = Some((n_next, found)),
            }
            Ok::<_, EncodeError>(share)
        })?;
        let Some((n_left, best)) = best else {
            let (n_anchors, Need { memory, available, needed }) = least;
            return Err(EncodeError::TooLarge { memory, available, needed, n_anchors });
        };
        Ok(best.fitted(Some(Cut { n_anchors: n - n_left, ..lost })))
    }

    /// Codes and measures a scene, and says what it takes of the limits.
    fn attempt(
        &self,
        finished: Finished,
        capture: &Capture,
        cameras: &[Camera],
        held_out: &[View],
    ) -> Result<Attempt, EncodeError> {
        let coded = self.coded(&finished, capture)?;
        let bundle = coded.bundle().map_err(WriteError::ReadBack)?;
        let measures = measure(&bundle, cameras, held_out).map_err(EncodeError::Measure)?;
        let written = coded.into_file(&measures)?;
        let flash = self.limits.flash_bytes.map(|available| {
            let needed = written.bytes.len() as u64;
            Need { memory: "flash", available, needed }
        });
        let ram = self.limits.ram_bytes.map(|available| ram_of(&written, capture, available));
        let (ram, plan) =
            ram.transpose().map_err(EncodeError::Measure)?.map_or((None, None), |(ram, plan)| (Some(ram), plan));
        let need = flash.into_iter().chain(ram).max_by(|a, b| a.share().total_cmp(&b.share()));
        Ok(Attempt { finished, written, plan, need })
    }
}

/// Scratch memory of the whole scene, and the plan where it suffices.
fn ram_of(written: &Written, capture: &Capture, available: u64) -> Result<(Need, Option<Plan>), DecodeError> {
    let bundle = Bundle::parse(&written.bytes)?;
    let DevicePlans { in_two_strips, smallest, within } = DevicePlans::of(&bundle, frame_of(capture), Some(available))?;
    let two_strips = in_two_strips.scratch_len() as u64;
    let nearly = two_strips > available && two_strips as f64 <= WORTH_CUTTING * available as f64;
    let needed = match within {
        Some(_) if nearly => two_strips,
        Some(plan) => plan.scratch_len() as u64,
        None if nearly => two_strips,
        // Halves were tried too, and were not enough.
        None => (smallest.scratch_len() as u64).max(available + 1),
    };
    Ok((Need { memory: "RAM", available, needed }, within))
}

/// What is lost when all that is too much of a scene goes.
fn lost_by(whole: &Attempt) -> Result<Cut, EncodeError> {
    let bundle = Bundle::parse(&whole.written.bytes).map_err(WriteError::ReadBack)?;
    let psnr_db = bundle.n_tiers().checked_sub(1).and_then(|tier| bundle.measures(tier)?.psnr_db);
    let ram_bytes = whole.need.filter(|need| need.memory == "RAM").map(|need| need.needed);
    Ok(Cut { n_anchors: 0, flash_bytes: whole.written.bytes.len() as u64, ram_bytes, psnr_db })
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
