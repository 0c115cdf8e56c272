//! A scene in the device's memory, with all that training moves and keeps of it.

use super::context::DeviceContext;
use super::group::Group;
use super::ops::adam::Adam;
use super::ops::heads::head::{HeadLayout, parameters_of};
use super::ops::image::prefilter::Shown;
use super::ops::image::statistics::Sums;
use super::ops::rate::perturb;
use super::{Buffer, Commands, Gpu, GpuError};
use pocketsplat_kernels::ops::adam;
use pocketsplat_kernels::scene::{Head, ModelShape};
use pocketsplat_kernels::step::{GroupSteps, Trained, TrainedMut};

/// Places of the arrays of anchors in [`DeviceScene::anchors`].
pub(super) const FEATURES: usize = 0;
pub(super) const LOG_SCALES: usize = 1;
pub(super) const OFFSETS: usize = 2;
pub(super) const MASK_LOGITS: usize = 3;

/// A head, its moments and its gradient.
#[derive(Debug)]
pub(super) struct DeviceHead {
    pub(super) layout: HeadLayout,
    pub(super) parameters: Group,
    pub(super) gradient: Buffer<f32>,
    /// What a step on integers draws with.
    pub(super) written: Buffer<f32>,
}

impl DeviceHead {
    /// The parameters that a step draws with: the trained ones, or as they will be written.
    pub(super) fn drawn(&self, on_integers: bool) -> &Buffer<f32> {
        if on_integers { &self.written } else { &self.parameters.values }
    }

    fn upload(gpu: &Gpu, head: &Head<f32>, moments: [&Head<f32>; 2]) -> Result<Self, GpuError> {
        let [first, second] = moments.map(parameters_of);
        let moments = adam::Moments { first, second };
        Ok(Self {
            layout: HeadLayout::of(head),
            parameters: Group::upload(gpu, "weights of the heads", &parameters_of(head), &moments)?,
            gradient: Buffer::zeros(gpu, "gradients of the heads", head.n_params())?,
            written: Buffer::zeros(gpu, "heads as written", head.n_params())?,
        })
    }

    fn store(&self, gpu: &Gpu, head: &mut Head<f32>, moments: [&mut Head<f32>; 2]) -> Result<(), GpuError> {
        let (mut weights, mut found) = (Vec::new(), adam::Moments::default());
        self.parameters.store(gpu, &mut weights, &mut found)?;
        let [first, second] = moments;
        for (head, values) in [(head, &weights), (first, &found.first), (second, &found.second)] {
            let mut rest = values.as_slice();
            for group in head.groups_mut() {
                let (own, after) = rest.split_at(group.len());
                group.copy_from_slice(own);
                rest = after;
            }
        }
        Ok(())
    }
}

/// The scene.
#[derive(Debug)]
pub(super) struct DeviceScene {
    pub(super) shape: ModelShape,
    /// `[n, 3]`, world frame.
    pub(super) positions: Buffer<f32>,
    /// `[n]`; 1 where nothing has ranked the anchors.
    prune_rank: Buffer<f32>,
    /// `[n]`; 1 where nothing has counted.
    pub(super) view_weights: Buffer<f32>,
    /// Features, log-scales, offsets, mask logits; `[n, width]`.
    pub(super) anchors: [Group; 4],
    /// In file order.
    pub(super) heads: Vec<DeviceHead>,
    /// A grid and its network, where the scene has them.
    pub(super) context: Option<DeviceContext>,
    /// Whether the last step was on the integers of the context model and with the heads as written.
    pub(super) on_integers: bool,
    opacity_sums: Buffer<f32>,
    n_views: Buffer<u32>,
    gradient_sums: Buffer<f32>,
    n_drawn: Buffer<u32>,
}

