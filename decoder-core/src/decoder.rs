//! The façade: a bundle, a plan and the caller's memory bound together, drawing frames.

mod gather;
mod report;
mod source;
mod splats;
mod strip;
mod tally;

pub use report::FrameReport;

use crate::arithmetic::{Arithmetic, Exact};
use crate::bake::{BakedGaussians, BakedMemory, bake};
use crate::budget::{Arena, Overflow, Plan, ScratchShape};
use crate::bundle::{AnchorRecords, Bundle, Chunk, RecordMemory, Tables, in_range, saturate};
use crate::camera::Camera;
use crate::error::{DecodeError, Field};
use crate::mlp::{HeadNumbers, Heads};
use crate::project::{PackedSplat, View};
use crate::raster::{
    BlendRule, EMPTY, N_RADIX, Pixel, TILE_PIXELS, TILE_PX, TilePlace, TileRect, blend_tile, finish_tile, sort_by_depth,
};
use crate::scene::Workspace;
use crate::stopwatch::{Stage, Stopwatch};
use gather::Frame;
use source::{AnchorSource, Anchors, GaussianSource};
use splats::{Slab, SplatStore};
use strip::{Strip, StripLayout};
use tally::Tally;

/// Takes finished tiles, for instance to a display.
pub trait TileSink {
    /// One tile: its first pixel, its size, and `[height, width]` pixels row by row.
    ///
    /// Tiles come in rows from the top, each row from the left; together they fill the frame, none twice.
    fn tile(&mut self, x_px: u16, y_px: u16, width: u16, height: u16, rgb: &[[u8; 3]]);
}

/// Draws frames of one bundle with the memory it was bound to, computed as `A` says.
pub struct Decoder<'b, 's, A: Arithmetic = Exact> {
    bundle: Bundle<'b>,
    plan: Plan,
    skip_damage: bool,
    source: GaussianSource<'b, 's, A::Heads>,
    /// `[TILE_PIXELS]` of the tile in work, or of each tile of a strip when strips are drawn in slabs.
    pixels: &'s mut [Pixel],
    /// `[TILE_PIXELS]` a finished tile.
    rgb: &'s mut [[u8; 3]],
    splats: SplatStore<'s, A>,
}

impl<'b, 's> Decoder<'b, 's> {
    /// Takes `scratch`, converts the heads' weights into it, compares the checksum of every chunk of the planned tiers, and
    /// decodes them, or evaluates their Gaussians, if the plan says so.
    ///
    /// # Errors
    /// [`DecodeError::ScratchTooSmall`] names the bytes needed; [`DecodeError::PlanMismatch`] when `plan` is another
    /// bundle's; [`DecodeError::ChunkChecksum`] names the damaged chunk, and so does [`DecodeError::ChunkStream`] for
    /// resident anchors and baked Gaussians; [`DecodeError::OutOfRange`] when those are more than the bundle says.
    ///
    /// # Budget
    /// Exactly [`Plan::scratch_len`] bytes of `scratch`; reads the whole bundle once, about 8 instructions a byte, and for
    /// resident anchors 55 to 80 a symbol; baked Gaussians take the heads of every anchor besides.
    pub fn bind(bundle: &Bundle<'b>, plan: Plan, scratch: &'s mut [u8]) -> Result<Self, DecodeError> {
        Self::bind_in(bundle, plan, scratch)
    }

    /// As [`bind`](Self::bind), with another arithmetic: `Decoder::bind_in::<With<I16>>(…)`.
    ///
    /// # Errors
    /// As for [`bind`](Self::bind).
    ///
    /// # Budget
    /// As for [`bind`](Self::bind); no arithmetic takes more memory than the exact one.
    pub fn bind_in<A: Arithmetic>(
        bundle: &Bundle<'b>,
        plan: Plan,
        scratch: &'s mut [u8],
    ) -> Result<Decoder<'b, 's, A>, DecodeError> {
        let decoder = Decoder::bind_with(bundle, plan, scratch, false)?;
        // What is in memory was compared before it was decoded.
        if decoder.source.is_streamed() {
            for (chunk, _) in decoder.planned_chunks() {
                chunk.check()?;
            }
        }
        Ok(decoder)
    }

