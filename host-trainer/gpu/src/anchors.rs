//! The stages of a step between the anchors and their splats, on a GPU: the order of `step/block.rs`.

use bytemuck::Pod;

use super::ops::heads::detail::Detail;
use super::ops::heads::head::Head;
use super::ops::heads::head_input::HeadInput;
use super::ops::heads::neural_gaussians::{HeadOutputs, NeuralGaussians, ViewAnchors};
use super::ops::image::prefilter::Prefilter;
use super::ops::image::project::Project;
use super::ops::primitives::gather::Gather;
use super::scene::{DeviceScene, FEATURES, LOG_SCALES, MASK_LOGITS, OFFSETS};
use super::{Buffer, Commands, Gpu, GpuError};
use pocketsplat_kernels::ops::Pinhole;
use pocketsplat_kernels::ops::heads::neural_gaussians::Gaussian;
use pocketsplat_kernels::ops::image::project::{Footprint, Splat};

/// Heads that every scene has.
const N_HEADS: usize = 3;

/// Its kernels, and the anchors of the last view.
#[derive(Debug)]
pub(super) struct GpuAnchors {
    prefilter: Prefilter,
    gather: Gather,
    head_input: HeadInput,
    head: Head,
    neural_gaussians: NeuralGaussians,
    detail: Detail,
    project: Project,
    positions: Buffer<f32>,
    /// Features, log-scales, offsets, mask logits, as coding leaves them, and their gradients; `[n, width]`.
    pub(super) values: [Buffer<f32>; 4],
    pub(super) gradients: [Buffer<f32>; 4],
    input: Buffer<f32>,
    d_input: Buffer<f32>,
    hidden: [Buffer<f32>; N_HEADS],
    d_hidden: Buffer<f32>,
    /// Opacity, covariance, colour.
    outputs: [Buffer<f32>; N_HEADS],
    d_outputs: [Buffer<f32>; N_HEADS],
    /// Slots; the gradients are for terms on Gaussians to add to.
    pub(super) gaussians: Buffer<Gaussian<f32>>,
    pub(super) d_gaussians: Buffer<Gaussian<f32>>,
}

/// Room for one value each.
pub(super) fn rooms<T: Pod, const N: usize>(gpu: &Gpu, what: &'static str) -> Result<[Buffer<T>; N], GpuError> {
    let all: Vec<_> = (0..N).map(|_| Buffer::zeros(gpu, what, 1)).collect::<Result<_, _>>()?;
    Ok(all.try_into().expect("N of them"))
}

