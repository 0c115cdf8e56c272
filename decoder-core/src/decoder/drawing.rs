//! A frame that is being drawn, and its steps: a few anchors, a part of a sort, a few splats of a tile.

use pocketsplat_format::rules::TILE_PX;
use pocketsplat_format::{DecodeError, Stage, Stopwatch};

use super::Decoder;
use super::overflow::{Frame, OverflowPolicy, check_work};
use super::pass::Pass;
use super::share::All;
use super::splats::{Slab, SplatStore};
use super::strip::Strip;
use crate::arithmetic::{Arithmetic, ReferenceArithmetic};
use crate::project::TILE_PIXELS;
use crate::raster::{Blending, DIGITS, Splats, TileRegion, blend_tile, finish_tile};

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
    pub(super) decoder: &'d mut Decoder<'b, 's, A>,
    pub(super) size_px: [u16; 2],
    pub(super) frame: Frame,
    pub(super) rule: <A::Blending as Blending>::Rule,
    pub(super) next: Next<'b>,
    pub(super) strip: Strip,
    pub(super) slab: Slab,
    /// The next tile: its place in the frame, and its number in the strip.
    pub(super) row: u8,
    pub(super) column: u8,
    pub(super) n_tiles: usize,
    /// Splats of the current row, at the front of the spare list, and those of them that the next tile has.
    pub(super) n_in_row: usize,
    pub(super) n_listed: usize,
    /// Pixels of the slab that are not finished.
    pub(super) alive: u32,
    /// Splats of the strip, and the most in memory at once.
    pub(super) in_strip: u32,
    pub(super) most_in_memory: u32,
}

/// What a frame does next.
#[expect(clippy::large_enum_variant, reason = "a frame has one, and there is no allocator to box with")]
pub(super) enum Next<'b> {
    /// The slab behind this one, or the strip below.
    Slab,
    /// More anchors.
    Anchors(Pass<'b>),
    /// Their splats in the order of these and later digits of their depths.
    Order { shift: u32 },
    /// More splats of the next tile.
    Tile,
    /// Nothing.
    End,
}

/// What one step came to.
pub(super) enum Step {
    Working,
    Tile(TileRegion),
    Complete,
}

