//! What a caller wants of a plan, and within what.

use pocketsplat_format::{DecodeError, Field, in_range};

use super::quality::Quality;

/// How many splats there is memory for at once: those of a frame, or with strips those of a strip.
///
/// A view that needs more draws those of the file's first anchors and
/// [reports](crate::FrameReport::splats_dropped) how many it left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum MaxSplats {
    /// As many as the fullest of the views in the bundle's manifest has, and a sixteenth more; if the manifest is not
    /// measured, [`Worst`](Self::Worst). A frame with a wider lens or nearer to the scene may need more. Where memory is left,
    /// strips may [share it](crate::Plan::new).
    Measured,
    /// Every offset of every anchor of the tiers drawn: always enough in the [reference arithmetic](crate::ReferenceArithmetic); of
    /// a scene that can be baked, other heads may draw an offset more.
    Worst,
    /// So many; with [slabs](Overflow::Slabs) at least [`Budget::MIN_SLAB_PLACES`].
    AtMost(u32),
}

/// Where decoded anchors are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Residency {
    /// Least predicted work that fits.
    Auto,
    /// Nowhere: their Gaussians are evaluated once when bound, and are in memory, 32 bytes each. For scenes that
    /// [look the same](crate::Bundle::n_gaussians) from everywhere. Evaluated in the
    /// [reference arithmetic](crate::ReferenceArithmetic), whatever the frame is drawn in.
    Baked,
    /// As [`Auto`](Self::Auto), and if there is room, beside each anchor in memory what no camera changes of its heads' first layers:
    /// `b₁ + W₁·feature`. The pixels of [`Resident`](Self::Resident), and of 50 features about a third of the heads' multiply-adds; for memory of
    /// megabytes, since an anchor takes 672 bytes more then. Of no use to heads in halves or in [integers](crate::WithoutFpu), for which a
    /// plan's [work](crate::Plan::work) is that of `Resident`; `Auto` without the cargo feature `baked`.
    AutoWithSums,
    /// In memory, as integers, decoded once when bound.
    Resident,
    /// In the bundle; each frame decodes those in view again, one at a time.
    Streamed,
}

/// In how many horizontal strips a frame is produced; only one strip's splats are in memory.
///
/// A strip has ⌈tile rows / n⌉ rows of 16×16 tiles, so the last ones of a low frame may be missing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Strips {
    /// Those that take the least predicted work. Of equals one, or else the most of 2, 4 and 8; in [slabs](Overflow::Slabs) the
    /// fewest.
    Auto,
    /// So many, 1..=[`Budget::MAX_STRIPS`], in no more memory than one of them needs.
    Exactly(u8),
}

/// What becomes of the splats of a strip that there is no place for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Overflow {
    /// Those of the file's last anchors are left out, and [reported](crate::FrameReport::splats_dropped): the work of a frame
    /// is bounded.
    LeaveOut,
    /// They are drawn later: a strip is produced from near to far, in as many slabs of depth as it takes, each of which goes
    /// over the anchors again, until nothing more can be seen. The frame is the one that more memory would draw; the pixels of
    /// a whole strip are in memory, 16 bytes each. Only where more splats lie at one depth than there are places for are some left out,
    /// and reported.
    Slabs,
}

