//! The way forward: from the anchors that a view sees to their splats, and to its image.

use std::mem;

use pocketsplat_format::context::N_LEVELS;
use rayon::prelude::*;

use super::Workspace;
use super::block::Block;
use super::coded::Network;
use super::coding::Coding;
use super::parents::Parents;
use super::stages::{StageSeconds, StageTimer};
use crate::ops::Pinhole;
use crate::ops::image::project::{Footprint, Splat};
use crate::ops::image::rasterise::{DrawCounts, TiledImage};
use crate::ops::image::{prefilter, rasterise, tiles};
use crate::real::Real;
use crate::scene::Scene;

/// Anchors one task evaluates together; also the unit in which the gradients of the heads are summed, so that the sums
/// do not depend on the number of threads.
pub(super) const BLOCK: usize = 256;

/// A drawn view and what its backward pass needs.
pub(super) struct DrawnView<R> {
    pub(super) image: TiledImage<R>,
    pub(super) lists: tiles::TileLists,
    pub(super) splats: Vec<Splat<R>>,
    pub(super) footprints: Vec<Footprint<R>>,
}

/// Splats of a view, and the time that they took.
pub(super) struct SplatsOfView<R> {
    pub(super) stages: StageSeconds,
    pub(super) splats: Vec<Splat<R>>,
    pub(super) footprints: Vec<Footprint<R>>,
}

impl<R: Real> Workspace<R> {
    /// Draws the view on the CPU.
    pub(super) fn draw(
        &mut self,
        scene: &Scene<R>,
        camera: &Pinhole<R>,
        background: [R; 3],
        coding: &Coding<'_, R>,
        network: Option<Network<'_, R>>,
        pruned_share: f32,
    ) -> DrawnView<R> {
        let SplatsOfView { splats, footprints, .. } = self.splats_of(scene, camera, coding, network, pruned_share);
        let lists = tiles::build(&splats, &footprints, camera.size_px);
        let image = rasterise::forward(self.level, &splats, &footprints, &lists, background);
        DrawnView { image, lists, splats, footprints }
    }

    /// From the visible anchors to their splats.
    pub(super) fn splats_of(
        &mut self,
        scene: &Scene<R>,
        camera: &Pinhole<R>,
        coding: &Coding<'_, R>,
        network: Option<Network<'_, R>>,
        pruned_share: f32,
    ) -> SplatsOfView<R> {
        let mut timer = StageTimer::start();
        let is_kept = |a: usize| scene.anchors.prune_rank.get(a).is_none_or(|place| *place >= pruned_share);
        let visible: Vec<u32> = (0..scene.anchors.len())
            .into_par_iter()
            .with_min_len(1024)
            .filter(|a| is_kept(*a) && scene.anchors.has_drawn(*a) && prefilter::shows(scene, *a, camera))
            .map(|a| u32::try_from(a).expect("fewer than 2³² anchors"))
            .collect();
        let level = self.level;
        let mut parents = mem::take(&mut self.parents);
        let by_level = match network.and_then(|network| Some((network, network.model.shifts?))) {
            Some((network, shifts)) => {
                parents.update(&scene.shape, &scene.anchors, shifts, &network.model.frame);
                self.code_parents(scene, coding, network, &mut parents);
                let of = |l: usize| visible.iter().copied().filter(|a| parents.level(*a) == l).collect();
                (0..N_LEVELS).map(of).collect()
            }
            None => {
                parents = Parents::default();
                vec![visible]
            }
        };
        self.code_blocks(scene, &by_level, coding, network, &parents);
        self.parents = parents;
        let context = timer.lap();
        self.blocks[..self.n_blocks].par_iter_mut().for_each(|block| block.forward(level, scene, camera));
        let splats = self.blocks().iter().map(|b| b.splats.as_slice()).collect::<Vec<_>>().concat();
        let footprints = self.blocks().iter().map(|b| b.footprints.as_slice()).collect::<Vec<_>>().concat();
        let anchors = timer.lap();
        SplatsOfView { stages: StageSeconds { context, anchors, ..StageSeconds::default() }, splats, footprints }
    }

    /// Copies anchors into blocks, each of one level, and codes them.
    fn code_blocks(
        &mut self,
        scene: &Scene<R>,
        by_level: &[Vec<u32>],
        coding: &Coding<'_, R>,
        network: Option<Network<'_, R>>,
        parents: &Parents<R>,
    ) {
        let parts: Vec<&[u32]> = by_level.iter().flat_map(|anchors| anchors.chunks(BLOCK)).collect();
        self.n_blocks = parts.len();
        while self.blocks.len() < self.n_blocks {
            self.blocks.push(Block::new(&scene.shape));
        }
        let level = self.level;
        self.blocks.par_iter_mut().zip(parts).for_each(|(block, anchors)| {
            block.gather(scene, anchors);
            block.code(level, scene, coding, network, parents);
        });
    }

    /// Codes all anchors that others follow, the coarsest level first, wherever they stand: what they give is then known.
    fn code_parents(
        &mut self,
        scene: &Scene<R>,
        coding: &Coding<'_, R>,
        network: Network<'_, R>,
        parents: &mut Parents<R>,
    ) {
        let rounded = matches!(coding, Coding::Context { exact: Some(_), .. });
        for level in (1..N_LEVELS).rev() {
            let anchors = parents.of_level(level);
            self.code_blocks(scene, &[anchors], coding, Some(network), parents);
            for block in self.blocks() {
                block.give(network.model, rounded, parents);
            }
        }
    }

    /// The image of a view, planes `[3, height, width]`, not clamped.
    pub fn image(&mut self, scene: &Scene<R>, camera: &Pinhole<R>, background: [R; 3]) -> Vec<R> {
        self.draw(scene, camera, background, &Coding::Raw, None, 0.0).image.to_planes(camera.size_px)
    }

    /// What drawing a view is to the rasteriser.
    pub fn count(&mut self, scene: &Scene<R>, camera: &Pinhole<R>) -> DrawCounts {
        let SplatsOfView { splats, footprints, .. } = self.splats_of(scene, camera, &Coding::Raw, None, 0.0);
        rasterise::count(&splats, &footprints, &tiles::build(&splats, &footprints, camera.size_px))
    }

    /// What [`Self::image`] projects, left in [`Self::blocks`], without any pixel.
    pub fn project(&mut self, scene: &Scene<R>, camera: &Pinhole<R>) {
        self.splats_of(scene, camera, &Coding::Raw, None, 0.0);
    }

    /// Σ of α·T over the pixels of a view, for each splat: block by block, in the order of [`Block::drawn`].
    ///
    /// It is the derivative of the sum of a channel of the image by the splat's colour in it.
    pub fn contributions(&mut self, scene: &Scene<R>, camera: &Pinhole<R>) -> Vec<R> {
        let drawing = self.draw(scene, camera, [R::ZERO; 3], &Coding::Raw, None, 0.0);
        let mut d_image = vec![R::ZERO; 3 * camera.size_px[0] * camera.size_px[1]];
        let n_pixels = d_image.len() / 3;
        d_image[..n_pixels].fill(R::ONE);
        let d_tiled = TiledImage::from_planes(&d_image, camera.size_px);
        let DrawnView { image, lists, splats, footprints } = &drawing;
        let d_splats = rasterise::backward(self.level, splats, footprints, lists, image, &d_tiled);
        d_splats.iter().map(|d| d.colour[0]).collect()
    }
}