impl<A: Arithmetic> Drawing<'_, '_, '_, A> {
    /// Does the next part of the frame; after an error nothing.
    // Not inlined: it is long, and has two callers.
    #[inline(never)]
    pub(super) fn step(&mut self, watch: &mut impl Stopwatch) -> Result<Step, DecodeError> {
        let step = match &mut self.next {
            Next::Slab => Ok(self.begin_slab()),
            Next::Anchors(pass) => self.decoder.go_on(pass, &mut self.frame, &mut All, watch).map(|is_complete| {
                if is_complete {
                    self.end_pass();
                }
                Step::Working
            }),
            Next::Order { shift } => {
                watch.enter(Stage::Sort);
                self.decoder.splats.order_by(*shift);
                let later = DIGITS.into_iter().find(|digit| digit > shift);
                self.next = later.map_or(Next::Tile, |shift| Next::Order { shift });
                Ok(Step::Working)
            }
            Next::Tile => self.draw_tile(watch).ok_or(DecodeError::Internal),
            Next::End => return Ok(Step::Complete),
        };
        let step = step.and_then(|step| {
            check_work(self.frame.instructions(), self.decoder.plan.budget().most_work).map(|()| step)
        });
        if step.is_err() {
            self.next = Next::End;
        }
        step
    }

    /// Begins with the next slab, of this strip or of the next one, if there is one.
    // Not inlined: a caller's stack frame would keep the pass a second time.
    #[inline(never)]
    fn begin_slab(&mut self) -> Step {
        let Self { decoder, frame, .. } = self;
        let from = if self.slab.ends() {
            self.slab.end
        } else {
            frame.report.strip_splats = frame.report.strip_splats.saturating_add(self.in_strip);
            if !matches!(frame.policy, OverflowPolicy::FirstCome { .. }) {
                frame.report.max_splats = frame.report.max_splats.max(self.in_strip);
            }
            self.in_strip = 0;
            let Some(strip) = frame.strips.after(self.strip) else {
                self.next = Next::End;
                return Step::Complete;
            };
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
            self.begin_tiles(Slab::behind(from));
        } else {
            self.next = Next::Anchors(decoder.begin_pass(self.strip, from, frame));
        }
        Step::Working
    }

    /// Counts the splats of a pass that is complete.
    fn end_pass(&mut self) {
        let Next::Anchors(Pass { target, .. }) = &self.next else { return };
        self.strip = target.strip;
        let slab = target.slab;
        let Self { decoder, frame, .. } = self;
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
        self.begin_tiles(slab);
    }

    /// The tiles of a slab come next, once its splats are in order.
    fn begin_tiles(&mut self, slab: Slab) {
        (self.next, self.slab) = (Next::Order { shift: 0 }, slab);
        // A frame has 255 rows at most.
        self.row = self.strip.first_row as u8;
        (self.column, self.n_tiles, self.n_listed, self.alive) = (0, 0, 0, 0);
    }

    /// Draws more of the slab's splats into the next tile, and finishes it if they are the strip's last.
    fn draw_tile(&mut self, watch: &mut impl Stopwatch) -> Option<Step> {
        let [width_px, height_px] = self.size_px;
        let decoder = &mut *self.decoder;
        let SplatStore { splats, rects, n, order, spare, .. } = &mut decoder.splats;
        let n = *n as usize;
        let (splats, rects) = (splats.get(..n)?, rects.get(..n)?);
        if self.column == 0 && self.n_listed == 0 {
            watch.enter(Stage::Sort);
            self.n_in_row = gather_row(order.get(..n)?, (splats, rects), self.row, spare.get_mut(..n)?);
        }
        watch.enter(Stage::Blend);
        let (row, column) = (self.row, self.column);
        let place = TileRegion { column, row, width: size_along(width_px, column), height: size_along(height_px, row) };
        // One after the other, or all at once.
        let slot = if decoder.plan.shape().frame.canvas_tiles > 1 { self.n_tiles } else { 0 };
        let pixels = decoder.pixels.chunks_exact_mut(TILE_PIXELS).nth(slot)?;
        if self.slab.from == 0.0 && self.n_listed == 0 {
            pixels.fill(A::Blending::EMPTY);
        }
        let list = spare.get(self.n_listed..self.n_in_row)?;
        let work = blend_tile::<A::Blending>(place, (splats, rects), list, &self.rule, pixels);
        let report = &mut self.frame.report;
        report.tile_splats = report.tile_splats.saturating_add(work.splats);
        report.row_splats = report.row_splats.saturating_add(work.rows);
        report.pixel_splats = report.pixel_splats.saturating_add(work.pixels);
        if work.listed < list.len() {
            self.n_listed += work.listed;
            return Some(Step::Working);
        }
        self.alive += work.alive;
        self.n_listed = 0;
        self.n_tiles += 1;
        self.column += 1;
        if u16::from(self.column) >= width_px.div_ceil(TILE_PX) {
            self.column = 0;
            self.row += 1;
            if u16::from(self.row) >= self.strip.end_row {
                self.next = Next::Slab;
            }
        }
        if self.slab.ends() {
            return Some(Step::Working);
        }
        let header = decoder.bundle.header();
        let has_background = header.features.effects.background;
        let background = has_background.then(|| header.background.map(|byte| f32::from(byte) / 255.0));
        finish_tile::<A::Blending>(place, pixels, background, decoder.rgb);
        watch.enter(Stage::Output);
        Some(Step::Tile(place))
    }
}

/// Size of a tile along an axis, pixels.
pub(super) fn size_along(size_px: u16, index: u8) -> u16 {
    TILE_PX.min(size_px.saturating_sub(u16::from(index) * TILE_PX))
}

/// Copies the splats that touch tile row `row` from `order` to the front of `list`, in order; returns how many.
// Not inlined: its loop would not stay in registers.
#[inline(never)]
pub(super) fn gather_row(order: &[u32], splats: impl Splats, row: u8, list: &mut [u32]) -> usize {
    let mut n = 0;
    for &index in order {
        let Some(rect) = splats.rect(index) else { continue };
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
