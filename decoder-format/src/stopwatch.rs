//! Where the work of a frame goes: a seam for clocks and instruction counters, which the crate itself has none of.

/// A part of the work of `Decoder::render_watched`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Stage {
    /// From bits, or from integers in memory, to the channels of an anchor.
    Decode,
    /// The models of an anchor's symbols: the grid's features and the network on them.
    Context,
    /// The heads with their activations, and the detail head.
    Heads,
    /// Culling chunks and anchors, and from the heads' outputs to splats.
    Project,
    /// The order by depth, and which splats a row of tiles has.
    Sort,
    /// From splats to the pixels of a tile.
    Blend,
    /// The `TileSink`.
    Output,
}

impl Stage {
    /// All stages, in the order in which data flows through them.
    pub const ALL: [Self; 7] =
        [Self::Decode, Self::Context, Self::Heads, Self::Project, Self::Sort, Self::Blend, Self::Output];

    /// Its name, lower case.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Decode => "decode",
            Self::Context => "context",
            Self::Heads => "heads",
            Self::Project => "project",
            Self::Sort => "sort",
            Self::Blend => "blend",
            Self::Output => "output",
        }
    }
}

/// Is told whenever the work of a frame passes from one stage to another.
///
/// `()` is the one that does not care and costs nothing. Another reads its clock at each call, and adds what has passed since
/// the one before to the stage of then; from the last call until `render_watched` returns it is still that stage. A frame
/// makes a few calls for each anchor, row of tiles and tile, none for a splat or a pixel.
///
/// ```
/// use std::time::{Duration, Instant};
/// use pocketsplat_format::{Stage, Stopwatch};
///
/// struct Clock {
///     spent: [Duration; Stage::ALL.len()],
///     stage: Stage,
///     since: Instant,
/// }
///
/// impl Stopwatch for Clock {
///     fn enter(&mut self, stage: Stage) {
///         self.spent[self.stage as usize] += self.since.elapsed();
///         (self.stage, self.since) = (stage, Instant::now());
///     }
/// }
///
/// let mut clock = Clock { spent: Default::default(), stage: Stage::Decode, since: Instant::now() };
/// clock.enter(Stage::Blend); // as the decoder does
/// clock.enter(Stage::Output);
/// assert!(clock.spent[Stage::Blend as usize] > Duration::ZERO);
/// ```
pub trait Stopwatch {
    /// From now on the work is of `stage`; it may have been before.
    fn enter(&mut self, stage: Stage);
}

impl Stopwatch for () {
    #[inline(always)]
    fn enter(&mut self, _stage: Stage) {}
}
