//! `pocketsplat devices`: what training can run on.

use anyhow::Result;
use serde::Serialize;

use super::output;

/// List the GPUs that training can run on, with their limits.
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

#[cfg(feature = "gpu")]
fn devices() -> Vec<Device> {
    let device = |(index, adapter): (usize, pocketsplat_trainer::gpu::Adapter)| Device {
        index,
        lack: adapter.lack().map(|(what, found, needed)| format!("{found} {what}, {needed} needed")),
        kind: adapter.kind.to_string(),
        name: adapter.name,
        backend: adapter.backend,
        driver: adapter.driver,
        max_buffer_bytes: adapter.max_buffer_bytes,
        workgroup_bytes: adapter.workgroup_bytes,
    };
    pocketsplat_trainer::gpu::adapters().into_iter().enumerate().map(device).collect()
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
