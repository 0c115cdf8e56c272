//! A run that begins where another one stood, with other settings.

use super::checkpoint::CaptureSignature;
use super::save::{RestoreError, Restored};
use super::trainer::{Neural, Trainer};
use crate::train::{TrainConfig, TrainError};
use pocketsplat_capture::dataset::Capture;
use pocketsplat_kernels::scene::{ModelShape, QuantisationSteps};

impl<'a> Trainer<'a> {
    /// As [`Self::restore`], and goes on as `config` says: the scene, the moments and the rest of the pass over the views are the
    /// checkpoint's; random numbers follow from the seed of `config`. The
    /// photographs may have another size.
    ///
    /// # Errors
    /// As [`Self::restore`]; [`RestoreError::Fork`] when `config` asks for another model, lattice or split of the views, or, once
    /// there is a context model, for another one.
    pub fn fork(capture: &'a Capture, bytes: &[u8], config: TrainConfig) -> Result<Restored<'a, Neural>, RestoreError> {
        let mut restored = Self::read(capture, bytes, CaptureSignature::matches_at_any_size)?;
        config.validate().map_err(TrainError::from)?;
        let (begun, config) = (restored.run.setup.config, config.resolved_for(capture));
        let has_context = restored.run.state.learned.scene.context.is_some();
        let [kept, asked] = [&begun, &config].map(|config| {
            let of_context = has_context.then(|| kept_with_the_context(config));
            kept_by_a_fork(config).into_iter().chain(of_context.into_iter().flatten())
        });
        for ((key, kept), (_, asked)) in kept.zip(asked) {
            if kept != asked {
                return Err(RestoreError::Fork { key, kept, asked });
            }
        }
        if config.hac.lambda != begun.hac.lambda {
            restored.run.state.learned.lambda = config.hac.lambda;
        }
        if config.exposure != begun.exposure {
            restored.run.state.learned.exposures.reopen();
        }
        if begun.refine_poses && !config.refine_poses {
            restored.run.leave_poses();
        }
        restored.run.setup.config = config;
        restored.run.check()?;
        Ok(restored)
    }
}

/// What a fork must keep of its run: keys within `train`, each with its value. Both runs are resolved, so ε is known.
fn kept_by_a_fork(config: &TrainConfig) -> [(&'static str, String); 11] {
    let ModelShape {
        feature_dim,
        n_offsets,
        view_colour,
        view_geometry,
        view_distance,
        dilation_compensation,
        anisotropic,
        colour_hidden,
        detail_hidden,
    } = config.shape;
    [
        ("shape.feature_dim", feature_dim.to_string()),
        ("shape.n_offsets", n_offsets.to_string()),
        ("shape.view_colour", view_colour.to_string()),
        ("shape.view_geometry", view_geometry.to_string()),
        ("shape.view_distance", view_distance.to_string()),
        ("shape.dilation_compensation", dilation_compensation.to_string()),
        ("shape.anisotropic", anisotropic.to_string()),
        ("shape.colour_hidden", colour_hidden.to_string()),
        ("shape.detail_hidden", detail_hidden.to_string()),
        ("voxel_size", config.voxel_size.map(|edge| edge.to_string()).unwrap_or_default()),
        ("validation_every", config.validation_every.to_string()),
    ]
}

/// What it must keep besides where its run has a context model.
fn kept_with_the_context(config: &TrainConfig) -> [(&'static str, String); 4] {
    let QuantisationSteps { feature, log_scale, offset } = config.hac.base_steps;
    [
        ("backbone", toml::Value::try_from(config.backbone).map(|name| name.to_string()).unwrap_or_default()),
        ("hac.base_steps.feature", feature.to_string()),
        ("hac.base_steps.log_scale", log_scale.to_string()),
        ("hac.base_steps.offset", offset.to_string()),
    ]
}
