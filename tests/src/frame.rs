//! Drawing with the decoder.

use glam::DVec3;
use pocketsplat_capture::dataset::Normalisation;
use pocketsplat_codec::bundle::{self, BundleInfo, WriteOptions};
use pocketsplat_core::{
    Arithmetic, Budget, Bundle, Camera, DecodeError, Decoder, FrameReport, MaxSplats, Plan, Quality, Residency, Strips,
};
use pocketsplat_kernels::camera::core_camera;
use pocketsplat_kernels::scene::Scene;
use pocketsplat_trainer::cost::{ArithmeticChoice, WithArithmetic};

pub use crate::fuzz::frame::Frame;

/// What lies behind the test scenes.
pub const BACKGROUND: [u8; 3] = [13, 77, 200];

/// The decoder's camera of a host camera: the same numbers rounded to f32.
pub fn to_core(camera: &pocketsplat_capture::camera::Camera) -> Camera {
    core_camera(camera).expect("a test camera is a sound one")
}

/// What a bundle says besides its scene, with `preview` as its preview.
pub fn info_for(preview: &pocketsplat_capture::camera::Camera) -> BundleInfo {
    BundleInfo {
        normalisation: Normalisation { centre: DVec3::ZERO, scale: 1.0 },
        background: BACKGROUND,
        training_px: [preview.width_px, preview.height_px],
        preview: preview.clone(),
        protocol: None,
    }
}

/// The bundle of a scene, with the first of the test cameras as its preview.
pub fn bundle_of(scene: &Scene<f32>, preview: &pocketsplat_capture::camera::Camera) -> Vec<u8> {
    let written = bundle::write(scene, &info_for(preview), &WriteOptions::default());
    written.expect("a test scene can be written").bytes
}

/// A budget that is enough for every view of the size of `camera`, in one strip, with anchors that stay in the bundle.
pub fn budget_for(camera: &Camera) -> Budget {
    Budget::for_frame(camera.width_px, camera.height_px)
        .with_max_splats(MaxSplats::Worst)
        .with_residency(Residency::Streamed)
        .with_strips(Strips::Exactly(1))
}

/// Draws one frame in fresh memory.
///
/// # Errors
/// The decoder's.
pub fn draw(bundle: &Bundle<'_>, camera: &Camera) -> Result<(Frame, FrameReport), DecodeError> {
    draw_in(ArithmeticChoice::Reference, bundle, camera)
}

/// As [`draw`], with another arithmetic.
///
/// # Errors
/// The decoder's.
pub fn draw_in(
    choice: ArithmeticChoice,
    bundle: &Bundle<'_>,
    camera: &Camera,
) -> Result<(Frame, FrameReport), DecodeError> {
    choice.call(Drawing { bundle, camera, budget: budget_for(camera) })
}

/// As [`draw`], of another quality.
///
/// # Errors
/// The decoder's.
pub fn draw_at(quality: Quality, bundle: &Bundle<'_>, camera: &Camera) -> Result<(Frame, FrameReport), DecodeError> {
    ArithmeticChoice::Reference.call(Drawing { bundle, camera, budget: budget_for(camera).with_quality(quality) })
}

/// A frame to draw.
struct Drawing<'a, 'b> {
    bundle: &'a Bundle<'b>,
    camera: &'a Camera,
    budget: Budget,
}

/// As [`draw`], as a budget says.
///
/// # Errors
/// The decoder's.
pub fn draw_by(budget: &Budget, bundle: &Bundle<'_>, camera: &Camera) -> Result<(Frame, FrameReport), DecodeError> {
    ArithmeticChoice::Reference.call(Drawing { bundle, camera, budget: *budget })
}

impl WithArithmetic for Drawing<'_, '_> {
    type Output = Result<(Frame, FrameReport), DecodeError>;

    fn call<A: Arithmetic>(self) -> Self::Output {
        drawn::<A>(self.bundle, self.camera, &self.budget)
    }
}

fn drawn<A: Arithmetic>(
    bundle: &Bundle<'_>,
    camera: &Camera,
    budget: &Budget,
) -> Result<(Frame, FrameReport), DecodeError> {
    let plan = Plan::new(bundle, budget)?;
    let mut scratch = vec![0; plan.scratch_len()];
    let mut frame = Frame::new(camera.width_px, camera.height_px);
    let report = Decoder::bind_in::<A>(bundle, plan, &mut scratch)?.render(camera, &mut frame)?;
    Ok((frame, report))
}
