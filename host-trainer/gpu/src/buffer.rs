//! Arrays in the device's memory.

use std::any::type_name;
use std::fmt;
use std::marker::PhantomData;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use bytemuck::Pod;

use super::gpu::State;
use super::{Gpu, GpuError};

/// An array of `T` in the device's memory.
pub struct Buffer<T> {
    raw: wgpu::Buffer,
    what: &'static str,
    len: usize,
    state: Arc<State>,
    of: PhantomData<T>,
}

/// What a kernel can be given.
pub trait Bind {
    /// The memory.
    fn raw(&self) -> &wgpu::Buffer;
}

impl<T> Bind for Buffer<T> {
    fn raw(&self) -> &wgpu::Buffer {
        &self.raw
    }
}

impl<T: Pod> Buffer<T> {
    /// Room for `len` values, all bits zero.
    ///
    /// * `what`: what errors call it, in the plural.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`]; that memory ran out, [`Gpu::check`] says later.
    pub fn zeros(gpu: &Gpu, what: &'static str, len: usize) -> Result<Self, GpuError> {
        const { assert!(size_of::<T>().is_multiple_of(4), "copies are of whole words") };
        // Nothing of length 0 can be bound; kernels are told lengths by their parameters.
        let bytes = (len.max(1) * size_of::<T>()) as u64;
        if bytes > gpu.max_buffer_bytes {
            return Err(GpuError::TooLarge { what, bytes, limit: gpu.max_buffer_bytes });
        }
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        gpu.state.bytes.fetch_add(bytes, Ordering::Relaxed);
        let raw = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(what),
            size: bytes,
            usage,
            mapped_at_creation: false,
        });
        Ok(Self { raw, what, len, state: gpu.state.clone(), of: PhantomData })
    }

    /// A copy of `values`.
    ///
    /// # Errors
    /// As [`Self::zeros`].
    pub fn upload(gpu: &Gpu, what: &'static str, values: &[T]) -> Result<Self, GpuError> {
        let buffer = Self::zeros(gpu, what, values.len())?;
        gpu.queue.write_buffer(&buffer.raw, 0, bytemuck::cast_slice(values));
        Ok(buffer)
    }

    /// Makes it `values`; grows where it must.
    ///
    /// # Errors
    /// As [`Self::zeros`].
    pub fn write(&mut self, gpu: &Gpu, values: &[T]) -> Result<(), GpuError> {
        self.fit(gpu, values.len())?;
        gpu.queue.write_buffer(&self.raw, 0, bytemuck::cast_slice(values));
        Ok(())
    }

    /// Makes room for `len` values, whose contents are left open.
    ///
    /// # Errors
    /// As [`Self::zeros`].
    pub fn fit(&mut self, gpu: &Gpu, len: usize) -> Result<(), GpuError> {
        let room = self.raw.size() / size_of::<T>() as u64;
        if len as u64 > room {
            // A quarter more, so that a scene that grows does not move in every step.
            let most = gpu.max_buffer_bytes as usize / size_of::<T>();
            *self = Self::zeros(gpu, self.what, (len + len / 4).min(most).max(len))?;
        }
        self.len = len;
        Ok(())
    }

    /// Number of values.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Copies the values to the host; waits until all commands before are done.
    ///
    /// # Errors
    /// As [`Gpu::check`].
    pub fn read(&self, gpu: &Gpu) -> Result<Vec<T>, GpuError> {
        self.ask(gpu).take(gpu)
    }

    /// Asks for the values as the commands before leave them; does not wait.
    pub fn ask(&self, gpu: &Gpu) -> Asked<T> {
        if self.len == 0 {
            return Asked { staging: None, of: PhantomData };
        }
        let size = (self.len * size_of::<T>()) as u64;
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let staging = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(self.what),
            size,
            usage,
            mapped_at_creation: false,
        });
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(&self.raw, 0, &staging, 0, size);
        gpu.queue.submit([encoder.finish()]);
        staging.map_async(wgpu::MapMode::Read, .., |_| ());
        Asked { staging: Some(staging), of: PhantomData }
    }
}

/// Values on their way to the host.
pub struct Asked<T> {
    /// None where there are none.
    staging: Option<wgpu::Buffer>,
    of: PhantomData<T>,
}

impl<T: Pod> Asked<T> {
    /// The values; waits until all commands submitted so far are done.
    ///
    /// # Errors
    /// As [`Gpu::check`].
    pub fn take(self, gpu: &Gpu) -> Result<Vec<T>, GpuError> {
        gpu.wait()?;
        let Some(staging) = self.staging else { return Ok(Vec::new()) };
        let mapped = staging.get_mapped_range(..).map_err(|error| GpuError::Refused { reason: error.to_string() })?;
        // The mapping has no alignment to rely on.
        Ok(mapped.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect())
    }
}

impl<T> Drop for Buffer<T> {
    fn drop(&mut self) {
        self.state.bytes.fetch_sub(self.raw.size(), Ordering::Relaxed);
    }
}

impl<T> fmt::Debug for Buffer<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Buffer<{}>({}, {} values)", type_name::<T>(), self.what, self.len)
    }
}
