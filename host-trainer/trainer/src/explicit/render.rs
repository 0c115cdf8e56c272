//! Pictures of explicit Gaussians.

use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::Image;
use pocketsplat_gaussians::Gaussians;

use super::Cloud;
use super::step::draw;
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::ops::simd::Level;
use pocketsplat_kernels::step::image_of_planes;

/// Explicit Gaussians, ready to be drawn.
#[derive(Clone, Debug)]
pub struct Renderer {
    cloud: Cloud<f32>,
    level: Level,
}

impl Renderer {
    /// * `gaussians`: in the frame of the cameras to come.
    pub fn new(gaussians: &Gaussians) -> Self {
        Self { cloud: gaussians.into(), level: Level::detect() }
    }

    /// The same; with `compensation` opacities are scaled by what the dilation adds to a splat's area, as a file's notes may say.
    #[must_use]
    pub fn with_compensation(mut self, compensation: bool) -> Self {
        self.cloud.compensation = compensation;
        self
    }

    /// Planes `[3, height, width]`, not clamped.
    ///
    /// Cost: one pass over the Gaussians, and over the pixels of those that reach the image; the same bits for any number of threads.
    ///
    /// * `background`: RGB in 0..1.
    pub fn planes(&self, camera: &Camera, background: [f32; 3]) -> Vec<f32> {
        let camera = Pinhole::new(camera);
        draw(self.level, &self.cloud, &camera, background).image.to_planes(camera.size_px)
    }

    /// [`Self::planes`] in 8 bits.
    pub fn image(&self, camera: &Camera, background: [f32; 3]) -> Image {
        let size_px = [camera.width_px as usize, camera.height_px as usize];
        image_of_planes(&self.planes(camera, background), size_px)
    }
}

/// One picture; for more of the same Gaussians, see [`Renderer`].
pub fn image(gaussians: &Gaussians, camera: &Camera, background: [f32; 3]) -> Image {
    Renderer::new(gaussians).image(camera, background)
}
