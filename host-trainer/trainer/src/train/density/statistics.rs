//! What growth and pruning know of the anchors: how opaque they were, and how hard the image pulled at their offsets.

use serde::{Deserialize, Serialize};

use crate::train::optimiser::retain_rows;
use pocketsplat_kernels::step::Workspace;

/// Running sums since an anchor, or an offset, was last judged (Lu et al. 2024, Scaffold-GS, section 3.3).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Statistics {
    /// `[n]` Σ over views of Σ_k max(α, 0).
    pub opacity_sum: Vec<f32>,
    /// `[n]` views that saw the anchor.
    pub n_views: Vec<u32>,
    /// `[n, K]` Σ over views of ‖∂L/∂mean‖, units of half the image.
    pub gradient_sum: Vec<f32>,
    /// `[n, K]` views in which the offset reached a pixel. (The published count also takes Gaussians too faint to draw.)
    pub n_drawn: Vec<u32>,
}

impl Statistics {
    /// Nothing known of `n_anchors` anchors.
    pub fn new(n_anchors: usize, n_offsets: usize) -> Self {
        let mut statistics = Self::default();
        statistics.grow(n_anchors, n_offsets);
        statistics
    }

    /// Adds one view.
    pub fn add(&mut self, workspace: &Workspace<f32>, n_offsets: usize) {
        for block in workspace.blocks() {
            for anchor in &block.anchors {
                self.n_views[*anchor as usize] += 1;
            }
            for (gaussian, source) in block.gaussians.iter().zip(&block.sources) {
                self.opacity_sum[block.anchors[source.row as usize] as usize] += gaussian.opacity;
            }
            for (drawn, gradient) in block.drawn.iter().zip(&block.screen_gradients) {
                let source = block.sources[*drawn as usize];
                let at = block.anchors[source.row as usize] as usize * n_offsets + source.offset as usize;
                self.gradient_sum[at] += gradient;
                self.n_drawn[at] += 1;
            }
        }
    }

    /// Makes room for anchors up to `n_anchors` in all.
    pub fn grow(&mut self, n_anchors: usize, n_offsets: usize) {
        self.opacity_sum.resize(n_anchors, 0.0);
        self.n_views.resize(n_anchors, 0);
        self.gradient_sum.resize(n_anchors * n_offsets, 0.0);
        self.n_drawn.resize(n_anchors * n_offsets, 0);
    }

    /// Forgets the anchors that `keep` does not mark.
    pub fn retain(&mut self, keep: &[bool], n_offsets: usize) {
        retain_rows(&mut self.opacity_sum, 1, keep);
        retain_rows(&mut self.n_views, 1, keep);
        retain_rows(&mut self.gradient_sum, n_offsets, keep);
        retain_rows(&mut self.n_drawn, n_offsets, keep);
    }
}
