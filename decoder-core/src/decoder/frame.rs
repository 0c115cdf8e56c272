//! Drawing a frame: strip after strip, slab after slab, tile after tile.

use core::fmt;

use pocketsplat_format::rules::TILE_PX;
use pocketsplat_format::{Camera, DecodeError, Field, Stage, Stopwatch, in_range, saturate};

use super::first_come::FirstCome;
use super::gather::{Frame, OverflowPolicy};
use super::render_error::RenderError;
use super::slab_index::IndexState;
use super::splats::{Slab, SplatStore};
use super::strip::{Strip, StripLayout};
use super::strips_of_chunks::StripsOfChunks;
use super::tile::{Tile, TileSink};
use super::{Decoder, FrameReport};
use crate::arithmetic::{Arithmetic, ReferenceArithmetic};
use crate::budget::Overflow;
use crate::project::{TILE_PIXELS, TileRect, View};
use crate::raster::{BlendRule, EMPTY, TileRegion, blend_tile, finish_tile};

/// Strips of a frame that is worth an index of its chunks.
const LEAST_STRIPS_INDEXED: u8 = 3;

/// A frame that comes tile by tile, each when it is asked for; made by [`Decoder::begin`].
///
/// Between two tiles the processor is free: for the bus that sends the last one, for other tasks. Dropping it ends the frame.
///
/// ```
/// # fn main() -> Result<(), pocketsplat_core::DecodeError> {
/// # let bytes = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/example.psb"));
/// # let mut scratch = [0; 8 * 1024];
/// use pocketsplat_core::{Budget, Bundle, Decoder, Plan};
///
/// let bundle = Bundle::parse(bytes)?;
/// let plan = Plan::new(&bundle, &Budget::for_frame(32, 24))?;
/// let mut decoder = Decoder::bind(&bundle, plan, &mut scratch)?;
/// let mut drawing = decoder.begin(&bundle.header().preview)?;
/// let mut n_pixels = 0;
/// while let Some(tile) = drawing.next_tile()? {
///     n_pixels += tile.rgb.len(); // or: display.send(tile.x_px, tile.y_px, tile.rgb).await
/// }
/// assert_eq!((n_pixels, drawing.report().splats), (32 * 24, 5));
/// # Ok(())
/// # }
/// ```
#[must_use = "nothing is drawn before its tiles are asked for"]
pub struct Drawing<'d, 'b, 's, A: Arithmetic = ReferenceArithmetic> {
    decoder: &'d mut Decoder<'b, 's, A>,
    size_px: [u16; 2],
    frame: Frame,
    rule: BlendRule,
    strip: Strip,
    slab: Slab,
    /// The next tile: its place in the frame, and its number in the strip.
    row: u8,
    column: u8,
    n_tiles: usize,
    /// Splats of the current row, at the front of the spare list.
    n_in_row: usize,
    /// Pixels of the slab that are not finished.
    alive: u32,
    /// Splats of the strip, and the most in memory at once.
    in_strip: u32,
    most_in_memory: u32,
}

