//! Frames as they are asked for: begun, tile by tile or step by step, and reported.

use core::fmt;
use core::task::Poll;

use pocketsplat_format::rules::TILE_PX;
use pocketsplat_format::{Camera, DecodeError, Field, Stage, Stopwatch, in_range, saturate};

use super::drawing::{Drawing, Next, Step, size_along};
use super::first_come::FirstCome;
use super::overflow::{Frame, OverflowPolicy};
use super::render_error::RenderError;
use super::slab_index::IndexState;
use super::splats::Slab;
use super::strip::{Strip, StripLayout};
use super::strips_of_chunks::StripsOfChunks;
use super::tile::{Tile, TileSink};
use super::{Decoder, FrameReport};
use crate::arithmetic::Arithmetic;
use crate::budget::Overflow;
use crate::project::View;
use crate::raster::{Blending, TileRegion};

/// Strips of a frame that is worth an index of its chunks.
const LEAST_STRIPS_INDEXED: u8 = 3;

impl<'b, 's, A: Arithmetic> Decoder<'b, 's, A> {
    /// The view of a camera that is as it has to be.
    #[inline(never)]
    pub(super) fn view_of(&self, camera: &Camera) -> Result<View, DecodeError> {
        let budget = self.plan.budget();
        let view = View::of(self.bundle.header(), camera)?.cutting_at(budget.quality.alpha_cut);
        in_range(Field::FrameWidth, camera.width_px.into(), 1, budget.width_px.into())?;
        in_range(Field::FrameHeight, camera.height_px.into(), 1, budget.height_px.into())?;
        Ok(view)
    }

    /// Prepares a frame, without drawing any of it.
    ///
    /// * `view`: of `camera`. Checked before: a drawing in a `Result` would be on the stack twice.
    #[inline(always)]
    pub(super) fn begin_frame(&mut self, camera: &Camera, view: View) -> Drawing<'_, 'b, 's, A> {
        let budget = self.plan.budget();
        let strips = StripLayout::new(camera.height_px, self.plan.n_strips());
        (self.splats.n_indexed, self.splats.places_of_index) = (0, 0);
        let mut unreported = 0;
        let policy = if budget.overflow == Overflow::Slabs {
            // Decoding costs most, and each of many passes would do it again. Of fewer the first costs more than the others save.
            let is_indexed = strips.len() >= LEAST_STRIPS_INDEXED
                && self.source.is_streamed()
                && self.splats.begin_index(self.n_planned_chunks());
            OverflowPolicy::Slabs { index: if is_indexed { IndexState::Due } else { IndexState::None } }
        } else if strips.len() > 1 && self.surely_fits(&view, strips, &mut unreported) {
            OverflowPolicy::Fits
        } else {
            let first_come = FirstCome::new(self.splats.places());
            OverflowPolicy::FirstCome { first_come, strips_of_chunks: StripsOfChunks::NONE }
        };
        let rule = A::Blending::rule(budget.quality.alpha_cut);
        let cost = self.bundle.model_cost();
        let mut frame = Frame { view, strips, policy, report: FrameReport::default(), cost, unreported };
        if self.skips_damage() && matches!(frame.policy, OverflowPolicy::Slabs { .. }) {
            self.note_damage(&mut frame);
        }
        Drawing {
            decoder: self,
            size_px: [camera.width_px, camera.height_px],
            frame,
            rule,
            next: Next::Slab,
            strip: Strip::BEFORE,
            slab: Slab::behind(0.0),
            row: 0,
            column: 0,
            n_tiles: 0,
            n_in_row: 0,
            n_listed: 0,
            alive: 0,
            in_strip: 0,
            most_in_memory: 0,
        }
    }

    /// As [`render_watched`](Self::render_watched).
    // Not inlined: a caller's stack frame would keep what only this needs.
    #[inline(never)]
    pub(super) fn draw_frame<S: TileSink>(
        &mut self,
        camera: &Camera,
        sink: &mut S,
        watch: &mut impl Stopwatch,
    ) -> Result<FrameReport, RenderError<S::Error>> {
        watch.enter(Stage::Project);
        let view = self.view_of(camera)?;
        let mut drawing = self.begin_frame(camera, view);
        while let Some(tile) = drawing.next_tile_watched(watch)? {
            sink.tile(tile).map_err(RenderError::Sink)?;
        }
        Ok(drawing.report())
    }
}