/// The limits a caller sets.
///
/// ```
/// use pocketsplat_core::{Budget, MaxSplats, Residency};
///
/// const BUDGET: Budget = Budget::for_frame(160, 120).in_bytes(96 * 1024);
/// let by_hand = BUDGET.with_max_splats(MaxSplats::AtMost(900)).with_residency(Residency::Streamed);
/// assert_eq!((BUDGET.ram_bytes, by_hand.width_px), (98304, 160));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Budget {
    /// Bytes of scratch memory there are; the fast ones, if some are slow.
    pub ram_bytes: usize,
    /// Bytes of slow scratch memory besides; 0 for none. It has to be
    /// [normal memory](crate#memory), which SDRAM may become by the MPU alone.
    pub slow_bytes: usize,
    /// Widest frame, pixels, 1..=[`Self::MAX_FRAME_PX`].
    pub width_px: u16,
    /// Highest frame, pixels, 1..=[`Self::MAX_FRAME_PX`].
    pub height_px: u16,
    /// Tiers to draw at most, 1 or more; [`u8::MAX`] draws all that the file holds. Fewer are a coarser scene that costs less.
    pub tiers: u8,
    /// Splats in memory.
    pub max_splats: MaxSplats,
    /// Where decoded anchors are kept.
    pub residency: Residency,
    /// Horizontal strips of a frame.
    pub strips: Strips,
    /// What becomes of splats that there is no memory for.
    pub overflow: Overflow,
    /// Accuracy.
    pub quality: Quality,
    /// Whether damaged chunks are left out, and each frame that needs some says so in its report; if not, they are errors.
    pub skips_damage: bool,
    /// The most that a frame may take, model instructions; [`u64::MAX`] for no limit.
    pub most_work: u64,
    /// Whether two painters draw a frame, see [`with_two_painters`](Self::with_two_painters).
    pub two_painters: bool,
}

impl Budget {
    /// Largest width and height of a frame, pixels: a tile's column and row fit a byte.
    pub const MAX_FRAME_PX: u16 = 255 * 16;
    /// Most horizontal strips of a frame.
    pub const MAX_STRIPS: u8 = 8;
    /// Fewest places for splats with which a strip can be drawn in [slabs](Overflow::Slabs) of depth.
    pub const MIN_SLAB_PLACES: u32 = 2;

    /// Frames of at most `width_px × height_px`, everything else as good as memory allows, memory without limit.
    #[must_use]
    pub const fn for_frame(width_px: u16, height_px: u16) -> Self {
        Self {
            ram_bytes: usize::MAX,
            slow_bytes: 0,
            width_px,
            height_px,
            tiers: u8::MAX,
            max_splats: MaxSplats::Measured,
            residency: Residency::Auto,
            strips: Strips::Auto,
            overflow: Overflow::LeaveOut,
            quality: Quality::EXACT,
            skips_damage: false,
            most_work: u64::MAX,
            two_painters: false,
        }
    }

    /// Sets the bytes of scratch memory.
    #[must_use]
    pub const fn in_bytes(self, ram_bytes: usize) -> Self {
        Self { ram_bytes, ..self }
    }

    /// Sets the bytes of slow scratch memory, beside the fast ones of [`in_bytes`](Self::in_bytes).
    ///
    /// Have the MPU make it [normal memory](crate#memory) first: a Cortex-M7 faults at the decoder's unaligned accesses in Device memory,
    /// which SDRAM at 0xC0000000 is after reset.
    #[must_use]
    pub const fn with_slow_bytes(self, slow_bytes: usize) -> Self {
        Self { slow_bytes, ..self }
    }

    /// Sets the most tiers to draw, 1 or more.
    #[must_use]
    pub const fn with_tiers(self, tiers: u8) -> Self {
        Self { tiers, ..self }
    }

    /// Sets how many splats there is memory for.
    #[must_use]
    pub const fn with_max_splats(self, max_splats: MaxSplats) -> Self {
        Self { max_splats, ..self }
    }

    /// Sets anchor residency.
    #[must_use]
    pub const fn with_residency(self, residency: Residency) -> Self {
        Self { residency, ..self }
    }

    /// Sets the number of strips.
    #[must_use]
    pub const fn with_strips(self, strips: Strips) -> Self {
        Self { strips, ..self }
    }

    /// Sets the overflow policy.
    #[must_use]
    pub const fn with_overflow(self, overflow: Overflow) -> Self {
        Self { overflow, ..self }
    }

    /// Sets the quality.
    #[must_use]
    pub const fn with_quality(self, quality: Quality) -> Self {
        Self { quality, ..self }
    }

