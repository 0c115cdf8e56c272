//! Programs that run on the device, and lists of them.

use bytemuck::Pod;

use super::{Bind, GROUP_THREADS, Gpu, GpuError};

/// A compiled program.
#[derive(Clone, Debug)]
pub struct Kernel {
    name: &'static str,
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
}

impl Kernel {
    /// Compiles the only entry point of a WGSL program.
    ///
    /// * `sources`: one after the other they are the program. Its buffers are `@group(0) @binding(0)` and up in the order in which
    ///   [`Commands::run`] is given them, its parameters are `var<immediate>`.
    pub fn new(gpu: &Gpu, name: &'static str, sources: &[&str]) -> Self {
        let source = wgpu::ShaderSource::Wgsl(sources.concat().into());
        let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(name), source });
        let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(name),
            layout: None,
            module: &module,
            entry_point: None,
            // Kernels write shared memory before they read it.
            compilation_options: wgpu::PipelineCompilationOptions {
                zero_initialize_workgroup_memory: false,
                ..wgpu::PipelineCompilationOptions::default()
            },
            cache: None,
        });
        let layout = pipeline.get_bind_group_layout(0);
        Self { name, pipeline, layout }
    }
}

/// Kernels to run one after the other, each with what those before it wrote.
pub struct Commands<'g> {
    gpu: &'g Gpu,
    encoder: wgpu::CommandEncoder,
    pass: Option<wgpu::ComputePass<'static>>,
}

/// Workgroups along one axis that every adapter takes; `groups.wgsl` has the same.
const MAX_GROUPS: usize = 65_535;

impl<'g> Commands<'g> {
    /// An empty list.
    pub fn new(gpu: &'g Gpu) -> Self {
        let encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        Self { gpu, encoder, pass: None }
    }

    /// Runs a kernel with one thread for each of `n_items`, [`GROUP_THREADS`] in a workgroup.
    pub fn run_items<P: Pod>(&mut self, kernel: &Kernel, parameters: &P, buffers: &[&dyn Bind], n_items: usize) {
        self.run(kernel, parameters, buffers, n_items.div_ceil(GROUP_THREADS));
    }

    /// Runs a kernel in `n_groups` workgroups; the last may follow by some that have nothing to do, where `n_groups` is more than one axis
    /// takes.
    pub fn run<P: Pod>(&mut self, kernel: &Kernel, parameters: &P, buffers: &[&dyn Bind], n_groups: usize) {
        if n_groups == 0 {
            return;
        }
        let entries: Vec<_> = (0u32..)
            .zip(buffers)
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.raw().as_entire_binding() })
            .collect();
        let bound = self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(kernel.name),
            layout: &kernel.layout,
            entries: &entries,
        });
        let encoder = &mut self.encoder;
        let pass = self.pass.get_or_insert_with(|| {
            encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default()).forget_lifetime()
        });
        pass.set_pipeline(&kernel.pipeline);
        pass.set_bind_group(0, &bound, &[]);
        pass.set_immediates(0, bytemuck::bytes_of(parameters));
        let across = n_groups.min(MAX_GROUPS);
        pass.dispatch_workgroups(across as u32, n_groups.div_ceil(across) as u32, 1);
    }

    /// Makes all bits of a buffer zero.
    pub fn clear(&mut self, buffer: &dyn Bind) {
        self.pass = None;
        self.encoder.clear_buffer(buffer.raw(), 0, None);
    }

    /// Hands the list to the device; does not wait for it.
    ///
    /// # Errors
    /// As [`Gpu::check`].
    pub fn submit(mut self) -> Result<(), GpuError> {
        self.pass = None;
        self.gpu.queue.submit([self.encoder.finish()]);
        self.gpu.check()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parity::gpu;
    use crate::{Buffer, GROUPS};

    const COUNT: &str = "
        @group(0) @binding(0) var<storage, read_write> counts: array<atomic<u32>>;
        var<immediate> n_groups: u32;

        @compute @workgroup_size(1)
        fn count(@builtin(workgroup_id) group: vec3<u32>) {
            let i = group_of(group);
            if i < n_groups {
                atomicAdd(&counts[i], 1u);
            }
        }
    ";

    #[test]
    fn each_workgroup_has_a_number_of_its_own() {
        let Some(gpu) = gpu() else { return };
        let kernel = Kernel::new(gpu, "numbers of workgroups", &[GROUPS, COUNT]);
        for n_groups in [1, MAX_GROUPS, MAX_GROUPS + 1, 2 * MAX_GROUPS + 3] {
            let counts = Buffer::<u32>::zeros(gpu, "counts", n_groups).expect("room");
            let mut commands = Commands::new(gpu);
            commands.run(&kernel, &(n_groups as u32), &[&counts], n_groups);
            commands.submit().expect("runs");
            assert!(counts.read(gpu).expect("runs").iter().all(|count| *count == 1), "{n_groups} workgroups");
        }
    }
}
