//! The state of a run as bytes, whole: a run that goes on from a checkpoint ends in the same bits as one that never
//! stopped.
//!
//! | what | how |
//! |---|---|
//! | magic | 8 bytes |
//! | version | u32, little-endian, as the checksum |
//! | configuration | TOML: [`crate::train::TrainConfig`], or that of explicit Gaussians |
//! | kernels, capture, state | [`Kernels`], [`CaptureSignature`], then everything that the next iteration depends on |
//! | checksum | CRC-32 of all before it |
//!
//! Configuration and state are in the wire format of `postcard`.

pub(crate) mod envelope;
mod kernels;
mod signature;

pub use kernels::Kernels;
pub use signature::{CaptureDifference, CaptureSignature};

/// The version that is written and read.
pub const VERSION: u32 = 11;

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
    /// The configuration is none, or the state does not have the form of one.
    #[error("its {what} cannot be read: {why}")]
    Form {
        /// Configuration or state.
        what: &'static str,
        /// What the parser says.
        why: String,
    },
}
