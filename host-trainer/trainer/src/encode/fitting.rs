//! A scene cut until its bundle keeps the limits of a device.

use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{Capture, View};
use pocketsplat_core::{Budget, Bundle, DecodeError};

use super::{EncodeError, Encoding};
use crate::bundle::{CodedScene, WriteError, Written};
use crate::manifest::{cameras_to_measure, measure};
use crate::train::finish::Finished;

/// Scenes that are coded at most before giving up.
const MOST_ATTEMPTS: usize = 12;
/// A cut goes a little further than proportion says, because heads and models stay.
const MARGIN: f64 = 0.98;

/// A bundle within its limits.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The bundle.
    pub written: Written,
    /// What it holds.
    pub finished: Finished,
    /// Anchors that were left out for it.
    pub n_cut: usize,
}

/// What a bundle takes too much of.
struct Excess {
    memory: &'static str,
    available: u64,
    needed: u64,
}

impl Encoding {
    /// Codes a finished scene in tiers, again and again without its least important anchors, until the bundle is within the flash
    /// and its lowest tier is drawn within the RAM; measures each tier over training views and an orbit, and assembles the file.
    ///
    /// * `held_out`: views that were not trained on, whose photographs the tiers are compared with.
    ///
    /// # Errors
    /// [`EncodeError`].
    pub fn encode(&self, finished: Finished, capture: &Capture, held_out: &[View]) -> Result<Fitted, EncodeError> {
        // Photographs are not larger than frames may be: loading has seen to it.
        let [width_px, height_px] = capture.largest_px().map(|px| px as u16);
        let frame = Budget::for_frame(width_px, height_px);
        let cameras: Vec<_> = capture.train.iter().map(|view| view.camera.clone()).collect();
        let cameras = cameras_to_measure(&cameras);
        let mut finished = finished;
        let n_before = n_kept(&finished);
        let mut attempts = 0;
        loop {
            let n_now = n_kept(&finished);
            let coded = self.coded(&finished, capture)?;
            let Excess { memory, available, needed } = match self.within_limits(coded, &frame, &cameras, held_out)? {
                Ok(written) => return Ok(Fitted { written, finished, n_cut: n_before - n_now }),
                Err(excess) => excess,
            };
            attempts += 1;
            let n_next = (n_now as f64 * MARGIN * available as f64 / needed as f64) as usize;
            if attempts == MOST_ATTEMPTS || n_next == 0 {
                return Err(EncodeError::TooLarge { memory, available, needed, n_anchors: n_now });
            }
            keep(&mut finished, n_next);
        }
    }

    /// Measures a coded scene and assembles its file, or says what it takes too much of.
    fn within_limits(
        &self,
        coded: CodedScene,
        frame: &Budget,
        cameras: &[Camera],
        held_out: &[View],
    ) -> Result<Result<Written, Excess>, EncodeError> {
        let needed = coded.file_len() as u64;
        if let Some(available) = self.limits.flash_bytes.filter(|most| needed > *most) {
            return Ok(Err(Excess { memory: "flash", available, needed }));
        }
        let bundle = coded.bundle().map_err(WriteError::ReadBack)?;
        let measures = measure(&bundle, cameras, held_out).map_err(EncodeError::Measure)?;
        let written = coded.into_file(&measures)?;
        let excess = self.beyond_ram(&written, frame).map_err(EncodeError::Measure)?;
        Ok(excess.map_or(Ok(written), Err))
    }

    fn beyond_ram(&self, written: &Written, frame: &Budget) -> Result<Option<Excess>, DecodeError> {
        let Some(available) = self.limits.ram_bytes else { return Ok(None) };
        let budget = frame.in_bytes(usize::try_from(available).unwrap_or(usize::MAX));
        match Bundle::parse(&written.bytes)?.plan(&budget) {
            Ok(_) => Ok(None),
            Err(DecodeError::BudgetTooSmall { needed, .. }) => {
                Ok(Some(Excess { memory: "RAM", available, needed: needed.into() }))
            }
            Err(error) => Err(error),
        }
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
