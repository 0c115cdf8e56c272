//! The decoder's own renderer, with memory from the heap: what a device would show.

use std::convert::Infallible;

use pocketsplat_core::{
    Arithmetic, Budget, Bundle, DecodeError, Decoder, FrameReport, MaxSplats, Plan, Residency, Strips, Tile, TileSink,
};

use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::Image;
use pocketsplat_kernels::camera::core_camera;

/// An image by decoder-core, and what it took.
#[derive(Clone, Debug, PartialEq)]
pub struct CoreFrame {
    /// The image.
    pub image: Image,
    /// What the frame consisted of.
    pub report: FrameReport,
    /// Bytes of scratch memory that just suffice for this frame in one strip of streamed anchors.
    pub scratch_bytes: usize,
}

/// Draws `bundle` as `camera` sees it, the way a device does.
///
/// # Errors
/// [`DecodeError`] for a damaged bundle or an unusable camera.
pub fn core_image(bundle: &Bundle<'_>, camera: &Camera) -> Result<CoreFrame, DecodeError> {
    core_image_of_tiers(bundle, camera, u8::MAX)
}

/// As [`core_image`], with the first `tiers` tiers at most.
///
/// # Errors
/// As [`core_image`].
pub fn core_image_of_tiers(bundle: &Bundle<'_>, camera: &Camera, tiers: u8) -> Result<CoreFrame, DecodeError> {
    let camera = core_camera(camera)?;
    // Each frame is bound anew, so that anchors are decoded once whatever the residency.
    let budget = Budget::for_frame(camera.width_px, camera.height_px)
        .with_tiers(tiers)
        .with_max_splats(MaxSplats::Worst)
        .with_residency(Residency::Streamed)
        .with_strips(Strips::Exactly(1));
    let plan = Plan::new(bundle, &budget)?;
    let mut scratch = vec![0; plan.scratch_len()];
    let (image, report) = image_of(&mut Decoder::bind(bundle, plan, &mut scratch)?, &camera)?;
    Ok(CoreFrame { image, report, scratch_bytes: report.scratch_used as usize })
}

/// Draws a frame of a decoder that is bound already, within the plan that it is bound to.
///
/// # Errors
/// As [`Decoder::render`].
pub fn image_of<A: Arithmetic>(
    decoder: &mut Decoder<'_, '_, A>,
    camera: &pocketsplat_core::Camera,
) -> Result<(Image, FrameReport), DecodeError> {
    let mut sink = ImageSink::new(camera.width_px, camera.height_px);
    let report = decoder.render(camera, &mut sink)?;
    Ok((sink.image, report))
}

/// Copies tiles into an image.
struct ImageSink {
    image: Image,
}

impl ImageSink {
    fn new(width_px: u16, height_px: u16) -> Self {
        let n_bytes = 3 * usize::from(width_px) * usize::from(height_px);
        Self { image: Image { width_px: width_px.into(), height_px: height_px.into(), rgb: vec![0; n_bytes] } }
    }
}

impl TileSink for ImageSink {
    type Error = Infallible;

    fn tile(&mut self, Tile { x_px, y_px, width, rgb, .. }: Tile<'_>) -> Result<(), Infallible> {
        let stride = self.image.width_px as usize;
        for (y, row) in rgb.chunks_exact(usize::from(width)).enumerate() {
            let start = 3 * ((usize::from(y_px) + y) * stride + usize::from(x_px));
            self.image.rgb[start..start + 3 * row.len()].copy_from_slice(row.as_flattened());
        }
        Ok(())
    }
}
