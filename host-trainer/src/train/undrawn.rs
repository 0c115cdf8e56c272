//! Offsets that no training view draws cost bits and show nothing: they are set to zero before the scene is coded.

use super::step::Workspace;
use crate::ops::Pinhole;
use crate::scene::Scene;

/// Sets every offset to 0 whose Gaussian reaches the image in none of the views; returns how many that were.
///
/// The Gaussian itself stays: should a view between the training views make it opaque, it is drawn at its anchor. A zero is
/// the likeliest symbol of its table, so it costs a fraction of the bits. Cost: one forward pass over the views.
pub fn zero_undrawn_offsets(scene: &mut Scene<f32>, workspace: &mut Workspace<f32>, cameras: &[Pinhole<f32>]) -> usize {
    let k = scene.shape.n_offsets;
    let mut drawn = vec![false; scene.anchors.len() * k];
    for camera in cameras {
        workspace.image(scene, camera, [0.0; 3]);
        for block in workspace.blocks() {
            for source in block.drawn.iter().map(|i| block.sources[*i as usize]) {
                drawn[block.anchors[source.row as usize] as usize * k + source.offset as usize] = true;
            }
        }
    }
    let mut n_zeroed = 0;
    for (offset, _) in scene.anchors.offsets.chunks_exact_mut(3).zip(&drawn).filter(|(_, drawn)| !**drawn) {
        offset.fill(0.0);
        n_zeroed += 1;
    }
    n_zeroed
}