impl<A: Arithmetic> Drawing<'_, '_, '_, A> {
    /// Draws the next tile, in the order in which [`Decoder::render`] hands them out, and with the same pixels; `None` after
    /// the last.
    ///
    /// # Errors
    /// [`DecodeError::ChunkStream`] for a chunk that no writer makes, [`DecodeError::TooMuchWork`] beyond the
    /// [budget's](crate::Budget::with_most_work); no tile comes after either.
    ///
    /// # Budget
    /// As [`Decoder::render`], divided among its tiles: the first of a strip, or of each of its slabs, takes the decoding and
    /// the sort for all.
    pub fn next_tile(&mut self) -> Result<Option<Tile<'_>>, DecodeError> {
        self.next_tile_watched(&mut ())
    }

    /// Does a small part of the frame: a few anchors, a part of the sort of a strip, or a few splats of a tile.
    ///
    /// `Pending` while there is nothing to show, `None` when the frame is complete. Between two calls the processor is free;
    /// [`next_tile`](Self::next_tile) does as many parts at once as a tile takes.
    ///
    /// ```
    /// # fn main() -> Result<(), pocketsplat_core::DecodeError> {
    /// # let bytes = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/example.psb"));
    /// # let mut scratch = [0; 8 * 1024];
    /// use std::task::Poll;
    ///
    /// use pocketsplat_core::{Budget, Bundle, Decoder, Plan};
    ///
    /// let bundle = Bundle::parse(bytes)?;
    /// let plan = Plan::new(&bundle, &Budget::for_frame(32, 24).with_most_work(1_000_000))?;
    /// let mut decoder = Decoder::bind(&bundle, plan, &mut scratch)?;
    /// let mut drawing = decoder.begin(&bundle.header().preview)?;
    /// let mut n_pixels = 0;
    /// loop {
    ///     match drawing.advance()? {
    ///         Poll::Pending => {} // or: feed the watchdog, poll USB, yield to other tasks
    ///         Poll::Ready(Some(tile)) => n_pixels += tile.rgb.len(),
    ///         Poll::Ready(None) => break,
    ///     }
    /// }
    /// assert_eq!(n_pixels, 32 * 24);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// As for [`next_tile`](Self::next_tile).
    ///
    /// # Budget
    /// About 200,000 [model instructions](FrameReport::instructions), one anchor's more, and at most 64 splats of a tile; a part of
    /// the sort about 40 instructions a splat, and where damage is skipped, a checksum about 8 a byte of its chunk.
    pub fn advance(&mut self) -> Result<Poll<Option<Tile<'_>>>, DecodeError> {
        Ok(match self.step(&mut ())? {
            Step::Working => Poll::Pending,
            Step::Tile(place) => Poll::Ready(Some(self.tile(place))),
            Step::Complete => Poll::Ready(None),
        })
    }

    /// As [`next_tile`](Self::next_tile), and tells `watch` where the work goes.
    fn next_tile_watched(&mut self, watch: &mut impl Stopwatch) -> Result<Option<Tile<'_>>, DecodeError> {
        let place = loop {
            match self.step(watch)? {
                Step::Working => {}
                Step::Tile(place) => break place,
                Step::Complete => return Ok(None),
            }
        };
        Ok(Some(self.tile(place)))
    }

    /// The tile that was finished last.
    fn tile(&mut self, TileRegion { column, row, width, height }: TileRegion) -> Tile<'_> {
        let [x_px, y_px] = [column, row].map(|index| u16::from(index) * TILE_PX);
        let rgb = self.decoder.rgb.get_mut(..usize::from(width) * usize::from(height)).unwrap_or_default();
        Tile { x_px, y_px, width, height, rgb }
    }

    /// What the frame consisted of and took; of a frame that is not finished so far.
    #[must_use]
    pub fn report(&self) -> FrameReport {
        let mut report = self.frame.report;
        if let OverflowPolicy::FirstCome { first_come, .. } = &self.frame.policy {
            report.splats_dropped = report.splats_dropped.saturating_add(first_come.n_dropped());
            report.max_splats = report.max_splats.max(first_come.max_demand());
        }
        report.scratch_used = saturate(self.decoder.plan.len_with_splats(self.most_in_memory));
        report
    }

    /// What is left of the row of tiles that is handed out: its first column and row, its width and height, pixels; `None` after the
    /// last row.
    pub(super) fn rest_of_row(&self) -> Option<[u16; 4]> {
        let [width_px, height_px] = self.size_px;
        // Of a strip whose slabs are not all drawn nothing is handed out.
        let [column, row] =
            if self.slab.ends() { [0, self.strip.first_row] } else { [self.column, self.row].map(u16::from) };
        let is_over = matches!(self.next, Next::End) || row >= self.frame.strips.n_rows();
        let [x_px, y_px] = [column, row].map(|index| index * TILE_PX);
        // A frame has 255 rows at most.
        (!is_over).then(|| [x_px, y_px, width_px.saturating_sub(x_px), size_along(height_px, row as u8)])
    }
}

impl<A: Arithmetic> fmt::Debug for Drawing<'_, '_, '_, A> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Drawing")
            .field("size_px", &self.size_px)
            .field("report", &self.report())
            .finish_non_exhaustive()
    }
}
