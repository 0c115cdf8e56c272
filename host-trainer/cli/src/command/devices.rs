//! `pocketsplat devices`: what training can run on.

use std::fmt;
use std::str::FromStr;

use anyhow::Result;
use pocketsplat_kernels::step::SharedDevice;
use serde::Serialize;

use super::output;
use crate::config::heading::RUN;
#[cfg(feature = "gpu")]
use crate::say::say;

/// List the GPUs that training can run on.
///
/// With their limits, by the names that --device takes.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

/// One adapter, as it is printed.
#[derive(Serialize)]
struct Device {
    /// The N of `--device gpu:N`.
    index: usize,
    name: String,
    kind: String,
    backend: String,
    driver: String,
    max_buffer_bytes: u64,
    workgroup_bytes: u64,
    /// What keeps it from training.
    lack: Option<String>,
}

#[derive(Serialize)]
struct Devices {
    /// Threads of the CPU that training takes.
    cpu_threads: usize,
    devices: Vec<Device>,
}

pub(crate) fn run(args: &Args) -> Result<()> {
    let found = Devices { cpu_threads: rayon::current_num_threads(), devices: devices() };
    output::print_or(&found, args.json, &found)
}

/// What `--device` asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DeviceChoice {
    /// A GPU where there is one.
    Auto,
    Cpu,
    /// A GPU: of this number, or the best.
    Gpu(Option<usize>),
}

/// The option of every command that trains.
#[derive(clap::Args, Clone, Copy)]
pub(crate) struct DeviceOption {
    /// What trains: cpu, gpu, gpu:N as `pocketsplat devices` lists them, or auto, a GPU where there is one
    /// [default: cpu]
    #[arg(long = "device", value_name = "NAME", default_value = "cpu", hide_default_value = true, help_heading = RUN,
        hide_short_help = true)]
    pub(crate) trains_on: DeviceChoice,
}

impl FromStr for DeviceChoice {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let of_number = || name.strip_prefix("gpu:").and_then(|n| n.parse().ok());
        match name {
            "auto" => Ok(Self::Auto),
            "cpu" => Ok(Self::Cpu),
            "gpu" => Ok(Self::Gpu(None)),
            _ => of_number()
                .map(|n| Self::Gpu(Some(n)))
                .ok_or_else(|| "it is auto, cpu, gpu or gpu:N, N from 0".to_owned()),
        }
    }
}

impl fmt::Display for DeviceChoice {
    /// As it is asked for.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Cpu => f.write_str("cpu"),
            Self::Gpu(None) => f.write_str("gpu"),
            Self::Gpu(Some(index)) => write!(f, "gpu:{index}"),
        }
    }
}

impl DeviceChoice {
    /// Opens the GPU that is asked for, or found, and says on stderr which; none where the CPU is to do it.
    pub(crate) fn open(self) -> Result<Option<SharedDevice<f32>>> {
        self.opened(true)
    }

    /// The same without a word.
    pub(crate) fn open_silently(self) -> Result<Option<SharedDevice<f32>>> {
        self.opened(false)
    }

    #[cfg(feature = "gpu")]
    fn opened(self, says: bool) -> Result<Option<SharedDevice<f32>>> {
        use pocketsplat_gpu::{AdapterKind, Gpu, GpuStep, choose};
        use std::sync::{Arc, Mutex};

        let adapter = match self {
            Self::Cpu => return Ok(None),
            // A driver on the CPU is slower than the CPU.
            Self::Auto => {
                choose(None).ok().filter(|found| found.kind != AdapterKind::Software && found.lack().is_none())
            }
            Self::Gpu(index) => Some(choose(index)?),
        };
        if says {
            match &adapter {
                Some(adapter) => say!("device: {} ({}, {})", adapter.name, adapter.kind, adapter.backend),
                None => say!("device: cpu, since no GPU was found"),
            }
        }
        let Some(adapter) = adapter else { return Ok(None) };
        Ok(Some(Arc::new(Mutex::new(GpuStep::new(&Gpu::open(&adapter)?)?))))
    }

    #[cfg(not(feature = "gpu"))]
    fn opened(self, _says: bool) -> Result<Option<SharedDevice<f32>>> {
        match self {
            Self::Cpu | Self::Auto => Ok(None),
            Self::Gpu(_) => anyhow::bail!(
                "this program was built without GPUs; install it with `cargo install --path host-trainer/cli`, or use --device cpu"
            ),
        }
    }
}

/// The numbers of the GPUs that training can run on.
pub(crate) fn usable() -> Vec<usize> {
    devices().iter().filter(|device| device.lack.is_none()).map(|device| device.index).collect()
}

#[cfg(feature = "gpu")]
fn devices() -> Vec<Device> {
    let device = |(index, adapter): (usize, pocketsplat_gpu::Adapter)| Device {
        index,
        lack: adapter.lack().map(|(what, found, needed)| format!("{found} {what}, {needed} needed")),
        kind: adapter.kind.to_string(),
        name: adapter.name,
        backend: adapter.backend,
        driver: adapter.driver,
        max_buffer_bytes: adapter.max_buffer_bytes,
        workgroup_bytes: adapter.workgroup_bytes,
    };
    pocketsplat_gpu::adapters().into_iter().enumerate().map(device).collect()
}

#[cfg(not(feature = "gpu"))]
fn devices() -> Vec<Device> {
    Vec::new()
}

impl std::fmt::Display for Devices {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "cpu     {} threads", self.cpu_threads)?;
        for d in &self.devices {
            let mebibytes = d.max_buffer_bytes >> 20;
            write!(
                f,
                "gpu:{:<3} {} ({}, {}, {}); buffers of up to {mebibytes} MiB",
                d.index, d.name, d.kind, d.backend, d.driver
            )?;
            writeln!(f, ", {} KiB of shared memory", d.workgroup_bytes >> 10)?;
            if let Some(lack) = &d.lack {
                writeln!(f, "        not for training: {lack}")?;
            }
        }
        if !cfg!(feature = "gpu") {
            writeln!(f, "no GPU: this program was built without the cargo feature `gpu`")
        } else if self.devices.is_empty() {
            writeln!(f, "no GPU: no driver of Vulkan, Metal or Direct3D 12 offers an adapter")
        } else {
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn devices_are_chosen_by_name() {
        let parse = |name: &str| name.parse::<DeviceChoice>();
        assert_eq!(parse("auto"), Ok(DeviceChoice::Auto));
        assert_eq!(parse("cpu"), Ok(DeviceChoice::Cpu));
        assert_eq!(parse("gpu"), Ok(DeviceChoice::Gpu(None)));
        assert_eq!(parse("gpu:3"), Ok(DeviceChoice::Gpu(Some(3))));
        for wrong in ["", "cuda", "gpu:", "gpu:-1", "gpu:x", "gpu0"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}
