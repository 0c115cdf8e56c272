//! Drawing with the decoder, and a sink that keeps the books.

use std::convert::Infallible;

use glam::DVec3;
use pocketsplat_capture::dataset::Normalisation;
use pocketsplat_core::arithmetic::Arithmetic;
use pocketsplat_core::{
    Budget, Bundle, Camera, DecodeError, Decoder, FrameReport, MaxSplats, Quality, Residency, Strips, TileSink,
};
use pocketsplat_trainer::bundle::{self, BundleInfo, WriteOptions};
use pocketsplat_trainer::camera::core_camera;
use pocketsplat_trainer::cost::{ArithmeticChoice, WithArithmetic};
use pocketsplat_trainer::scene::Scene;

/// What lies behind the test scenes.
pub const BACKGROUND: [u8; 3] = [13, 77, 200];

/// A frame, and how often each of its pixels arrived.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Width, pixels.
    pub width_px: usize,
    /// `[height, width, 3]`.
    pub rgb: Vec<u8>,
    /// `[height, width]`.
    pub deliveries: Vec<u32>,
}

impl Frame {
    /// A frame to which nothing was delivered.
    pub fn new(width_px: u16, height_px: u16) -> Self {
        let n_pixels = usize::from(width_px) * usize::from(height_px);
        Self { width_px: width_px.into(), rgb: vec![0; 3 * n_pixels], deliveries: vec![0; n_pixels] }
    }
}

impl TileSink for Frame {
    type Error = Infallible;

    fn tile(&mut self, x_px: u16, y_px: u16, width: u16, height: u16, rgb: &[[u8; 3]]) -> Result<(), Infallible> {
        let [x, y, width, height] = [x_px, y_px, width, height].map(usize::from);
        assert_eq!(rgb.len(), width * height, "pixels of the tile at ({x}, {y})");
        assert!(
            x + width <= self.width_px,
            "the tile at ({x}, {y}) ends at {}, the frame at {}",
            x + width,
            self.width_px
        );
        for (row, pixels) in rgb.chunks_exact(width).enumerate() {
            let start = (y + row) * self.width_px + x;
            self.rgb[3 * start..][..3 * width].copy_from_slice(pixels.as_flattened());
            self.deliveries[start..][..width].iter_mut().for_each(|n| *n += 1);
        }
        Ok(())
    }
}

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
    let plan = bundle.plan(budget)?;
    let mut scratch = vec![0; plan.scratch_len()];
    let mut frame = Frame::new(camera.width_px, camera.height_px);
    let report = Decoder::bind_in::<A>(bundle, plan, &mut scratch)?.render(camera, &mut frame)?;
    Ok((frame, report))
}
