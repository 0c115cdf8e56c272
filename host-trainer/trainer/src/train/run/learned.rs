//! What training on anchors changes: the scene and what belongs to it.

use pocketsplat_format::context::N_LEVELS;
use serde::{Deserialize, Serialize};

use super::checkpoint::CheckpointFault;
use super::checkpoint::envelope::needs;
use crate::train::TrainConfig;
use crate::train::config::Backbone;
use crate::train::density::Statistics;
use crate::train::exposures::Exposures;
use crate::train::optimiser::Optimiser;
use crate::train::poses::Poses;
use pocketsplat_kernels::scene::{Anchors, Heads, Scene};

/// The scene and what belongs to it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Learned {
    /// The scene as it stands; on a device, as it stood when it was fetched last.
    #[serde(with = "without_shape")]
    pub scene: Scene<f32>,
    /// Its moments.
    pub optimiser: Optimiser<f32>,
    /// What growth and pruning know.
    pub statistics: Statistics,
    /// What lies behind the scene.
    pub background: [f32; 3],
    /// How each training view was exposed.
    pub exposures: Exposures,
    /// How far each training camera was moved.
    pub poses: Poses,
    /// λ: weight of a value's bits in the loss, as configured until [a scene that has to fit](crate::train::limits) asks for another.
    pub lambda: f64,
}

impl Learned {
    /// Takes from the configuration what a checkpoint leaves to it, and checks that lengths agree.
    pub(super) fn complete(
        &mut self,
        config: &TrainConfig,
        voxel_size: f64,
        n_views: usize,
    ) -> Result<(), CheckpointFault> {
        (self.scene.shape, self.scene.voxel_size) = (config.shape, voxel_size);
        let (shape, scene) = (config.shape, &self.scene);
        let Anchors { features, log_scales, offsets, mask_logits, prune_rank, view_weights, .. } = &scene.anchors;
        let n = scene.anchors.len();
        for (what, of_anchors) in [("number of prune ranks", prune_rank), ("number of view weights", view_weights)] {
            if !of_anchors.is_empty() {
                needs(what, of_anchors.len(), n)?;
            }
        }
        let Optimiser { features: f, log_scales: s, offsets: o, mask_logits: m, background, .. } = &self.optimiser;
        for (what, values, moments, width) in [
            ("features", features, f, shape.feature_dim),
            ("log-scales", log_scales, s, shape.n_log_scales()),
            ("offsets", offsets, o, 3 * shape.n_offsets),
            ("mask logits", mask_logits, m, shape.n_offsets),
        ] {
            for values in [values, &moments.first, &moments.second] {
                needs(what, values.len(), n * width)?;
            }
        }
        needs("exposures", self.exposures.len(), n_views)?;
        needs("poses", self.poses.len(), n_views)?;
        needs("background", background.first.len(), 3)?;
        let lens =
            |heads: &Heads<f32>| heads.each().flat_map(|head| head.groups().map(<[f32]>::len)).collect::<Vec<_>>();
        let needed = lens(&Heads::filled(&shape, 0.0));
        for heads in [&scene.heads, &self.optimiser.heads[0], &self.optimiser.heads[1]] {
            for (found, needed) in
                lens(heads).into_iter().chain([usize::MAX]).zip(needed.iter().copied().chain([usize::MAX]))
            {
                needs("heads", found, needed)?;
            }
        }
        if let (Some(model), moments) = (&scene.context, &self.optimiser.context) {
            let moments = moments.as_ref().map_or(0, |moments| moments.rows.first.len());
            needs("moments of the grid", moments, model.rows.len())?;
            let (n_taps, n_networks) =
                (model.networks.first().map_or(0, |network| network.n_taps), model.networks.len());
            needs("taps of the context model", n_taps, config.backbone.n_taps(shape.feature_dim))?;
            let n_levels = if config.backbone == Backbone::ContextGs { N_LEVELS } else { 1 };
            needs("networks of the context model", n_networks, n_levels)?;
        }
        let Statistics { opacity_sum, n_views, gradient_sum, n_drawn } = &self.statistics;
        needs("opacity sums", opacity_sum.len(), n)?;
        needs("view counts", n_views.len(), n)?;
        needs("gradient sums", gradient_sum.len(), n * shape.n_offsets)?;
        needs("drawn counts", n_drawn.len(), n * shape.n_offsets)
    }
}

/// A scene whose shape and voxel size the configuration knows.
mod without_shape {
    use pocketsplat_kernels::scene::{ModelShape, Scene};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(super) fn serialize<S: Serializer>(scene: &Scene<f32>, serializer: S) -> Result<S::Ok, S::Error> {
        (&scene.anchors, &scene.heads, &scene.context).serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Scene<f32>, D::Error> {
        let (anchors, heads, context) = Deserialize::deserialize(deserializer)?;
        Ok(Scene { shape: ModelShape::plain(0, 0), voxel_size: 0.0, anchors, heads, context })
    }
}
