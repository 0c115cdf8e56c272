//! From limits to a number of bytes.

use super::arena::{Arena, words_for};
use crate::bundle::{Bundle, saturate};
use crate::error::{DecodeError, Field};
use crate::mlp;
use crate::project::Splat;
use crate::raster::{N_RADIX, TILE_PIXELS, TileRect};

/// Largest width and height of a frame, pixels: a tile's column and row fit a byte.
pub const MAX_FRAME_PX: u16 = 255 * 16;

/// How many splats a frame may hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MaxSplats {
    /// Every offset of every anchor of the tiers drawn: always enough.
    Worst,
    /// So many; a view that holds more fails with [`DecodeError::TooManySplats`], which names the number.
    AtMost(u32),
}

/// The limits a caller sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Budget {
    /// Widest frame, pixels, 1..=[`MAX_FRAME_PX`].
    pub width_px: u16,
    /// Highest frame, pixels, 1..=[`MAX_FRAME_PX`].
    pub height_px: u16,
    /// Splats of a frame.
    pub max_splats: MaxSplats,
    /// Tiers to draw at most; [`u8::MAX`] draws all that the file holds. Fewer are a coarser scene that costs less.
    pub tiers: u8,
}

/// What a decoder of one bundle needs within a [`Budget`]; made by [`Bundle::plan`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Plan {
    budget: Budget,
    n_tiers: u8,
    max_splats: u32,
    scratch_len: usize,
}

impl Plan {
    /// Bytes of scratch memory, whatever their alignment.
    #[must_use]
    pub fn scratch_len(&self) -> usize {
        self.scratch_len
    }

    /// Tiers that are drawn.
    #[must_use]
    pub fn n_tiers(&self) -> u8 {
        self.n_tiers
    }

    /// Splats of a frame at most.
    #[must_use]
    pub fn max_splats(&self) -> u32 {
        self.max_splats
    }

    /// The limits it was made for.
    #[must_use]
    pub fn budget(&self) -> &Budget {
        &self.budget
    }
}

impl Bundle<'_> {
    /// Computes the scratch memory that drawing this bundle within `budget` takes.
    ///
    /// The frame's size has no influence, because tiles leave one by one; a splat takes 52 bytes.
    ///
    /// # Errors
    /// [`DecodeError::OutOfRange`] for an empty or too large frame, [`DecodeError::PlanTooLarge`] beyond the address
    /// space.
    pub fn plan(&self, budget: &Budget) -> Result<Plan, DecodeError> {
        for (field, size_px) in [(Field::FrameWidth, budget.width_px), (Field::FrameHeight, budget.height_px)] {
            if size_px == 0 || size_px > MAX_FRAME_PX {
                let limit = if size_px == 0 { 1 } else { MAX_FRAME_PX.into() };
                return Err(DecodeError::OutOfRange { field, found: size_px.into(), limit });
            }
        }
        let n_tiers = budget.tiers.min(self.n_tiers());
        // At most 2²⁴ anchors of 32 offsets.
        let worst = self.up_to_tier(n_tiers).n_anchors.saturating_mul(self.header().n_offsets.into());
        let max_splats = match budget.max_splats {
            MaxSplats::Worst => worst,
            MaxSplats::AtMost(most) => most.min(worst),
        };
        let scratch_len = self
            .scratch_words(max_splats as usize)
            .and_then(Arena::bytes_for)
            .filter(|&len| len < isize::MAX as usize && saturate(len) < u32::MAX)
            .ok_or(DecodeError::PlanTooLarge { max_splats })?;
        Ok(Plan { budget: *budget, n_tiers, max_splats, scratch_len })
    }

    /// The sum over the slices that `Decoder::bind` takes, in its order.
    fn scratch_words(&self, n_splats: usize) -> Option<usize> {
        let parts = [
            words_for::<f32>(mlp::n_weights(self.header()))?,
            self.anchor_scratch_words(),
            words_for::<f32>(self.header().n_channels())?,
            words_for::<f32>(self.header().head_inputs())?,
            words_for::<f32>(mlp::hidden_len(self.header()))?,
            words_for::<f32>(mlp::sums_len(self.header()))?,
            words_for::<u32>(N_RADIX)?,
            words_for::<[f32; 4]>(TILE_PIXELS)?,
            words_for::<[u8; 3]>(TILE_PIXELS)?,
            words_for::<Splat>(n_splats)?,
            words_for::<TileRect>(n_splats)?,
            words_for::<u32>(n_splats)?,
            words_for::<u32>(n_splats)?,
        ];
        parts.into_iter().try_fold(0_usize, usize::checked_add)
    }
}
