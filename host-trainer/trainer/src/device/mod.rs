//! Budget in, model out: the scene that a device affords, chosen before anything is trained.
//!
//! [`choose`] goes by what scenes take on average; training measures what the
//! scene [takes](crate::train::limits::LimitProbe) and steers by it; [`Encoding::encode`](crate::encode::Encoding::encode) then leaves out
//! the least important anchors until the bundle keeps the limits, so that these hold whatever was trained.

mod choice;
mod width;

pub use choice::{BindingLimit, Infeasible, ModelChoice, choose};
pub use width::{bytes_of_heads, widest_within};

use serde::{Deserialize, Serialize};

use pocketsplat_instructions::Processor;
use pocketsplat_instructions::level::{Bound, Level};

/// What a device has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Limits {
    /// Scratch memory of the decoder, bytes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ram_bytes: Option<u64>,
    /// Flash for the bundle, bytes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flash_bytes: Option<u64>,
    /// Processor, whose frames of limited length the model is chosen and trained for; at most half of the anchors are cut for them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub processor: Option<Processor>,
    /// Number of the [level](Level) whose every bound the whole scene keeps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub level: Option<u8>,
}

impl Limits {
    /// What a device of a level has. Frames of the largest level are meant for processors of many kinds.
    pub fn of_level(level: &Level) -> Self {
        let processor = match level.number {
            ..=3 => Some(Processor::CortexM4),
            4 => Some(Processor::CortexM7),
            _ => None,
        };
        Self {
            ram_bytes: Some(level.most(Bound::Scratch)),
            flash_bytes: Some(level.most(Bound::Flash)),
            processor,
            level: Some(level.number),
        }
    }

    /// Whether there is any.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
}
