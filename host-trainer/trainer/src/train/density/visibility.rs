//! What the training views show of every anchor: which offsets are drawn, and how much an anchor
//! counts.

use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::scene::Scene;
use pocketsplat_kernels::step::Workspace;

/// One pass over some views.
#[derive(Clone, Debug, PartialEq)]
pub struct Visibility {
    /// `[n, K]` whether the Gaussian of an offset reaches the image in any of the views.
    pub drawn: Vec<bool>,
    /// `[n]` aggregated opacity: the mean over the views of the summed opacities of the anchor's Gaussians that reach the
    /// image; a view that does not show the anchor counts as 0.
    pub opacity: Vec<f32>,
    /// `[n]` share of the views that show the anchor: in which it passes the prefilter.
    pub shown: Vec<f32>,
    /// `[n]` Σ of α·T over the pixels of all views and the anchor's Gaussians, where asked for; else empty.
    pub contribution: Vec<f32>,
}

impl Visibility {
    /// Draws every view once; with `contributions` also backwards, which takes three times as long.
    pub fn new(
        scene: &Scene<f32>,
        workspace: &mut Workspace<f32>,
        cameras: &[&Pinhole<f32>],
        contributions: bool,
    ) -> Self {
        let (n, k) = (scene.anchors.len(), scene.shape.n_offsets);
        let contribution = vec![0.0; if contributions { n } else { 0 }];
        let mut visibility =
            Self { drawn: vec![false; n * k], opacity: vec![0.0; n], shown: vec![0.0; n], contribution };
        for camera in cameras {
            if contributions {
                visibility.add_contributions(scene, workspace, camera);
            } else {
                workspace.image(scene, camera, [0.0; 3]);
            }
            for block in workspace.blocks() {
                for anchor in &block.anchors {
                    visibility.shown[*anchor as usize] += 1.0;
                }
                for i in block.drawn.iter().map(|i| *i as usize) {
                    let source = block.sources[i];
                    let anchor = block.anchors[source.row as usize] as usize;
                    visibility.drawn[anchor * k + source.offset as usize] = true;
                    visibility.opacity[anchor] += block.gaussians[i].opacity;
                }
            }
        }
        for sum in visibility.opacity.iter_mut().chain(&mut visibility.shown) {
            *sum /= cameras.len().max(1) as f32;
        }
        visibility
    }

    /// `[n]` the mean of the summed opacities over the views that show the anchor; 0 where none does.
    pub fn opacity_per_view(&self) -> Vec<f32> {
        let pairs = self.opacity.iter().zip(&self.shown);
        pairs.map(|(sum, shown)| if *shown > 0.0 { sum / shown } else { 0.0 }).collect()
    }

    fn add_contributions(&mut self, scene: &Scene<f32>, workspace: &mut Workspace<f32>, camera: &Pinhole<f32>) {
        let weights = workspace.contributions(scene, camera);
        let drawn = workspace.blocks().iter().flat_map(|block| block.drawn.iter().map(move |i| (block, *i as usize)));
        for ((block, i), weight) in drawn.zip(weights) {
            self.contribution[block.anchors[block.sources[i].row as usize] as usize] += weight;
        }
    }

    /// Switches off the masks of offsets that no view draws: they would cost bits and show nothing.
    ///
    /// * returns how many were on.
    pub fn mask_undrawn(&self, scene: &mut Scene<f32>) -> usize {
        let undrawn = (0..self.drawn.len()).filter(|offset| !self.drawn[*offset] && scene.anchors.is_drawn(*offset));
        let undrawn: Vec<usize> = undrawn.collect();
        scene.anchors.mask(&undrawn);
        undrawn.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::Trainer;
    use crate::train::test_capture::{tiny_capture, tiny_config};

    #[test]
    fn masking_what_no_view_draws_changes_no_view() {
        let capture = tiny_capture();
        let mut trainer = Trainer::new(&capture, tiny_config(30)).unwrap();
        for _ in 0..30 {
            trainer.advance().unwrap();
        }
        let mut scene = trainer.state.learned.scene.clone();
        // The first offset of every anchor.
        scene.heads.opacity.b2[0] = -100.0;
        let mut workspace = Workspace::new(&scene.shape);
        let cameras: Vec<&Pinhole<f32>> = trainer.cameras().iter().collect();
        let visibility = Visibility::new(&scene, &mut workspace, &cameras, false);
        let before: Vec<Vec<f32>> = cameras.iter().map(|c| workspace.image(&scene, c, [0.0; 3])).collect();
        let n_masked = visibility.mask_undrawn(&mut scene);
        assert!(n_masked > 0 && n_masked == visibility.drawn.iter().filter(|drawn| !**drawn).count());
        for (camera, before) in cameras.iter().zip(before) {
            assert!(workspace.image(&scene, camera, [0.0; 3]) == before);
        }
        assert_eq!(Visibility::new(&scene, &mut workspace, &cameras, false), visibility);
        for (a, opacity) in visibility.opacity.iter().enumerate() {
            assert_eq!(*opacity > 0.0, scene.anchors.has_drawn(a), "anchor {a}");
        }
        assert_eq!(visibility.mask_undrawn(&mut scene), 0, "once is enough");
    }
}
