//! How much an anchor counts where a view shows it: the more, the fewer training views do.

use rayon::prelude::*;

use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::ops::image::prefilter;
use pocketsplat_kernels::scene::Scene;

/// `[n]` mean(p)/p of every anchor, p the share of the views that may show it.
///
/// A file pays for every anchor alike; a view's rate is that of the anchors which it shows. An anchor that a share p of the views
/// shows would pay for its bits in a share p of the steps alone. So it is sampled mean(p)/p times as often where it is shown.
///
/// Cost: the prefilter, for every anchor and view.
pub fn view_weights(scene: &Scene<f32>, cameras: &[&Pinhole<f32>]) -> Vec<f32> {
    let n_views: Vec<f32> = (0..scene.anchors.len())
        .into_par_iter()
        .map(|a| {
            let shown = cameras.iter().filter(|camera| prefilter::shows(scene, a, camera));
            // What no view shows never comes into a sample.
            shown.count().max(1) as f32
        })
        .collect();
    let mean = n_views.iter().sum::<f32>() / n_views.len().max(1) as f32;
    n_views.into_iter().map(|n| mean / n).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::Trainer;
    use crate::train::test_capture::{many_views, tiny_hac_config};

    #[test]
    fn over_all_views_every_anchor_is_sampled_alike() {
        let capture = many_views(7);
        let mut trainer = Trainer::new(&capture, tiny_hac_config(60)).expect("a run");
        trainer.advance().expect("a step");
        trainer.weigh_views();
        assert!(trainer.state.learned.scene.anchors.view_weights.is_empty(), "there is no rate yet");
        while !trainer.is_done() {
            trainer.advance().expect("a step");
        }
        let (scene, n) = (&trainer.state.learned.scene, trainer.state.learned.scene.anchors.len());
        assert_eq!(scene.anchors.view_weights.len(), n, "through growth and pruning");
        // Four units from the middle, where the cameras are at three: it is behind some of them.
        trainer.state.learned.scene.anchors.lattice[0] = [200, 0, 0];
        trainer.weigh_views();
        let (scene, views) = (&trainer.state.learned.scene, &trainer.setup.views.trained);
        let shown = |a: usize| {
            views
                .iter()
                .filter(|view| prefilter::shows(scene, a, &trainer.setup.views.cameras[**view as usize]))
                .count()
        };
        assert!((1..views.len()).contains(&shown(0)), "{} of {} views show it", shown(0), views.len());
        let sums: Vec<f32> = (0..n).map(|a| shown(a).max(1) as f32 * scene.anchors.view_weights[a]).collect();
        for (a, sum) in sums.iter().enumerate() {
            assert!((sum / sums[0] - 1.0).abs() < 1e-5, "anchor {a}: {sum}, anchor 0: {}", sums[0]);
        }
    }
}