impl GpuAnchors {
    /// Compiles all kernels.
    pub(super) fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let room = |what| Buffer::zeros(gpu, what, 1);
        Ok(Self {
            prefilter: Prefilter::new(gpu)?,
            gather: Gather::new(gpu),
            head_input: HeadInput::new(gpu),
            head: Head::new(gpu)?,
            neural_gaussians: NeuralGaussians::new(gpu),
            detail: Detail::new(gpu)?,
            project: Project::new(gpu),
            positions: room("positions of the view")?,
            values: rooms(gpu, "values of the view")?,
            gradients: rooms(gpu, "gradients of the view's values")?,
            input: room("inputs of the heads")?,
            d_input: room("gradients of the heads' inputs")?,
            hidden: rooms(gpu, "hidden units of the heads")?,
            d_hidden: room("gradients of the heads' hidden units")?,
            outputs: rooms(gpu, "outputs of the heads")?,
            d_outputs: rooms(gpu, "gradients of the heads' outputs")?,
            gaussians: Buffer::zeros(gpu, "Gaussians", 1)?,
            d_gaussians: Buffer::zeros(gpu, "gradients of Gaussians", 1)?,
        })
    }

    /// The anchors of the view, ascending.
    pub(super) fn visible(&self) -> &Buffer<u32> {
        &self.prefilter.visible.items
    }

    /// Where each anchor stands among them.
    pub(super) fn row_of_anchor(&self) -> &Buffer<u32> {
        &self.prefilter.visible.row_of_item
    }

    /// Finds the anchors that the view may show and copies their rows; waits. Returns their number.
    ///
    /// * `pruned_share`: anchors of a lower rank are left out.
    pub(super) fn look(
        &mut self,
        gpu: &Gpu,
        scene: &DeviceScene,
        camera: &Pinhole<f32>,
        pruned_share: f32,
    ) -> Result<usize, GpuError> {
        let n = self.prefilter.run(gpu, Commands::new(gpu), camera, &scene.shape, scene.shown(), pruned_share)?;
        self.fit(gpu, scene, n)?;
        let mut commands = Commands::new(gpu);
        self.gather.run(&mut commands, &scene.positions, 3, self.visible(), &self.positions);
        for (group, (rows, width)) in scene.anchors.iter().zip(self.values.iter().zip(scene.widths())) {
            self.gather.run(&mut commands, &group.values, width, self.visible(), rows);
        }
        commands.submit()?;
        Ok(n)
    }

    fn fit(&mut self, gpu: &Gpu, scene: &DeviceScene, n: usize) -> Result<(), GpuError> {
        let (shape, widths) = (&scene.shape, scene.widths());
        self.positions.fit(gpu, 3 * n)?;
        for (width, buffers) in widths.iter().zip(self.values.iter_mut().zip(&mut self.gradients)) {
            buffers.0.fit(gpu, n * width)?;
            buffers.1.fit(gpu, n * width)?;
        }
        self.input.fit(gpu, n * shape.head_inputs())?;
        self.d_input.fit(gpu, n * shape.head_inputs())?;
        let widest = scene.heads.iter().take(N_HEADS).map(|head| head.layout.n_hidden).max().unwrap_or_default();
        self.d_hidden.fit(gpu, n * widest)?;
        let outputs = self.outputs.iter_mut().zip(&mut self.d_outputs);
        for (head, (hidden, (output, d_output))) in scene.heads.iter().zip(self.hidden.iter_mut().zip(outputs)) {
            hidden.fit(gpu, n * head.layout.n_hidden)?;
            output.fit(gpu, n * head.layout.n_out)?;
            d_output.fit(gpu, n * head.layout.n_out)?;
        }
        self.gaussians.fit(gpu, n * shape.n_offsets)?;
        self.d_gaussians.fit(gpu, n * shape.n_offsets)
    }

    /// From the values to splats.
    pub(super) fn forward(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        scene: &DeviceScene,
        camera: &Pinhole<f32>,
        splats: &Buffer<Splat<f32>>,
        footprints: &Buffer<Footprint<f32>>,
    ) -> Result<(), GpuError> {
        let shape = &scene.shape;
        self.head_input.forward(commands, shape, camera, &self.values[FEATURES], &self.positions, &self.input);
        let outputs = self.hidden.iter().zip(&self.outputs);
        for (head, (hidden, output)) in scene.heads.iter().zip(outputs) {
            self.head.forward(commands, &head.layout, head.drawn(scene.on_integers), &self.input, hidden, output);
        }
        self.neural_gaussians.forward(
            commands,
            shape,
            &self.positions,
            view_anchors(&self.values),
            head_outputs(&self.outputs),
            &self.gaussians,
        );
        if let Some(head) = scene.heads.get(N_HEADS) {
            let weights = head.drawn(scene.on_integers);
            self.detail.forward(gpu, commands, &head.layout, weights, &self.values[FEATURES], &self.gaussians)?;
        }
        self.project.forward(commands, camera, shape.dilation_compensation, &self.gaussians, splats, footprints);
        Ok(())
    }

    /// Adds the gradients of splats to those of their Gaussians.
    pub(super) fn splats_backward(
        &self,
        commands: &mut Commands<'_>,
        scene: &DeviceScene,
        camera: &Pinhole<f32>,
        footprints: &Buffer<Footprint<f32>>,
        d_splats: &Buffer<Splat<f32>>,
    ) {
        let compensated = scene.shape.dilation_compensation;
        let (gaussians, d_gaussians) = (&self.gaussians, &self.d_gaussians);
        self.project.backward(commands, camera, compensated, gaussians, footprints, d_splats, d_gaussians);
    }

    /// From the gradients of the Gaussians to those of the values and of the heads.
    pub(super) fn backward(
        &mut self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        scene: &DeviceScene,
    ) -> Result<(), GpuError> {
        for head in &scene.heads {
            commands.clear(&head.gradient);
        }
        commands.clear(&self.d_input);
        commands.clear(&self.gradients[FEATURES]);
        if let Some(head) = scene.heads.get(N_HEADS) {
            self.detail.backward(
                gpu,
                commands,
                &head.layout,
                head.drawn(scene.on_integers),
                &self.gaussians,
                &self.d_gaussians,
                &self.gradients[FEATURES],
                &head.gradient,
            )?;
        }
        self.neural_gaussians.backward(
            commands,
            &scene.shape,
            view_anchors(&self.values),
            head_outputs(&self.outputs),
            &self.gaussians,
            &self.d_gaussians,
            head_outputs(&self.d_outputs),
            view_anchors(&self.gradients),
        );
        for (head, (hidden, d_output)) in scene.heads.iter().zip(self.hidden.iter().zip(&self.d_outputs)) {
            self.head.backward(
                gpu,
                commands,
                &head.layout,
                head.drawn(scene.on_integers),
                &self.input,
                hidden,
                d_output,
                &self.d_hidden,
                &self.d_input,
                &head.gradient,
            )?;
        }
        self.head_input.backward(commands, &scene.shape, &self.d_input, &self.gradients[FEATURES]);
        Ok(())
    }
}

fn view_anchors(arrays: &[Buffer<f32>; 4]) -> ViewAnchors<'_> {
    ViewAnchors { log_scales: &arrays[LOG_SCALES], offsets: &arrays[OFFSETS], mask_logits: &arrays[MASK_LOGITS] }
}

fn head_outputs(arrays: &[Buffer<f32>; N_HEADS]) -> HeadOutputs<'_> {
    let [opacity, covariance, colour] = arrays;
    HeadOutputs { opacity, covariance, colour }
}
