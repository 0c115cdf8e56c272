//! What a view would lose with each Gaussian.

use super::draw::DrawnView;
use super::target::clear_masked;
use super::{Coding, LossWeights, TargetView, Workspace};
use crate::ops::image::rasterise;
use crate::ops::image::rasterise::TiledImage;
use crate::ops::loss::{l1, ssim};
use crate::ops::rate::noise::Stream;
use crate::real::Real;
use crate::scene::Scene;

/// How far the image of a view is from its photograph.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImageError {
    /// Σ over pixels and channels of the squared difference.
    pub squared_sum: f64,
    /// Pixels times channels that count.
    pub n_values: usize,
    /// (1 − λ)·L1 + λ·(1 − SSIM), the image's part of a step's loss.
    pub loss: f64,
}

impl<R: Real> Workspace<R> {
    /// Draws the view and leaves in each Gaussian's `d_gaussians.opacity` of [`Self::blocks`] the derivative d = Σ_p r_p·∂C_p/∂o
    /// of the image C by its opacity o along one random direction r of ±1.
    ///
    /// An image is linear in each opacity, but for the clamp of alpha. So taking the Gaussian away changes it by −o·∂C/∂o,
    /// occlusion included, and the expectation of (o·d)² over r is the squared error that this adds where o is at its
    /// optimum.
    ///
    /// Cost: a forward and a backward pass through the rasteriser.
    ///
    /// * `stream`: of this view.
    pub fn probe(
        &mut self,
        scene: &Scene<R>,
        target: &TargetView<'_, R>,
        weights: &LossWeights,
        stream: Stream,
    ) -> ImageError {
        let TargetView { camera, background, mask, exposure, .. } = *target;
        let size_px = camera.size_px;
        let DrawnView { image: tiled, lists, splats, footprints } =
            self.draw(scene, camera, background, &Coding::Raw, None, 0.0);
        let mut image = tiled.to_planes(size_px);
        if let Some(exposure) = exposure {
            exposure.apply(&mut image);
        }
        clear_masked(&mut image, mask);
        let similarity: f64 = ssim::forward(self.level, &image, target.truth(), size_px).0.into();
        let difference: f64 = l1::forward(&image, target.truth()).into();
        let error = ImageError {
            squared_sum: target.squared_sum(&image),
            n_values: 3 * target.n_counted(),
            loss: (1.0 - weights.dssim) * difference + weights.dssim * (1.0 - similarity),
        };
        let sign = |i: u32| if stream.uniform(i) < 0.5 { -R::ONE } else { R::ONE };
        let mut signs: Vec<R> = (0u32..).take(image.len()).map(sign).collect();
        clear_masked(&mut signs, mask);
        if let Some(exposure) = exposure {
            exposure.backward(&mut signs);
        }
        let d_tiled = TiledImage::from_planes(&signs, size_px);
        let d_splats = rasterise::backward(self.level, &splats, &footprints, &lists, &tiled, &d_tiled);
        self.splats_backward(&scene.shape, camera, &d_splats);
        error
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ops::Pinhole;
    use crate::scene::ModelShape;
    use crate::step::Exposure;
    use crate::step::example::{camera, scene};

    /// What taking an offset away changes in the image.
    fn change(scene: &Scene<f64>, camera: &Pinhole<f64>, exposure: Exposure<f64>, offset: usize) -> Vec<f64> {
        let mut without = scene.clone();
        without.anchors.mask(&[offset]);
        let mut workspace = Workspace::new(&scene.shape);
        let [with, without] = [scene, &without].map(|scene| {
            let mut image = workspace.image(scene, camera, [0.2; 3]);
            exposure.apply(&mut image);
            image
        });
        without.iter().zip(with).map(|(without, with)| without - with).collect()
    }

    #[test]
    fn a_probe_predicts_what_each_removal_changes() {
        let shape = ModelShape { view_colour: true, ..ModelShape::plain(6, 3) };
        let mut scene = scene(3, shape);
        // Small opacities: no alpha comes near its clamp.
        scene.heads.opacity.b2.fill(0.1);
        let camera = Pinhole::new(&camera());
        let truth = vec![0.5; 3 * camera.size_px[0] * camera.size_px[1]];
        let exposure = Exposure { gain: [1.2, 1.0, 0.7] };
        let target = TargetView::new(&camera, truth, None, [0.2; 3]).exposed(Some(exposure));
        let mut workspace = Workspace::new(&scene.shape);
        let (k, n_probes) = (shape.n_offsets, 600u32);
        let mut squares = vec![0.0; scene.anchors.len() * k];
        let mut checked = 0;
        for i in 0..n_probes {
            let stream = Stream::of_run(5).branch(i);
            workspace.probe(&scene, &target, &LossWeights::default(), stream);
            for block in workspace.blocks() {
                for ((gaussian, d), source) in block.gaussians.iter().zip(&block.d_gaussians).zip(&block.sources) {
                    let offset = block.anchors[source.row as usize] as usize * k + source.offset as usize;
                    let predicted = -gaussian.opacity * d.opacity;
                    squares[offset] += predicted * predicted / f64::from(n_probes);
                    if i == 0 {
                        let along = |(p, change): (u32, f64)| if stream.uniform(p) < 0.5 { -change } else { change };
                        let found: f64 = (0u32..).zip(change(&scene, &camera, exposure, offset)).map(along).sum();
                        let scale = found.abs().max(1e-3);
                        assert!((found - predicted).abs() < 0.02 * scale, "{offset}: {predicted}, found {found}");
                        checked += 1;
                    }
                }
            }
        }
        assert!(checked > 20, "{checked} offsets are no test");
        for (offset, square) in squares.iter().enumerate().filter(|(_, square)| **square > 0.0) {
            let found: f64 = change(&scene, &camera, exposure, offset).iter().map(|change| change * change).sum();
            // The mean of 600 squares: 6 % off on average, four times that at most.
            assert!((square / found - 1.0).abs() < 0.24, "{offset}: {square}, found {found}");
        }
    }
}
