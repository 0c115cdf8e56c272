//! From Gaussians to the splats that a pass draws.

use core::marker::PhantomData;

use pocketsplat_format::bundle::Effects;

use super::FrameReport;
use super::first_come::splat_order;
use super::overflow::OverflowPolicy;
use super::splats::{Slab, SplatStore};
use super::strip::{Strip, StripLayout};
use crate::bake::BakedGaussian;
use crate::functions::Functions;
use crate::project::{Band, TileRect, View};
use crate::scene::{Gaussian, GaussianSink};

/// What a pass draws.
pub(super) struct Target {
    pub(super) strip: Strip,
    pub(super) slab: Slab,
    /// What the pass can leave out; nothing when it goes over the whole scene.
    pub(super) band: Option<Band>,
    /// Whether it makes the index of where splats lie.
    pub(super) makes_index: bool,
}

impl Target {
    /// Also leaves out what lies beyond the slab.
    pub(super) fn end_earlier(&mut self, view: &View) {
        if self.makes_index {
            return;
        }
        let band = self.band.unwrap_or(Band::WHOLE);
        self.band = Some(band.between_depths(view, self.slab.from, self.slab.end));
    }
}

/// Keeps the splats of anchors.
pub(super) struct GaussianCollector<'f, 's, F> {
    pub(super) splats: SplatCollector<'f, 's>,
    pub(super) report: &'f mut FrameReport,
    pub(super) effects: Effects,
    /// Whether Gaussians are rounded as baked ones are.
    pub(super) as_baked: bool,
    pub(super) functions: PhantomData<F>,
}

impl<F: Functions> GaussianSink for GaussianCollector<'_, '_, F> {
    fn gaussian(&mut self, anchor: u32, offset: usize, gaussian: &Gaussian) {
        self.report.gaussians = self.report.gaussians.saturating_add(1);
        let order = splat_order(anchor, offset);
        // The first half drops the code where no scene is such.
        if cfg!(feature = "baked") && self.as_baked {
            self.splats.project::<F>(order, &BakedGaussian::rounded(gaussian, self.effects), self.effects);
        } else {
            self.splats.project::<F>(order, gaussian, self.effects);
        }
    }

    fn head_macs(&mut self, n: u64) {
        self.report.head_macs = self.report.head_macs.saturating_add(n);
    }
}

/// Projects Gaussians and keeps the splats that a pass draws.
pub(super) struct SplatCollector<'f, 's> {
    pub(super) view: &'f View,
    pub(super) strips: &'f StripLayout,
    pub(super) policy: &'f mut OverflowPolicy,
    pub(super) target: &'f mut Target,
    pub(super) splats: &'f mut SplatStore<'s>,
    pub(super) chunk: u32,
}

impl SplatCollector<'_, '_> {
    /// * `order`: ascends in the order of the file.
    pub(super) fn project<F: Functions>(&mut self, order: u32, gaussian: &Gaussian, effects: Effects) {
        let Some((mut splat, rect)) = self.view.project::<F>(gaussian, effects) else { return };
        let touched = self.strips.touched(rect);
        let index = self.target.strip.index;
        let lies_here = *touched.end() >= index.into() && *touched.start() < self.target.strip.end_index.into();
        let drawn = match self.policy {
            OverflowPolicy::Fits => true,
            OverflowPolicy::FirstCome { first_come, strips_of_chunks } if index == 0 => {
                strips_of_chunks.add(self.chunk, touched.clone());
                first_come.admit(order, touched)
            }
            OverflowPolicy::FirstCome { first_come, .. } => first_come.admits(order),
            OverflowPolicy::Slabs { .. } => {
                // No slab ends behind an infinite depth.
                if splat.depth > f32::MAX {
                    splat.depth = f32::MAX;
                }
                if self.target.makes_index {
                    self.splats.add_to_index(self.chunk, splat.depth, touched);
                }
                if lies_here {
                    let end = self.target.slab.end;
                    self.splats.push_into(&mut self.target.slab, &splat, rect);
                    if self.target.slab.end < end {
                        self.target.end_earlier(self.view);
                    }
                }
                return;
            }
        };
        if drawn && lies_here && self.make_room(rect) {
            self.splats.push(&splat, rect);
        }
    }

    /// Ends the pass above as many strips as it takes to have a place; returns whether a splat of `rect` lies in it then.
    #[inline(always)]
    fn make_room(&mut self, rect: TileRect) -> bool {
        while self.splats.n >= self.splats.places() {
            let Strip { index, end_index, .. } = self.target.strip;
            // A strip by itself has places enough.
            if end_index <= index + 1 {
                return true;
            }
            self.target.strip = self.strips.between(index, end_index - 1);
            self.splats.end_above(self.target.strip.end_row);
        }
        u16::from(rect.first_row) < self.target.strip.end_row
    }
}