    /// As [`bind`](Self::bind), but leaves damaged chunks out, and each frame that needs some says so in its report. Drawn in
    /// [slabs](crate::Overflow::Slabs), a frame still fails for a chunk whose checksum is right and whose stream is not.
    ///
    /// # Errors
    /// [`DecodeError::ScratchTooSmall`] and [`DecodeError::PlanMismatch`] as for [`bind`](Self::bind).
    ///
    /// # Budget
    /// As for [`bind`](Self::bind) when anchors are resident. Streamed, checksums are compared in the frames that need the
    /// chunks: about 8 instructions a byte of those in view.
    pub fn bind_skipping_damage(bundle: &Bundle<'b>, plan: Plan, scratch: &'s mut [u8]) -> Result<Self, DecodeError> {
        Self::bind_with(bundle, plan, scratch, true)
    }
}

impl<'b, 's, A: Arithmetic> Decoder<'b, 's, A> {
    // Not inlined, here and below: a caller's stack frame would keep what only one of the steps needs.
    #[inline(never)]
    fn bind_with(
        bundle: &Bundle<'b>,
        plan: Plan,
        scratch: &'s mut [u8],
        skip_damage: bool,
    ) -> Result<Self, DecodeError> {
        let needed = bundle.plan(plan.budget())?;
        if needed != plan {
            return Err(DecodeError::PlanMismatch {
                needed: saturate(needed.scratch_len()),
                planned: saturate(plan.scratch_len()),
            });
        }
        let available = saturate(scratch.len());
        let Some((scratch, _)) = scratch.split_at_mut_checked(plan.scratch_len()) else {
            return Err(DecodeError::ScratchTooSmall { needed: saturate(plan.scratch_len()), available });
        };
        let mut arena = Arena::new(scratch);
        // Apart from the rest, because it calls deeply.
        let baked = if plan.is_baked() { Some(bake_scene(bundle, &plan, &mut arena, skip_damage)?) } else { None };
        Self::in_arena(bundle, plan, arena, baked, skip_damage)
    }

    /// Takes from `arena` what `ScratchShape` adds up, but for Gaussians that are baked already.
    #[inline(never)]
    fn in_arena(
        bundle: &Bundle<'b>,
        plan: Plan,
        mut arena: Arena<'s>,
        baked: Option<BakedGaussians<'s>>,
        skip_damage: bool,
    ) -> Result<Self, DecodeError> {
        let n_splats = places_for::<A>(&plan) as usize;
        Ok(Self {
            bundle: *bundle,
            plan,
            skip_damage,
            source: match baked {
                Some(baked) => GaussianSource::Baked(baked),
                None => GaussianSource::Anchors(take_anchors(bundle, &plan, &mut arena, skip_damage)?),
            },
            pixels: arena.take(TILE_PIXELS.saturating_mul(plan.shape().canvas_tiles as usize))?,
            rgb: arena.take(TILE_PIXELS)?,
            splats: SplatStore {
                counts: arena.take(N_RADIX)?,
                splats: arena.take(n_splats)?,
                rects: arena.take(n_splats)?,
                n: 0,
                order: arena.take(n_splats)?,
                spare: arena.take(n_splats)?,
            },
        })
    }

