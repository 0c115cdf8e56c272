//! What the bundle of a scene takes of the limits of its device.

use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::Capture;
use pocketsplat_core::{Budget, Bundle, DecodeError, Decoder, Plan, Residency, Strips};
use pocketsplat_instructions::level::{Bound, Level, Need};
use pocketsplat_instructions::{Processor, predict};

use super::{EncodeError, Encoding};
use crate::device::Limits;
use crate::train::limits::{Finished, LimitProbe, LimitShares, MeasuredShares};
use pocketsplat_codec::bundle::WriteError;
use pocketsplat_codec::manifest::{cameras_to_measure, count};
use pocketsplat_codec::render::decoder::image_of;
use pocketsplat_kernels::camera::core_camera;

/// Strips that the model of a device is chosen for.
const STRIPS: u8 = 2;
/// Every so many of the measured cameras one is drawn to predict its instructions.
const DRAWN_EVERY: usize = 9;

/// Codes scenes to find out what their bundles take.
#[derive(Debug)]
pub struct EncodedSizes<'a> {
    encoding: &'a Encoding,
    capture: &'a Capture,
    cameras: Vec<Camera>,
}

impl Encoding {
    /// What measures the bundles of a capture's scenes; `None` where nothing limits them.
    pub fn sizes<'a>(&'a self, capture: &'a Capture) -> Option<EncodedSizes<'a>> {
        (!self.limits.is_none()).then(|| EncodedSizes { encoding: self, capture, cameras: measured_cameras(capture) })
    }
}

impl EncodedSizes<'_> {
    /// What a run asks while it trains.
    pub fn measure(&self) -> impl Fn(&Finished) -> MeasuredShares + Sync {
        |finished| Ok(self.shares(finished)?)
    }

    /// The limits of a run whose scenes `measure` codes.
    pub fn probe<'p>(&self, measure: &'p (dyn Fn(&Finished) -> MeasuredShares + Sync)) -> LimitProbe<'p> {
        LimitProbe { measure, limits_bytes: self.encoding.limits.flash_bytes.is_some() }
    }

    fn shares(&self, finished: &Finished) -> Result<LimitShares, EncodeError> {
        let limits = &self.encoding.limits;
        let coded = self.encoding.expected(finished, self.capture)?;
        let bytes = limits.flash_bytes.map_or(0.0, |most| coded.file_len() as f64 / most as f64);
        if limits.ram_bytes.is_none() && limits.processor.is_none() {
            return Ok(LimitShares { bytes, ..LimitShares::default() });
        }
        let bundle = coded.bundle().map_err(WriteError::ReadBack)?;
        let measures = count(&bundle, &self.cameras)?;
        let written = coded.into_file(&measures)?;
        let [ram, instructions] = self.drawing(&written.bytes).map_err(EncodeError::Measure)?;
        Ok(LimitShares { ram, instructions, bytes })
    }

    /// Shares of the RAM and of a frame's instructions.
    fn drawing(&self, bundle: &[u8]) -> Result<[f64; 2], DecodeError> {
        let limits = &self.encoding.limits;
        let bundle = Bundle::parse(bundle)?;
        let plans = DevicePlans::of(&bundle, frame_of(self.capture), limits.ram_bytes)?;
        let mut ram = limits.ram_bytes.map_or(0.0, |most| plans.in_two_strips.scratch_len() as f64 / most as f64);
        let mut instructions = 0.0_f64;
        if let Some(processor) = limits.processor {
            let most = processor.frame_instructions() as f64;
            instructions = most_instructions(&bundle, plans.drawn(), processor, &self.cameras)? / most;
        }
        for need in level_needs(limits, &bundle) {
            match need.bound {
                // Of the length of the bundle the rate is steered.
                Bound::Frame | Bound::Flash => {}
                Bound::Scratch => ram = ram.max(need.share()),
                Bound::Anchors | Bound::Splats | Bound::HeadMacs | Bound::Instructions => {
                    instructions = instructions.max(need.share());
                }
            }
        }
        Ok([ram, instructions])
    }
}

/// What the whole of a bundle takes of its level's bounds; nothing where it is to keep none.
pub(super) fn level_needs(limits: &Limits, bundle: &Bundle<'_>) -> Vec<Need> {
    let level = limits.level.and_then(Level::numbered);
    let needs = level.zip(bundle.n_tiers().checked_sub(1)).and_then(|(level, tier)| level.needs(bundle, tier));
    needs.map_or_else(Vec::new, |needs| needs.to_vec())
}

/// Instructions predicted for the slowest frame of every [`DRAWN_EVERY`]th camera.
pub(super) fn most_instructions(
    bundle: &Bundle<'_>,
    plan: Plan,
    processor: Processor,
    cameras: &[Camera],
) -> Result<f64, DecodeError> {
    let mut scratch = vec![0; plan.scratch_len()];
    let mut decoder = Decoder::bind(bundle, plan, &mut scratch)?;
    let mut most = 0.0_f64;
    for camera in cameras.iter().step_by(DRAWN_EVERY) {
        let camera = core_camera(camera)?;
        let (_, report) = image_of(&mut decoder, &camera)?;
        let size_px = [camera.width_px, camera.height_px];
        most = most.max(predict(processor.instruction_set(), bundle, &plan, &report, size_px).iter().sum());
    }
    Ok(most)
}

/// The cameras that the scenes of a capture are measured with.
pub(super) fn measured_cameras(capture: &Capture) -> Vec<Camera> {
    let cameras: Vec<_> = capture.train.iter().map(|view| view.camera.clone()).collect();
    cameras_to_measure(&cameras)
}

/// A frame as large as the training images, of all tiers.
pub(super) fn frame_of(capture: &Capture) -> Budget {
    // Photographs are not larger than frames may be: loading has seen to it.
    let [width_px, height_px] = capture.largest_px().map(|px| px as u16);
    Budget::for_frame(width_px, height_px)
}

/// How a device may draw the whole of a bundle.
pub(super) struct DevicePlans {
    /// As its model was chosen: in two strips of anchors that are decoded in every frame.
    pub(super) in_two_strips: Plan,
    /// The plan of the whole scene that takes fewest bytes.
    pub(super) smallest: Plan,
    /// The plan that draws the whole scene within the device's memory with the least work.
    pub(super) within: Option<Plan>,
}

impl DevicePlans {
    pub(super) fn of(bundle: &Bundle<'_>, frame: Budget, ram_bytes: Option<u64>) -> Result<Self, DecodeError> {
        let streamed =
            |n| Plan::new(bundle, &frame.with_residency(Residency::Streamed).with_strips(Strips::Exactly(n)));
        let in_two_strips = streamed(STRIPS)?;
        let mut smallest = in_two_strips;
        for n_strips in pocketsplat_format::bundle::STRIPS {
            let plan = streamed(n_strips)?;
            if plan.scratch_len() < smallest.scratch_len() {
                smallest = plan;
            }
        }
        let ram_bytes = ram_bytes.map_or(usize::MAX, |most| usize::try_from(most).unwrap_or(usize::MAX));
        let within = match Plan::new(bundle, &frame.in_bytes(ram_bytes)) {
            Ok(plan) => Some(plan).filter(|plan| plan.n_tiers() == bundle.n_tiers()),
            Err(DecodeError::BudgetTooSmall { .. }) => None,
            Err(error) => return Err(error),
        };
        Ok(Self { in_two_strips, smallest, within })
    }

    /// The plan that a device would draw by, or would if it had the memory.
    pub(super) fn drawn(&self) -> Plan {
        self.within.unwrap_or(self.in_two_strips)
    }
}
