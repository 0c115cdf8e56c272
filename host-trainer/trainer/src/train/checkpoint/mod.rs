//! The state of a run as bytes, whole: a run that goes on from a checkpoint ends in the same bits as one that never
//! stopped.
//!
//! Format, numbers in the byte order of the machine (another order shows as an unknown version):
//!
//! | what | how |
//! |---|---|
//! | magic | 8 bytes |
//! | version | u32 |
//! | configuration | text, TOML: [`crate::train::TrainConfig`] |
//! | kernels | text and u32: [`Kernels`] |
//! | capture | [`CaptureSignature`] |
//! | state | counters, random state, view queue, scene, moments, context model, statistics |
//! | checksum | CRC-32 of all before it |
//!
//! Texts and arrays are a u64 count and their elements.

mod codec;
mod context;
mod kernels;
mod signature;
mod state;

#[cfg(test)]
mod tests;

pub use kernels::Kernels;
pub use signature::{CaptureDifference, CaptureSignature};
pub use state::{RestoreError, Restored};

/// The version that is written and read.
pub const VERSION: u32 = 3;

/// Like PNG's: a byte that is no text, and line ends that a transfer as text would change.
const MAGIC: [u8; 8] = *b"\x8bPSRUN\r\n";

/// What is wrong with the bytes of a checkpoint.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointFault {
    /// Other first bytes.
    #[error("it does not begin as a checkpoint does")]
    Magic,
    /// A version that this program does not read.
    #[error(
        "it has format version {found}, this program reads version {VERSION}; resume with the program that wrote it"
    )]
    Version {
        /// The version.
        found: u32,
    },
    /// The bytes are not those that were written.
    #[error("its content has checksum {computed:08x}, it was written with {found:08x}: it is damaged or cut off")]
    Checksum {
        /// At the end of the file.
        found: u32,
        /// Of the bytes before.
        computed: u32,
    },
    /// A number contradicts another.
    #[error("{what}: found {found}, needed {needed}")]
    Content {
        /// Which number.
        what: &'static str,
        /// Its value.
        found: u64,
        /// What the rest of the checkpoint asks for.
        needed: u64,
    },
    /// A text is not UTF-8, or the configuration is none.
    #[error("its {what} can not be read: {why}")]
    Text {
        /// Which text.
        what: &'static str,
        /// What the parser says.
        why: String,
    },
}