    /// The bundle it draws.
    #[must_use]
    pub fn bundle(&self) -> &Bundle<'b> {
        &self.bundle
    }

    /// Draws the scene as `camera` sees it and hands it to `sink` tile by tile.
    ///
    /// A view with more splats than planned draws those of the file's first anchors, in all strips the same, and reports how
    /// many it left out; or it draws a strip in several slabs of depth if the [budget](crate::Overflow) says so.
    ///
    /// # Errors
    /// [`DecodeError::OutOfRange`] for a frame larger than planned and [`DecodeError::BadFloat`] for an unusable camera,
    /// before the first tile; [`DecodeError::ChunkStream`] for a chunk that no writer makes, which with strips and streamed
    /// anchors may come after some.
    ///
    /// # Budget
    /// No memory beyond the bound one, under 3 KiB of stack. Work of one strip: every anchor of a chunk in view is decoded
    /// unless it is resident, the heads run for anchors that pass the prefilter, unless Gaussians are baked, and a pixel is finished when its
    /// transmittance falls below 1e-4. Of several strips each does so for the chunks and anchors that can reach it; but the
    /// first one goes over the whole view to see that all strips have places enough, unless that follows from the
    /// directory.
    pub fn render(&mut self, camera: &Camera, sink: &mut impl TileSink) -> Result<FrameReport, DecodeError> {
        self.render_watched(camera, sink, &mut ())
    }

    /// As [`render`](Self::render), and tells `watch` where the work goes.
    ///
    /// # Errors
    /// As for [`render`](Self::render).
    #[inline(never)]
    pub fn render_watched(
        &mut self,
        camera: &Camera,
        sink: &mut impl TileSink,
        watch: &mut impl Stopwatch,
    ) -> Result<FrameReport, DecodeError> {
        watch.enter(Stage::Project);
        let budget = *self.plan.budget();
        let view = View::new(camera)?.cutting_at(budget.quality.alpha_cut);
        in_range(Field::FrameWidth, camera.width_px.into(), 1, budget.width_px.into())?;
        in_range(Field::FrameHeight, camera.height_px.into(), 1, budget.height_px.into())?;
        let strips = StripLayout::new(camera.height_px, self.plan.n_strips());
        let in_slabs = budget.overflow == Overflow::Slabs;
        let tallies = !in_slabs && (strips.len() == 1 || !self.surely_fits(&view, strips));
        let tally = Tally::new(places_for::<A>(&self.plan));
        let mut frame = Frame { view, strips, tallies, in_slabs, tally, report: FrameReport::default() };
        if in_slabs && self.skip_damage {
            self.note_damage(&mut frame);
        }
        let mut most_in_memory = 0;
        for strip in strips.iter() {
            let (mut from, mut in_strip) = (0.0, 0_u32);
            loop {
                let slab = self.gather(strip, from, &mut frame, watch)?;
                frame.report.slabs = frame.report.slabs.saturating_add(1);
                let n = self.splats.n;
                most_in_memory = n.max(most_in_memory);
                in_strip = in_strip.saturating_add(n);
                let rects = self.splats.rects.iter().take(n as usize);
                let first_here =
                    rects.filter(|rect| *strips.touched(**rect).start() == usize::from(strip.index)).count();
                frame.report.splats = frame.report.splats.saturating_add(first_here as u32);
                let alive = self.draw(strip, slab, camera, sink, &mut frame.report, watch);
                if !slab.ends() {
                    break;
                }
                from = slab.end;
                if !alive {
                    // Nothing behind can be seen: the strip goes out as it is.
                    self.splats.n = 0;
                    self.draw(strip, Slab::behind(from), camera, sink, &mut frame.report, watch);
                    break;
                }
            }
            frame.report.strip_splats = frame.report.strip_splats.saturating_add(in_strip);
            frame.report.max_splats = frame.report.max_splats.max(in_strip);
        }
        let Frame { tally, mut report, .. } = frame;
        report.splats_dropped = report.splats_dropped.saturating_add(tally.n_dropped());
        report.max_splats = report.max_splats.max(tally.max_demand());
        report.scratch_used = saturate(ScratchShape { max_splats: most_in_memory, ..*self.plan.shape() }.scratch_len());
        Ok(report)
    }

    /// The chunks of the tiers that are drawn, each with the number of its first anchor.
    fn planned_chunks(&self) -> impl Iterator<Item = (Chunk<'b>, u32)> + use<'b, A> {
        let n_chunks = self.bundle.up_to_tier(self.plan.n_tiers()).n_chunks;
        let mut n_anchors = 0_u32;
        self.bundle.chunks().take(n_chunks as usize).map(move |chunk| {
            let first = n_anchors;
            n_anchors = n_anchors.saturating_add(chunk.n_anchors().into());
            (chunk, first)
        })
    }

    /// Orders the splats of a strip's slab and draws tile after tile; behind the last slab tiles go to `sink`. Returns whether
    /// more can be seen behind them.
    fn draw(
        &mut self,
        strip: Strip,
        slab: Slab,
        camera: &Camera,
        sink: &mut impl TileSink,
        report: &mut FrameReport,
        watch: &mut impl Stopwatch,
    ) -> bool {
        watch.enter(Stage::Sort);
        let SplatStore { splats, rects, n, order, spare, counts } = &mut self.splats;
        let n = *n as usize;
        let (Some(splats), Some(rects)) = (splats.get(..n), rects.get(..n)) else { return false };
        let (Some(order), Some(spare)) = (order.get_mut(..n), spare.get_mut(..n)) else { return false };
        let (order, row_list) = sort_by_depth::<A>(splats, order, spare, counts);
        // One after the other, or all at once.
        let keeps_tiles = self.plan.shape().canvas_tiles > 1;
        let (mut n_tiles, mut alive) = (0, 0);
        let rule = BlendRule::of(self.plan.budget().quality);
        let header = self.bundle.header();
        let has_background = cfg!(feature = "background") && header.features.effects.background;
        let background = has_background.then(|| header.background.map(|byte| f32::from(byte) / 255.0));
        let rows = (0..).zip(tiles_along(camera.height_px));
        for (row, (y_px, height)) in rows.take(strip.end_row.into()).skip(strip.first_row.into()) {
            watch.enter(Stage::Sort);
            let list = gather_row(order, rects, row, row_list);
            for (column, (x_px, width)) in (0..).zip(tiles_along(camera.width_px)) {
                watch.enter(Stage::Blend);
                let place = TilePlace { column, row, width, height };
                let Some(pixels) = self.pixels.chunks_exact_mut(TILE_PIXELS).nth(if keeps_tiles { n_tiles } else { 0 })
                else {
                    return false;
                };
                n_tiles += 1;
                if slab.from == 0.0 {
                    pixels.fill(EMPTY);
                }
                let work = blend_tile::<A>(place, splats, rects, list, &rule, pixels);
                alive += work.alive;
                report.tile_splats = report.tile_splats.saturating_add(work.splats);
                report.row_splats = report.row_splats.saturating_add(work.rows);
                report.pixel_splats = report.pixel_splats.saturating_add(work.pixels);
                if !slab.ends() {
                    finish_tile::<A::Colours>(place, pixels, background, self.rgb);
                    let n_pixels = usize::from(width) * usize::from(height);
                    watch.enter(Stage::Output);
                    sink.tile(x_px, y_px, width, height, self.rgb.get(..n_pixels).unwrap_or_default());
                }
            }
        }
        alive > 0
    }
}

