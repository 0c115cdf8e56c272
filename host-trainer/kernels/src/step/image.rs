//! The stages of a step between splats and the image's loss, on the CPU or on another device.

use std::fmt;

use super::buffer::refill;
use super::fault::DeviceFault;
use super::target::clear_masked;
use super::{ExposureSums, ImagePair, LossWeights, TargetView};
use crate::ops::image::project::{Footprint, Splat};
use crate::ops::image::rasterise::TiledImage;
use crate::ops::image::tiles::TileLists;
use crate::ops::image::{rasterise, tiles};
use crate::ops::loss::{l1, ssim};
use crate::ops::simd::Level;
use crate::real::Real;

/// What the comparison with the photograph found.
#[derive(Clone, Copy, Debug)]
pub struct ImageLoss<R> {
    /// Mean absolute difference.
    pub l1: R,
    /// Mean SSIM.
    pub similarity: R,
    /// Σ over pixels and channels of the squared difference.
    pub squared_sum: f64,
    /// What the exposure would be, where the view has one.
    pub exposure: Option<ExposureSums>,
}

/// A term of a module on the image: adds its gradient, returns its value.
pub type ImageTerm<'t, R> = dyn FnMut(&ImagePair<'_, R>, &mut [R]) -> R + 't;

/// Tiles, rasterising, L1 and SSIM of one view, called in this order; all state is of the view that was drawn last.
pub trait ImageStages<R>: fmt::Debug + Send {
    /// Lists the splats of each tile. Returns the number of (tile, splat) pairs.
    ///
    /// * `splats`, `footprints`: `[n]`.
    ///
    /// # Errors
    /// [`DeviceFault`], as all of these.
    fn bin(
        &mut self,
        splats: Vec<Splat<R>>,
        footprints: Vec<Footprint<R>>,
        size_px: [usize; 2],
    ) -> Result<usize, DeviceFault>;

    /// Draws all tiles.
    ///
    /// # Errors
    /// [`DeviceFault`].
    fn draw(&mut self, background: [R; 3]) -> Result<(), DeviceFault>;

    /// Compares with the photograph, and begins the gradient of (1 − λ)·L1 + λ·(1 − SSIM).
    ///
    /// # Errors
    /// [`DeviceFault`].
    fn compare(&mut self, target: &TargetView<'_, R>, weights: &LossWeights) -> Result<ImageLoss<R>, DeviceFault>;

    /// Adds a term.
    ///
    /// # Errors
    /// [`DeviceFault`].
    fn add_term(&mut self, target: &TargetView<'_, R>, term: &mut ImageTerm<'_, R>) -> Result<R, DeviceFault>;

    /// Ends the gradient of the image: pixels that do not count have none.
    ///
    /// # Errors
    /// [`DeviceFault`].
    fn end_gradient(&mut self, target: &TargetView<'_, R>) -> Result<(), DeviceFault>;

    /// The gradients of the splats `[n]` and of the background.
    ///
    /// # Errors
    /// [`DeviceFault`].
    fn backward(&mut self) -> Result<(Vec<Splat<R>>, [R; 3]), DeviceFault>;
}

/// The stages on this CPU; buffers are kept from step to step.
#[derive(Clone, Debug)]
pub(super) struct CpuImage<R> {
    level: Level,
    size_px: [usize; 2],
    splats: Vec<Splat<R>>,
    footprints: Vec<Footprint<R>>,
    lists: TileLists,
    tiled: TiledImage<R>,
    image: Vec<R>,
    d_image: Vec<R>,
    d_tiled: TiledImage<R>,
    d_pairs: Vec<Splat<R>>,
}

impl<R: Real> CpuImage<R> {
    pub(super) fn new(level: Level) -> Self {
        Self {
            level,
            size_px: [0; 2],
            splats: Vec::new(),
            footprints: Vec::new(),
            lists: TileLists::default(),
            tiled: TiledImage::default(),
            image: Vec::new(),
            d_image: Vec::new(),
            d_tiled: TiledImage::default(),
            d_pairs: Vec::new(),
        }
    }
}

impl<R: Real> ImageStages<R> for CpuImage<R> {
    fn bin(
        &mut self,
        splats: Vec<Splat<R>>,
        footprints: Vec<Footprint<R>>,
        size_px: [usize; 2],
    ) -> Result<usize, DeviceFault> {
        (self.splats, self.footprints, self.size_px) = (splats, footprints, size_px);
        tiles::build_into(&mut self.lists, &self.splats, &self.footprints, size_px);
        Ok(self.lists.entries.len())
    }

    fn draw(&mut self, background: [R; 3]) -> Result<(), DeviceFault> {
        let Self { tiled, level, splats, footprints, lists, .. } = self;
        rasterise::forward_into(tiled, *level, splats, footprints, lists, background);
        Ok(())
    }

    fn compare(&mut self, target: &TargetView<'_, R>, weights: &LossWeights) -> Result<ImageLoss<R>, DeviceFault> {
        self.tiled.write_planes(self.size_px, &mut self.image);
        let exposure = target.exposure.map(|exposure| {
            let sums = ExposureSums::of(&self.image, target.truth(), target.mask);
            exposure.apply(&mut self.image);
            sums
        });
        clear_masked(&mut self.image, target.mask);
        let lambda = R::real(weights.dssim);
        let (similarity, partials) = ssim::forward(self.level, &self.image, target.truth(), self.size_px);
        refill(&mut self.d_image, self.image.len());
        l1::backward(&self.image, target.truth(), R::ONE - lambda, &mut self.d_image);
        let Self { level, image, size_px, d_image, .. } = self;
        ssim::backward(*level, image, target.truth(), *size_px, &partials, -lambda, d_image);
        let squared_sum = target.squared_sum(image);
        Ok(ImageLoss { l1: l1::forward(image, target.truth()), similarity, squared_sum, exposure })
    }

    fn add_term(&mut self, target: &TargetView<'_, R>, term: &mut ImageTerm<'_, R>) -> Result<R, DeviceFault> {
        let Self { image, size_px, level, d_image, .. } = self;
        Ok(term(&ImagePair { image, truth: target.truth(), size_px: *size_px, level: *level }, d_image))
    }

    fn end_gradient(&mut self, target: &TargetView<'_, R>) -> Result<(), DeviceFault> {
        clear_masked(&mut self.d_image, target.mask);
        if let Some(exposure) = target.exposure {
            exposure.backward(&mut self.d_image);
        }
        self.d_tiled.read_planes(&self.d_image, self.size_px);
        Ok(())
    }

    fn backward(&mut self) -> Result<(Vec<Splat<R>>, [R; 3]), DeviceFault> {
        let Self { level, splats, footprints, lists, tiled, d_tiled, d_pairs, .. } = self;
        let d_splats = rasterise::backward_through(d_pairs, *level, splats, footprints, lists, tiled, d_tiled);
        Ok((d_splats, rasterise::background_gradient(tiled, d_tiled)))
    }
}