impl DeviceScene {
    /// Copies everything to the device.
    pub(super) fn upload(gpu: &Gpu, trained: &Trained<'_, f32>) -> Result<Self, GpuError> {
        let Trained { scene, moments, heads, context, sums, counts } = trained;
        let (anchors, n) = (&scene.anchors, scene.anchors.len());
        let positions: Vec<f32> = (0..n).flat_map(|a| scene.position(a)).collect();
        let or_one = |values: &[f32]| if values.is_empty() { vec![1.0; n] } else { values.to_vec() };
        let [features, log_scales, offsets, mask_logits] = moments;
        let moments_of_heads = heads[0].each().zip(heads[1].each());
        let of_heads = scene.heads.each().zip(moments_of_heads);
        Ok(Self {
            shape: scene.shape,
            positions: Buffer::upload(gpu, "positions", &positions)?,
            prune_rank: Buffer::upload(gpu, "ranks", &or_one(&anchors.prune_rank))?,
            view_weights: Buffer::upload(gpu, "view weights", &or_one(&anchors.view_weights))?,
            anchors: [
                Group::upload(gpu, "features", &anchors.features, features)?,
                Group::upload(gpu, "log-scales", &anchors.log_scales, log_scales)?,
                Group::upload(gpu, "offsets", &anchors.offsets, offsets)?,
                Group::upload(gpu, "mask logits", &anchors.mask_logits, mask_logits)?,
            ],
            heads: of_heads
                .map(|(head, (first, second))| DeviceHead::upload(gpu, head, [first, second]))
                .collect::<Result<_, _>>()?,
            context: match context {
                Some(moments) => DeviceContext::upload(gpu, scene, moments)?,
                None => None,
            },
            on_integers: false,
            opacity_sums: Buffer::upload(gpu, "sums of opacities", sums[0])?,
            gradient_sums: Buffer::upload(gpu, "sums of gradients", sums[1])?,
            n_views: Buffer::upload(gpu, "numbers of views", counts[0])?,
            n_drawn: Buffer::upload(gpu, "numbers of drawings", counts[1])?,
        })
    }

    /// Copies everything back.
    pub(super) fn store(&self, gpu: &Gpu, trained: TrainedMut<'_, f32>) -> Result<(), GpuError> {
        let TrainedMut { scene, moments, heads, context, sums, counts } = trained;
        let anchors = &mut scene.anchors;
        let values = [&mut anchors.features, &mut anchors.log_scales, &mut anchors.offsets, &mut anchors.mask_logits];
        for (group, (values, moments)) in self.anchors.iter().zip(values.into_iter().zip(moments)) {
            group.store(gpu, values, moments)?;
        }
        let [first, second] = heads;
        let of_heads = scene.heads.each_mut().zip(first.each_mut().zip(second.each_mut()));
        for (own, (head, (first, second))) in self.heads.iter().zip(of_heads) {
            own.store(gpu, head, [first, second])?;
        }
        if let (Some(own), Some(moments)) = (&self.context, context) {
            own.store(gpu, scene, moments)?;
        }
        let [opacities, gradients] = sums;
        (*opacities, *gradients) = (self.opacity_sums.read(gpu)?, self.gradient_sums.read(gpu)?);
        let [n_views, n_drawn] = counts;
        (*n_views, *n_drawn) = (self.n_views.read(gpu)?, self.n_drawn.read(gpu)?);
        Ok(())
    }

    /// Values of an anchor in each of its arrays.
    pub(super) fn widths(&self) -> [usize; 4] {
        let k = self.shape.n_offsets;
        [self.shape.feature_dim, self.shape.n_log_scales(), 3 * k, k]
    }

    /// Which values are features, log-scales, offsets.
    pub(super) fn coded_groups(&self) -> [perturb::Group; 3] {
        let [features, log_scales, offsets, _] = self.widths();
        [
            perturb::Group { index: 0, first: 0, width: features },
            perturb::Group { index: 1, first: features, width: log_scales },
            perturb::Group { index: 2, first: features + log_scales, width: offsets },
        ]
    }

    /// What of the anchors the prefilter looks at.
    pub(super) fn shown(&self) -> Shown<'_> {
        Shown {
            positions: &self.positions,
            log_scales: &self.anchors[LOG_SCALES].values,
            offsets: &self.anchors[OFFSETS].values,
            mask_logits: &self.anchors[MASK_LOGITS].values,
            prune_rank: &self.prune_rank,
        }
    }

    /// What growth and pruning will look at.
    pub(super) fn sums(&self) -> Sums<'_> {
        Sums {
            opacities: &self.opacity_sums,
            n_views: &self.n_views,
            gradients: &self.gradient_sums,
            n_drawn: &self.n_drawn,
        }
    }

    /// Moves every group.
    ///
    /// * `row_of_anchor`: where each anchor stands in `gradients`, `[n_visible, width]` each.
    pub(super) fn move_by(
        &self,
        adam: &Adam,
        commands: &mut Commands<'_>,
        steps: &GroupSteps<f32>,
        row_of_anchor: &Buffer<u32>,
        gradients: &[Buffer<f32>; 4],
    ) {
        for (group, (step, gradient)) in self.anchors.iter().zip(steps.anchors.iter().zip(gradients)) {
            if let Some(step) = step {
                adam.update_rows(commands, *step, &group.values, &group.moments, row_of_anchor, gradient);
            }
        }
        for (head, step) in self.heads.iter().zip(&steps.heads) {
            head.parameters.move_by(adam, commands, *step, &head.gradient);
        }
        if let (Some(context), Some(steps)) = (&self.context, steps.context) {
            context.move_by(adam, commands, steps);
        }
    }
}
