//! A scene cut until its bundle keeps the limits of a device.

use pocketsplat_core::{Budget, Bundle, DecodeError};

use super::Limits;
use crate::bundle::{WriteError, Written};
use crate::train::finish::Finished;

/// Scenes that are written at most before giving up.
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

/// Why a scene does not fit, or could not be written.
#[derive(Debug, thiserror::Error)]
pub enum NoFit {
    /// Even almost nothing of it is too much.
    #[error(
        "the scene does not fit: with {n_anchors} anchors it takes {needed} bytes of {what}, {available} are allowed; allow \
         more or train a narrower model (--feature-dim, --offsets)"
    )]
    TooSmall {
        /// Memory or flash.
        what: &'static str,
        /// Bytes that there are.
        available: u64,
        /// Bytes that it takes.
        needed: u64,
        /// Anchors of the smallest scene tried.
        n_anchors: usize,
    },
    /// The bundle is not one that the decoder reads.
    #[error(transparent)]
    Decode(#[from] DecodeError),
    /// It has no place in the format.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// What a bundle takes too much of.
struct Excess {
    what: &'static str,
    available: u64,
    needed: u64,
}

/// Writes a scene, again and again without its least important anchors, until the bundle is within `flash_bytes` and the
/// lowest tier of it is drawn within `ram_bytes`.
///
/// * `frame`: budget of the frame's size. * `write`: a scene as a bundle with its tiers measured.
///
/// # Errors
/// [`NoFit`].
pub fn fitted(
    finished: Finished,
    limits: &Limits,
    frame: &Budget,
    mut write: impl FnMut(&Finished) -> Result<Written, NoFit>,
) -> Result<Fitted, NoFit> {
    let mut finished = finished;
    let n_before = n_kept(&finished);
    let mut attempts = 0;
    loop {
        let written = write(&finished)?;
        let n_now = n_kept(&finished);
        let Some(Excess { what, available, needed }) = excess(&written, limits, frame)? else {
            return Ok(Fitted { written, finished, n_cut: n_before - n_now });
        };
        attempts += 1;
        let n_next = (n_now as f64 * MARGIN * available as f64 / needed as f64) as usize;
        if attempts == MOST_ATTEMPTS || n_next == 0 {
            return Err(NoFit::TooSmall { what, available, needed, n_anchors: n_now });
        }
        keep(&mut finished, n_next);
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

fn excess(written: &Written, limits: &Limits, frame: &Budget) -> Result<Option<Excess>, DecodeError> {
    let n_bytes = written.bytes.len() as u64;
    if let Some(available) = limits.flash_bytes.filter(|most| n_bytes > *most) {
        return Ok(Some(Excess { what: "flash", available, needed: n_bytes }));
    }
    let Some(available) = limits.ram_bytes else { return Ok(None) };
    let budget = frame.in_bytes(usize::try_from(available).unwrap_or(usize::MAX));
    match Bundle::parse(&written.bytes)?.plan(&budget) {
        Ok(_) => Ok(None),
        Err(DecodeError::BudgetTooSmall { needed, .. }) => {
            Ok(Some(Excess { what: "RAM", available, needed: needed.into() }))
        }
        Err(error) => Err(error),
    }
}
