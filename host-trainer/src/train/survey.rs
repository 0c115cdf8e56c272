//! What the training views show of every anchor once training is over: which offsets are drawn, and how much an anchor
//! counts.

use super::step::Workspace;
use crate::ops::Pinhole;
use crate::scene::{MASK_THRESHOLD, Scene};

/// Where masks are switched off: sigmoid is 1e-5.
const MASKED: f32 = -11.5;
const _: () = assert!((MASKED as f64) < MASK_THRESHOLD);

/// One pass over some views.
#[derive(Clone, Debug, PartialEq)]
pub struct Survey {
    /// `[n, K]` whether the Gaussian of an offset reaches the image in any of the views.
    pub drawn: Vec<bool>,
    /// `[n]` aggregated opacity: the mean over the views of the summed opacities of the anchor's Gaussians that reach the
    /// image; a view that does not show the anchor counts as 0.
    pub importance: Vec<f32>,
}

impl Survey {
    /// Draws every view once.
    pub fn new(scene: &Scene<f32>, workspace: &mut Workspace<f32>, cameras: &[&Pinhole<f32>]) -> Self {
        let (n, k) = (scene.anchors.len(), scene.shape.n_offsets);
        let mut survey = Self { drawn: vec![false; n * k], importance: vec![0.0; n] };
        for camera in cameras {
            workspace.image(scene, camera, [0.0; 3]);
            for block in workspace.blocks() {
                for i in block.drawn.iter().map(|i| *i as usize) {
                    let source = block.sources[i];
                    let anchor = block.anchors[source.row as usize] as usize;
                    survey.drawn[anchor * k + source.offset as usize] = true;
                    survey.importance[anchor] += block.gaussians[i].opacity;
                }
            }
        }
        for sum in &mut survey.importance {
            *sum /= cameras.len().max(1) as f32;
        }
        survey
    }

    /// Switches off the masks of offsets that no view draws: they would cost bits and show nothing.
    ///
    /// * returns how many were on.
    pub fn mask_undrawn(&self, scene: &mut Scene<f32>) -> usize {
        let mut n_masked = 0;
        for offset in 0..self.drawn.len() {
            if !self.drawn[offset] && scene.anchors.is_drawn(offset) {
                scene.anchors.mask_logits[offset] = MASKED;
                n_masked += 1;
            }
        }
        n_masked
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
        let mut scene = trainer.scene.clone();
        let mut workspace = Workspace::new(&scene.shape);
        let cameras: Vec<&Pinhole<f32>> = trainer.cameras().iter().collect();
        let survey = Survey::new(&scene, &mut workspace, &cameras);
        let before: Vec<Vec<f32>> = cameras.iter().map(|c| workspace.image(&scene, c, [0.0; 3])).collect();
        let n_masked = survey.mask_undrawn(&mut scene);
        assert!(n_masked > 0 && n_masked == survey.drawn.iter().filter(|drawn| !**drawn).count());
        for (camera, before) in cameras.iter().zip(before) {
            assert!(workspace.image(&scene, camera, [0.0; 3]) == before);
        }
        assert_eq!(Survey::new(&scene, &mut workspace, &cameras), survey);
        for (a, importance) in survey.importance.iter().enumerate() {
            assert_eq!(*importance > 0.0, scene.anchors.has_drawn(a), "anchor {a}");
        }
        assert_eq!(survey.mask_undrawn(&mut scene), 0, "once is enough");
    }
}