impl<'b, 's, A: Arithmetic> Decoder<'b, 's, A> {
    /// Checks the camera and prepares a frame, without drawing any of it.
    #[inline(always)]
    pub(super) fn begin_frame(&mut self, camera: &Camera) -> Result<Drawing<'_, 'b, 's, A>, DecodeError> {
        let budget = self.plan.budget();
        let view = View::of(self.bundle.header(), camera)?.cutting_at(budget.quality.alpha_cut);
        in_range(Field::FrameWidth, camera.width_px.into(), 1, budget.width_px.into())?;
        in_range(Field::FrameHeight, camera.height_px.into(), 1, budget.height_px.into())?;
        let strips = StripLayout::new(camera.height_px, self.plan.n_strips());
        (self.splats.n_indexed, self.splats.places_of_index) = (0, 0);
        let policy = if budget.overflow == Overflow::Slabs {
            // Decoding costs most, and each of many passes would do it again. Of fewer the first costs more than the others save.
            let is_indexed = strips.len() >= LEAST_STRIPS_INDEXED
                && self.source.is_streamed()
                && self.splats.begin_index(self.bundle.up_to_tier(self.plan.n_tiers()).n_chunks);
            OverflowPolicy::Slabs { index: if is_indexed { IndexState::Due } else { IndexState::None } }
        } else if strips.len() > 1 && self.surely_fits(&view, strips) {
            OverflowPolicy::Fits
        } else {
            let first_come = FirstCome::new(self.splats.places());
            OverflowPolicy::FirstCome { first_come, strips_of_chunks: StripsOfChunks::NONE }
        };
        let rule = BlendRule::new(budget.quality.alpha_cut);
        let mut frame = Frame { view, strips, policy, report: FrameReport::default() };
        if self.skips_damage() && matches!(frame.policy, OverflowPolicy::Slabs { .. }) {
            self.note_damage(&mut frame);
        }
        Ok(Drawing {
            decoder: self,
            size_px: [camera.width_px, camera.height_px],
            frame,
            rule,
            strip: Strip::BEFORE,
            slab: Slab::behind(0.0),
            row: 0,
            column: 0,
            n_tiles: 0,
            n_in_row: 0,
            alive: 0,
            in_strip: 0,
            most_in_memory: 0,
        })
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
        let mut drawing = self.begin_frame(camera)?;
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
    /// [`DecodeError::ChunkStream`] for a chunk that no writer makes; no tile comes after it.
    ///
    /// # Budget
    /// As [`Decoder::render`], divided among its tiles: the first of a strip, or of each of its slabs, takes the decoding and
    /// the sort for all.
    pub fn next_tile(&mut self) -> Result<Option<Tile<'_>>, DecodeError> {
        self.next_tile_watched(&mut ())
    }

    /// As [`next_tile`](Self::next_tile), and tells `watch` where the work goes.
    fn next_tile_watched(&mut self, watch: &mut impl Stopwatch) -> Result<Option<Tile<'_>>, DecodeError> {
        let place = loop {
            if u16::from(self.row) >= self.strip.end_row {
                if !self.next_slab(watch)? {
                    return Ok(None);
                }
                continue;
            }
            let Some(place) = self.draw_tile(watch) else { return Err(DecodeError::Internal) };
            if !self.slab.ends() {
                break place;
            }
        };
        watch.enter(Stage::Output);
        let TileRegion { column, row, width, height } = place;
        let [x_px, y_px] = [column, row].map(|index| u16::from(index) * TILE_PX);
        let rgb = self.decoder.rgb.get_mut(..usize::from(width) * usize::from(height)).unwrap_or_default();
        Ok(Some(Tile { x_px, y_px, width, height, rgb }))
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

    /// What is left of the current row of tiles: its first column and row, its width and height, pixels; `None` after the last row.
    pub(super) fn rest_of_row(&self) -> Option<[u16; 4]> {
        let [width_px, height_px] = self.size_px;
        let [x_px, y_px] = [self.column, self.row].map(|index| u16::from(index) * TILE_PX);
        let is_over = u16::from(self.row) >= self.frame.strips.n_rows();
        (!is_over).then(|| [x_px, y_px, width_px.saturating_sub(x_px), size_along(height_px, self.row)])
    }

    /// Gathers and orders the splats of the next slab, of this strip or of the next one; false when there is none.
    fn next_slab(&mut self, watch: &mut impl Stopwatch) -> Result<bool, DecodeError> {
        let Self { decoder, frame, .. } = self;
        let from = if self.slab.ends() {
            self.slab.end
        } else {
            frame.report.strip_splats = frame.report.strip_splats.saturating_add(self.in_strip);
            if !matches!(frame.policy, OverflowPolicy::FirstCome { .. }) {
                frame.report.max_splats = frame.report.max_splats.max(self.in_strip);
            }
            self.in_strip = 0;
            let Some(strip) = frame.strips.after(self.strip) else { return Ok(false) };
            self.strip = match &frame.policy {
                // What a damaged chunk would have made room for is gone.
                OverflowPolicy::FirstCome { .. } if decoder.skips_damage() => strip,
                // The first pass goes over the whole scene anyway.
                OverflowPolicy::FirstCome { .. } if strip.index == 0 => frame.strips.between(0, frame.strips.len()),
                OverflowPolicy::FirstCome { first_come, .. } => {
                    let end = first_come.end_of_those_with_room(strip.index).min(frame.strips.len());
                    frame.strips.between(strip.index, end)
                }
                OverflowPolicy::Fits | OverflowPolicy::Slabs { .. } => strip,
            };
            0.0
        };
        if from > 0.0 && self.alive == 0 {
            // Nothing behind can be seen: the strip goes out as it is.
            decoder.splats.n = 0;
            self.slab = Slab::behind(from);
        } else {
            self.slab = match decoder.gather(&mut self.strip, from, frame, watch) {
                Ok(slab) => slab,
                Err(error) => {
                    // As after the last strip.
                    (self.slab, self.strip.end_row, self.row) = (Slab::behind(0.0), frame.strips.n_rows(), u8::MAX);
                    return Err(error);
                }
            };
            frame.report.slabs = frame.report.slabs.saturating_add(1);
            let n = decoder.splats.n;
            self.in_strip = self.in_strip.saturating_add(n);
            // There were more when it let go of some.
            let most = n.max(decoder.splats.most).saturating_add(decoder.splats.places_of_index);
            self.most_in_memory = most.max(self.most_in_memory);
            let rects = decoder.splats.rects.iter().take(n as usize);
            let n_first_here =
                rects.filter(|rect| *frame.strips.touched(**rect).start() >= self.strip.index.into()).count() as u32;
            frame.report.splats = frame.report.splats.saturating_add(n_first_here);
        }
        watch.enter(Stage::Sort);
        decoder.splats.sort();
        // A frame has 255 rows at most.
        self.row = self.strip.first_row as u8;
        (self.column, self.n_tiles, self.alive) = (0, 0, 0);
        Ok(true)
    }

    /// Draws the slab's splats into the next tile, and finishes it if the slab is the strip's last.
    fn draw_tile(&mut self, watch: &mut impl Stopwatch) -> Option<TileRegion> {
        let [width_px, height_px] = self.size_px;
        let decoder = &mut *self.decoder;
        let SplatStore { splats, rects, n, order, spare, .. } = &mut decoder.splats;
        let n = *n as usize;
        let (splats, rects) = (splats.get(..n)?, rects.get(..n)?);
        if self.column == 0 {
            watch.enter(Stage::Sort);
            self.n_in_row = gather_row(order.get(..n)?, rects, self.row, spare.get_mut(..n)?);
        }
        watch.enter(Stage::Blend);
        let (row, column) = (self.row, self.column);
        let place = TileRegion { column, row, width: size_along(width_px, column), height: size_along(height_px, row) };
        // One after the other, or all at once.
        let slot = if decoder.plan.shape().frame.canvas_tiles > 1 { self.n_tiles } else { 0 };
        let pixels = decoder.pixels.chunks_exact_mut(TILE_PIXELS).nth(slot)?;
        if self.slab.from == 0.0 {
            pixels.fill(EMPTY);
        }
        let list = spare.get(..self.n_in_row)?;
        let work = blend_tile::<A::Functions>(place, splats, rects, list, &self.rule, pixels);
        self.alive += work.alive;
        let report = &mut self.frame.report;
        report.tile_splats = report.tile_splats.saturating_add(work.splats);
        report.row_splats = report.row_splats.saturating_add(work.rows);
        report.pixel_splats = report.pixel_splats.saturating_add(work.pixels);
        if !self.slab.ends() {
            let header = decoder.bundle.header();
            let has_background = header.features.effects.background;
            let background = has_background.then(|| header.background.map(|byte| f32::from(byte) / 255.0));
            finish_tile(place, pixels, background, decoder.rgb);
        }
        self.n_tiles += 1;
        self.column += 1;
        if u16::from(self.column) >= width_px.div_ceil(TILE_PX) {
            self.column = 0;
            self.row += 1;
        }
        Some(place)
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

/// Size of a tile along an axis, pixels.
fn size_along(size_px: u16, index: u8) -> u16 {
    TILE_PX.min(size_px.saturating_sub(u16::from(index) * TILE_PX))
}

/// Copies the splats that touch tile row `row` from `order` to the front of `list`, in order; returns how many.
// Not inlined: its loop would not stay in registers.
#[inline(never)]
fn gather_row(order: &[u32], rects: &[TileRect], row: u8, list: &mut [u32]) -> usize {
    let mut n = 0;
    for &index in order {
        let Some(rect) = rects.get(index as usize) else { continue };
        if rect.first_row <= row
            && row <= rect.last_row
            && let Some(slot) = list.get_mut(n)
        {
            *slot = index;
            n += 1;
        }
    }
    n
}
