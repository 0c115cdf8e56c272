//! An opened device.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use super::{Adapter, GROUP_THREADS, GpuError, MAX_BINDINGS, MAX_PARAMETER_BYTES};

/// A device that runs kernels, and its queue of commands.
#[derive(Clone, Debug)]
pub struct Gpu {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    pub(super) state: Arc<State>,
    /// The largest buffer that a kernel reads, bytes.
    pub max_buffer_bytes: u64,
    /// What the driver calls the adapter.
    pub name: String,
}

/// What the driver's callbacks and all buffers of a device write to.
#[derive(Debug, Default)]
pub(super) struct State {
    /// The first thing that went wrong; what comes after follows from it.
    fault: Mutex<Option<Fault>>,
    /// Bytes of all buffers that live.
    pub(super) bytes: AtomicU64,
}

#[derive(Clone, Debug)]
enum Fault {
    Memory,
    Lost(String),
    Refused(String),
}

impl State {
    fn record(&self, fault: Fault) {
        let mut first = self.fault.lock().unwrap_or_else(PoisonError::into_inner);
        // Commands to a lost device are refused, which may be heard of first.
        if first.is_none() || matches!(fault, Fault::Lost(_)) {
            *first = Some(fault);
        }
    }
}

impl Gpu {
    /// Gives the device up as if it were lost: whatever is asked of it afterwards fails.
    pub fn destroy(&self) {
        self.device.destroy();
    }

    /// Opens an adapter.
    ///
    /// # Errors
    /// [`GpuError::TooWeak`] and [`GpuError::NotOpened`].
    pub fn open(adapter: &Adapter) -> Result<Self, GpuError> {
        if let Some((what, found, needed)) = adapter.lack() {
            return Err(GpuError::TooWeak { adapter: adapter.name.clone(), what, found, needed });
        }
        let offered = adapter.raw.limits();
        let required_limits = wgpu::Limits {
            max_buffer_size: offered.max_buffer_size,
            max_storage_buffer_binding_size: offered.max_storage_buffer_binding_size,
            max_storage_buffers_per_shader_stage: MAX_BINDINGS as u32,
            max_compute_invocations_per_workgroup: GROUP_THREADS as u32,
            max_compute_workgroup_size_x: GROUP_THREADS as u32,
            max_immediate_size: MAX_PARAMETER_BYTES as u32,
            ..wgpu::Limits::downlevel_defaults()
        };
        let descriptor = wgpu::DeviceDescriptor {
            required_features: wgpu::Features::IMMEDIATES,
            required_limits,
            ..wgpu::DeviceDescriptor::default()
        };
        let (device, queue) = pollster::block_on(adapter.raw.request_device(&descriptor))
            .map_err(|error| GpuError::NotOpened { adapter: adapter.name.clone(), reason: error.to_string() })?;
        let state = Arc::<State>::default();
        let recorder = state.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            recorder.record(match error {
                wgpu::Error::OutOfMemory { .. } => Fault::Memory,
                error => Fault::Refused(error.to_string()),
            });
        }));
        let recorder = state.clone();
        device.set_device_lost_callback(move |_, reason| recorder.record(Fault::Lost(reason)));
        Ok(Self { device, queue, state, max_buffer_bytes: adapter.max_buffer_bytes, name: adapter.name.clone() })
    }

    /// Whether everything that was asked so far went well, as far as the driver has said yet.
    ///
    /// # Errors
    /// [`GpuError::OutOfMemory`], [`GpuError::Lost`], [`GpuError::Refused`]: the first that occurred.
    pub fn check(&self) -> Result<(), GpuError> {
        match self.state.fault.lock().unwrap_or_else(PoisonError::into_inner).clone() {
            None => Ok(()),
            Some(Fault::Memory) => Err(GpuError::OutOfMemory { bytes: self.bytes_in_use() }),
            Some(Fault::Lost(reason)) => Err(GpuError::Lost { reason }),
            Some(Fault::Refused(reason)) => Err(GpuError::Refused { reason }),
        }
    }

    /// Waits until everything that was submitted is done.
    ///
    /// # Errors
    /// As [`Self::check`].
    pub fn wait(&self) -> Result<(), GpuError> {
        let waited = self.device.poll(wgpu::PollType::wait_indefinitely());
        self.check()?;
        waited.map(|_| ()).map_err(|error| GpuError::Lost { reason: error.to_string() })
    }

    /// Bytes of all buffers that live.
    pub fn bytes_in_use(&self) -> u64 {
        self.state.bytes.load(Ordering::Relaxed)
    }
}
