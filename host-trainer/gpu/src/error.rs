//! What can go wrong with a device.

use thiserror::Error;

/// Why a device does not do what it was asked.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum GpuError {
    /// No driver offers an adapter.
    #[error(
        "no GPU was found: 0 adapters of Vulkan, Metal or Direct3D 12; train with `--device cpu`, or install the GPU's \
         driver (`pocketsplat devices` lists what is found)"
    )]
    NoAdapter,
    /// There are adapters, but not this one.
    #[error("there is no adapter {asked}: {found} were found, numbered from 0; `pocketsplat devices` lists them")]
    NoSuchAdapter {
        /// The number asked for.
        asked: usize,
        /// How many there are.
        found: usize,
    },
    /// The adapter lacks what the kernels need.
    #[error(
        "{adapter} has {found} {what}, and the kernels need {needed}; choose another one with `--device gpu:N`, or `--device cpu`"
    )]
    TooWeak {
        /// Its name.
        adapter: String,
        /// What is too little.
        what: &'static str,
        /// How much there is.
        found: u64,
        /// How much there must be.
        needed: u64,
    },
    /// The driver refused.
    #[error("{adapter} could not be opened: {reason}; choose another one with `--device gpu:N`, or `--device cpu`")]
    NotOpened {
        /// Its name.
        adapter: String,
        /// What the driver says.
        reason: String,
    },
    /// One buffer is larger than the adapter allows.
    #[error(
        "{what} takes {bytes} bytes in one buffer and this adapter allows {limit}; train fewer anchors (`--max-anchors`), \
         smaller images (`--max-resolution`), or with `--device cpu`"
    )]
    TooLarge {
        /// What the buffer holds.
        what: &'static str,
        /// Its size.
        bytes: u64,
        /// The adapter's limit.
        limit: u64,
    },
    /// The device's memory is full.
    #[error(
        "the device ran out of memory when {bytes} bytes were in use; train fewer anchors (`--max-anchors`), smaller images \
         (`--max-resolution`), or with `--device cpu`"
    )]
    OutOfMemory {
        /// Bytes of all buffers, with those that no longer found room.
        bytes: u64,
    },
    /// The driver gave the device up.
    #[error(
        "the device was lost ({reason}); `--resume` goes on from the checkpoint, on the CPU, or with `--device gpu`"
    )]
    Lost {
        /// What the driver says.
        reason: String,
    },
    /// A mistake in this program.
    #[error("the driver refused a command, which is a mistake in this program; please report it: {reason}")]
    Refused {
        /// What the driver says.
        reason: String,
    },
}