    /// Leaves damaged chunks out, and [reports](crate::FrameReport::chunks_damaged) them in each frame that needs some. Drawn in
    /// [slabs](Overflow::Slabs), a frame still fails for a chunk whose checksum is right and whose stream is not.
    ///
    /// # Budget
    /// Where anchors are streamed, checksums are compared in the frames that need the chunks instead of when bound: about 8 instructions
    /// a byte of those in view.
    #[must_use]
    pub const fn skipping_damage(self) -> Self {
        Self { skips_damage: true, ..self }
    }

    /// Ends a frame that takes more than so many [model instructions](crate::FrameReport::instructions) with
    /// [`DecodeError::TooMuchWork`]: a file may ask for any number of them, whatever its manifest says. A Cortex-M4 executes about as
    /// many, and some more for the lists of splats, which there is memory for, and for the pixels of the frame.
    #[must_use]
    pub const fn with_most_work(self, most_work: u64) -> Self {
        Self { most_work, ..self }
    }

    /// Has two painters draw each frame, on a core each: [`Decoder::bind_two`](crate::Decoder::bind_two) makes them, and
    /// [`Decoder::render_by_two`](crate::Decoder::render_by_two) draws. The scene is in memory once; what the second painter has of its own is
    /// a [part](crate::Part::SecondPainter) of the plan. Frames are drawn in one strip; `bind_two` refuses a plan for which strips or slabs were
    /// asked for afterwards. The limit of [work](Self::with_most_work) is that of each painter. Of the [measured](MaxSplats::Measured) splats each
    /// has places for half, and an eighth of that more.
    ///
    /// The pixels are those of one decoder, unless splats are left out: each painter leaves out its own.
    #[must_use]
    pub const fn with_two_painters(self) -> Self {
        Self { two_painters: true, strips: Strips::Exactly(1), overflow: Overflow::LeaveOut, ..self }
    }

    /// Frame, tiers, strips, quality and the places of slabs lie within their limits.
    pub(super) fn check(&self) -> Result<(), DecodeError> {
        in_range(Field::FrameWidth, self.width_px.into(), 1, Self::MAX_FRAME_PX.into())?;
        in_range(Field::FrameHeight, self.height_px.into(), 1, Self::MAX_FRAME_PX.into())?;
        // A budget of zeros would draw background alone.
        in_range(Field::Tiers, self.tiers.into(), 1, u8::MAX.into())?;
        self.quality.check()?;
        if let (Overflow::Slabs, MaxSplats::AtMost(n)) = (self.overflow, self.max_splats) {
            in_range(Field::SlabSplats, n, Self::MIN_SLAB_PLACES, u32::MAX)?;
        }
        match self.strips {
            Strips::Auto => Ok(()),
            Strips::Exactly(n) => in_range(Field::Strips, n.into(), 1, Self::MAX_STRIPS.into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_option_is_kept() {
        let asked = Budget::for_frame(64, 48)
            .in_bytes(1)
            .with_slow_bytes(2)
            .with_tiers(3)
            .with_max_splats(MaxSplats::AtMost(4))
            .with_residency(Residency::Streamed)
            .with_strips(Strips::Exactly(5))
            .with_overflow(Overflow::Slabs)
            .with_quality(Quality::DRAFT)
            .skipping_damage()
            .with_most_work(6);
        let expected = Budget {
            ram_bytes: 1,
            slow_bytes: 2,
            width_px: 64,
            height_px: 48,
            tiers: 3,
            max_splats: MaxSplats::AtMost(4),
            residency: Residency::Streamed,
            strips: Strips::Exactly(5),
            overflow: Overflow::Slabs,
            quality: Quality::DRAFT,
            skips_damage: true,
            most_work: 6,
            two_painters: false,
        };
        assert_eq!(asked, expected);
        let by_two =
            Budget { strips: Strips::Exactly(1), overflow: Overflow::LeaveOut, two_painters: true, ..expected };
        assert_eq!(asked.with_two_painters(), by_two);
    }
}
