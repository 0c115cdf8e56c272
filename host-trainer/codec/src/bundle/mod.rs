//! The writer of bundles: place, quantise, count, code, lay out.
//!
//! Stages in the order data flows through them: `order` → `quantise` → `table` or [the context](pocketsplat_kernels::integer_model) → `chunk` → `layout`;
//! beside them `size` says where the bytes of a bundle went, [`manifest`](crate::manifest) what drawing it takes and [`annotate`] what each
//! byte means. The format is described in `decoder-format/src/bundle/FORMAT.md`; what reads it is [`pocketsplat_core`], and
//! nothing here decides a decoded symbol or value by itself.

pub mod annotate;
mod channel_coder;
mod channels;
mod chunk;
mod decoded;
mod directory;
mod error;
mod frequencies;
mod heads;
mod ink;
mod lattice;
mod layout;
mod load;
mod mask;
mod mean_steps;
mod order;
mod quantise;
mod size;
mod stream;
mod table;
mod write;

#[cfg(test)]
mod tests;

pub use channels::ChannelName;
pub(crate) use channels::ContextWork;
pub use decoded::{decoded_heads, decoded_scene, for_each_chunk, normalisation_of, shape_of};
pub use error::WriteError;
pub use frequencies::frequencies;
pub use layout::{CodedScene, Written};
pub use load::{LoadError, check, load};
pub use mean_steps::mean_steps;
pub use order::check_pruning_rates;
pub use pocketsplat_kernels::ops::rate::file_order::PRUNING_RATES;
pub use quantise::check_steps;
pub use size::{SizePart, SizeReport};
pub use stream::{PartBits, SlotList};
pub use write::{ChannelCoding, WriteOptions, code, write};

use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::Normalisation;
use pocketsplat_format::Bundle;
use pocketsplat_format::bundle::PROTOCOL_CODE;

/// What a bundle says about its capture besides the scene itself.
#[derive(Clone, Debug, PartialEq)]
pub struct BundleInfo {
    /// From the capture's world to the scene's frame.
    pub normalisation: Normalisation,
    /// What lies behind everything.
    pub background: [u8; 3],
    /// Width and height of the training images, pixels.
    pub training_px: [u32; 2],
    /// One of the training views, normalised frame, so that a device can draw something by itself.
    pub preview: Camera,
    /// How the photographs were prepared: the section protocol, of at most [`MAX_PROTOCOL_LEN`] bytes.
    pub protocol: Option<String>,
}

/// Most bytes of the section protocol.
pub const MAX_PROTOCOL_LEN: usize = 200;

/// What the section protocol of a bundle says; `bytes` are the whole file. None where there is none, or none that is text.
pub fn protocol_of<'a>(bundle: &Bundle<'a>, bytes: &'a [u8]) -> Option<&'a str> {
    let section = bundle.sections().find(|section| section.code() == PROTOCOL_CODE)?;
    std::str::from_utf8(bytes.get(section.offset as usize..)?.get(..section.len as usize)?).ok()
}
