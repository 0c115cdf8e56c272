//! The adapters of this machine.

use super::GpuError;

/// An adapter: a GPU as one driver offers it, or a driver that computes on the CPU.
#[derive(Clone, Debug)]
pub struct Adapter {
    pub(super) raw: wgpu::Adapter,
    /// What the driver calls it.
    pub name: String,
    /// The interface to the driver: `vulkan`, `metal` or `dx12`.
    pub backend: String,
    /// The driver and its version, as it gives them.
    pub driver: String,
    /// What kind of device it is.
    pub kind: AdapterKind,
    /// The largest buffer that a kernel reads, bytes.
    pub max_buffer_bytes: u64,
    /// The memory that the threads of a workgroup share, bytes.
    pub workgroup_bytes: u64,
    /// Threads of a workgroup.
    pub workgroup_threads: u64,
    /// Buffers of one kernel.
    pub n_bindings: u64,
}

/// Kinds of adapters, the ones to prefer first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum AdapterKind {
    /// A GPU with its own memory.
    Discrete,
    /// A GPU that shares the CPU's memory.
    Integrated,
    /// A GPU of a virtual machine, or one that does not say.
    Other,
    /// A driver that computes on the CPU: for tests, not for speed.
    Software,
}

impl std::fmt::Display for AdapterKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Discrete => "discrete GPU",
            Self::Integrated => "integrated GPU",
            Self::Other => "GPU",
            Self::Software => "software on the CPU",
        })
    }
}

/// The adapters of this machine, in the order in which drivers offer them: the N of `--device gpu:N`.
pub fn adapters() -> Vec<Adapter> {
    let backends = wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12;
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends,
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    pollster::block_on(instance.enumerate_adapters(backends)).into_iter().map(Adapter::new).collect()
}

/// The adapter of a number, or without one the first of the best kind.
///
/// # Errors
/// [`GpuError::NoAdapter`] and [`GpuError::NoSuchAdapter`].
pub fn choose(index: Option<usize>) -> Result<Adapter, GpuError> {
    let mut all = adapters();
    let best = (0..all.len()).min_by_key(|i| (all[*i].kind, *i)).ok_or(GpuError::NoAdapter)?;
    let asked = index.unwrap_or(best);
    if asked >= all.len() {
        return Err(GpuError::NoSuchAdapter { asked, found: all.len() });
    }
    Ok(all.swap_remove(asked))
}

impl Adapter {
    fn new(raw: wgpu::Adapter) -> Self {
        let (info, limits) = (raw.get_info(), raw.limits());
        Self {
            name: info.name,
            backend: info.backend.to_string(),
            driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
            kind: match info.device_type {
                wgpu::DeviceType::DiscreteGpu => AdapterKind::Discrete,
                wgpu::DeviceType::IntegratedGpu => AdapterKind::Integrated,
                wgpu::DeviceType::VirtualGpu | wgpu::DeviceType::Other => AdapterKind::Other,
                wgpu::DeviceType::Cpu => AdapterKind::Software,
            },
            max_buffer_bytes: limits.max_storage_buffer_binding_size.min(limits.max_buffer_size),
            workgroup_bytes: limits.max_compute_workgroup_storage_size.into(),
            workgroup_threads: limits.max_compute_invocations_per_workgroup.into(),
            n_bindings: limits.max_storage_buffers_per_shader_stage.into(),
            raw,
        }
    }

    /// What is too little for the kernels: its name, how much there is, how much there must be.
    pub fn lack(&self) -> Option<(&'static str, u64, u64)> {
        let immediates = if self.raw.features().contains(wgpu::Features::IMMEDIATES) {
            self.raw.limits().max_immediate_size.into()
        } else {
            0
        };
        [
            ("bytes of shared memory in a workgroup", self.workgroup_bytes, 16 << 10),
            ("threads in a workgroup", self.workgroup_threads, super::GROUP_THREADS as u64),
            ("buffers in a kernel", self.n_bindings, super::MAX_BINDINGS as u64),
            ("bytes of parameters in a command", immediates, super::MAX_PARAMETER_BYTES as u64),
        ]
        .into_iter()
        .find(|(_, found, needed)| found < needed)
    }
}