impl<'b> Bundle<'b> {
    /// The chunks of the first `tiers` tiers that a frame of `camera` needs: those whose ink box it can see, in file order.
    ///
    /// # Errors
    /// [`DecodeError::BadFloat`] or [`DecodeError::OutOfRange`] for an unusable camera.
    ///
    /// # Budget
    /// About 100 multiplications a chunk; reads the directory and no chunk.
    pub fn chunks_in_view(
        &self,
        camera: &Camera,
        tiers: u8,
    ) -> Result<impl Iterator<Item = Chunk<'b>> + use<'b>, DecodeError> {
        let view = View::new(camera)?;
        let n_chunks = self.up_to_tier(tiers.min(self.n_tiers())).n_chunks;
        Ok(self.chunks().take(n_chunks as usize).filter(move |chunk| view.sees_box(chunk.ink_box())))
    }
}

/// Evaluates the Gaussians of the planned tiers into memory of `arena`; works in what the frame will use later.
fn bake_scene<'s>(
    bundle: &Bundle<'_>,
    plan: &Plan,
    arena: &mut Arena<'s>,
    skip_damage: bool,
) -> Result<BakedGaussians<'s>, DecodeError> {
    let ScratchShape { baked_gaussians, baked_chunks, .. } = *plan.shape();
    let memory = BakedMemory {
        records: arena.take(baked_gaussians as usize)?,
        starts: arena.take((baked_chunks as usize).saturating_add(1))?,
    };
    bake(bundle, baked_chunks, memory, plan.shape().heads(), arena, skip_damage)?.finish()
}

/// Converts the heads into memory of `arena`, and prepares where the anchors of the planned tiers come from.
#[inline(never)]
fn take_anchors<'b, 's, N: HeadNumbers>(
    bundle: &Bundle<'b>,
    plan: &Plan,
    arena: &mut Arena<'s>,
    skip_damage: bool,
) -> Result<Anchors<'b, 's, N>, DecodeError> {
    let shape = plan.shape().heads();
    let heads = Heads::convert(arena, bundle.heads(), shape)?;
    let row = arena.take(bundle.header().n_channels())?;
    let work = Workspace::take(arena, shape)?;
    let source = if plan.is_resident() {
        AnchorSource::Resident(decode_anchors(bundle, plan, row, arena, skip_damage)?)
    } else {
        AnchorSource::Streamed(bundle.anchor_models(arena.take(bundle.anchor_scratch_words())?)?)
    };
    Ok(Anchors { source, heads, row, work })
}

/// Decodes the planned tiers into memory of `arena`; their models work in what the frame will use later.
///
/// * `row`: `[n_channels]`, for the symbols of the anchor in work.
fn decode_anchors<'b, 's>(
    bundle: &Bundle<'b>,
    plan: &Plan,
    row: &mut [f32],
    arena: &mut Arena<'s>,
    skip_damage: bool,
) -> Result<AnchorRecords<'b, 's>, DecodeError> {
    let tier = bundle.up_to_tier(plan.n_tiers());
    let n_numbers = bundle.record_layout().len().saturating_mul(tier.n_anchors as usize);
    let memory = RecordMemory {
        records: arena.take(n_numbers)?,
        damaged: arena.take(tier.n_chunks.div_ceil(u32::BITS) as usize)?,
        scales: arena.take(bundle.tables().map_or(0, Tables::len))?,
    };
    let mut free = arena.borrow();
    let mut models = bundle.anchor_models(free.take(bundle.anchor_scratch_words())?)?;
    let row = bytemuck::try_cast_slice_mut(row).unwrap_or_default();
    AnchorRecords::decode(bundle, tier.n_chunks, memory, row, &mut models, skip_damage)
}

/// Splats that the planned memory has places for: as many as planned, or fewer larger ones.
fn places_for<A: Arithmetic>(plan: &Plan) -> u32 {
    let (planned, taken) = (size_of::<PackedSplat>(), size_of::<A::Splat>());
    if taken <= planned {
        return plan.max_splats();
    }
    (u64::from(plan.max_splats()) * planned as u64 / taken as u64) as u32
}

/// First pixel and size of each tile along an axis.
fn tiles_along(size_px: u16) -> impl Iterator<Item = (u16, u16)> {
    (0..size_px).step_by(TILE_PX.into()).map(move |first| (first, TILE_PX.min(size_px - first)))
}

/// Copies the splats that touch tile row `row` from `order` to the front of `list`, in order.
fn gather_row<'l>(order: &[u32], rects: &[TileRect], row: u8, list: &'l mut [u32]) -> &'l [u32] {
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
    list.get(..n).unwrap_or_default()
}
