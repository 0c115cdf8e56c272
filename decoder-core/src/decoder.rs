//! The façade: a bundle, a plan and the caller's memory bound together, drawing frames.

use crate::budget::{Arena, Plan};
use crate::bundle::{AnchorModels, Bundle, Chunk, saturate};
use crate::camera::Camera;
use crate::error::{DecodeError, Field};
use crate::mlp::{self, Heads};
use crate::project::{Splat, View};
use crate::raster::{Canvas, N_RADIX, TILE_PIXELS, TILE_PX, TilePlace, TileRect, blend_tile, sort_by_depth};
use crate::scene::{Anchor, Workspace, for_each_gaussian};

/// Takes finished tiles, for instance to a display.
pub trait TileSink {
    /// One tile: its first pixel, its size, and `[height, width]` pixels row by row.
    ///
    /// Tiles come in rows from the top, each row from the left; together they fill the frame, none twice.
    fn tile(&mut self, x_px: u16, y_px: u16, width: u16, height: u16, rgb: &[[u8; 3]]);
}

/// What a frame consisted of and what it cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FrameReport {
    /// Chunks whose ink box the camera sees.
    pub chunks_decoded: u32,
    /// Damaged chunks among those, which were left out; always 0 unless bound with
    /// [`Decoder::bind_skipping_damage`].
    pub chunks_damaged: u32,
    /// The first of them.
    pub first_damaged: Option<u32>,
    /// Anchors in them.
    pub anchors_decoded: u32,
    /// Anchors that passed the prefilter, so that their heads ran.
    pub anchors_visible: u32,
    /// Splats drawn; the number to plan for.
    pub splats: u32,
    /// Pairs of a tile and a splat blended into it.
    pub tile_splats: u32,
    /// Pairs of a pixel and a splat evaluated for it.
    pub pixel_splats: u32,
}

/// Draws frames of one bundle with the memory it was bound to.
pub struct Decoder<'b, 's> {
    bundle: Bundle<'b>,
    plan: Plan,
    skip_damage: bool,
    heads: Heads<'s>,
    models: AnchorModels<'b, 's>,
    /// `[n_channels]` of the anchor in work.
    row: &'s mut [f32],
    work: Workspace<'s>,
    counts: &'s mut [u32],
    canvas: Canvas<'s>,
    splats: SplatStore<'s>,
    order: &'s mut [u32],
    spare: &'s mut [u32],
}

impl<'b, 's> Decoder<'b, 's> {
    /// Takes `scratch`, converts the heads' weights into it and compares the checksum of every chunk of the planned tiers.
    ///
    /// # Errors
    /// [`DecodeError::ScratchTooSmall`] names the bytes needed; [`DecodeError::PlanMismatch`] when `plan` is another
    /// bundle's; [`DecodeError::ChunkChecksum`] names the damaged chunk.
    ///
    /// # Budget
    /// Exactly [`Plan::scratch_len`] bytes of `scratch`; reads the whole bundle once, about 8 instructions a byte.
    pub fn bind(bundle: &Bundle<'b>, plan: Plan, scratch: &'s mut [u8]) -> Result<Self, DecodeError> {
        let decoder = Self::bind_unchecked(bundle, plan, scratch, false)?;
        for chunk in decoder.planned_chunks() {
            chunk.check()?;
        }
        Ok(decoder)
    }

    /// As [`bind`](Self::bind), but leaves checksums for later: each frame compares those of the chunks it needs, leaves
    /// damaged chunks out and says so in its report.
    ///
    /// # Errors
    /// [`DecodeError::ScratchTooSmall`] and [`DecodeError::PlanMismatch`] as for [`bind`](Self::bind).
    ///
    /// # Budget
    /// As for [`bind`](Self::bind); about 8 instructions a byte of the chunks in view are added to every frame.
    pub fn bind_skipping_damage(bundle: &Bundle<'b>, plan: Plan, scratch: &'s mut [u8]) -> Result<Self, DecodeError> {
        Self::bind_unchecked(bundle, plan, scratch, true)
    }

    fn bind_unchecked(
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
        let available = scratch.len();
        let Some((scratch, _)) = scratch.split_at_mut_checked(plan.scratch_len()) else {
            let needed = saturate(plan.scratch_len());
            return Err(DecodeError::ScratchTooSmall { needed, available: saturate(available) });
        };
        let header = bundle.header();
        let n_splats = plan.max_splats() as usize;
        let mut arena = Arena::new(scratch);
        // The order of `Bundle::scratch_words`.
        Ok(Self {
            bundle: *bundle,
            plan,
            skip_damage,
            heads: Heads::convert(&mut arena, bundle.heads())?,
            models: bundle.anchor_models(arena.take(bundle.anchor_scratch_words())?)?,
            row: arena.take(header.n_channels())?,
            work: Workspace {
                inputs: arena.take(header.head_inputs())?,
                hidden: arena.take(mlp::hidden_len(header))?,
                detail_sums: arena.take(mlp::sums_len(header))?,
            },
            counts: arena.take(N_RADIX)?,
            canvas: Canvas { pixels: arena.take(TILE_PIXELS)?, rgb: arena.take(TILE_PIXELS)? },
            splats: SplatStore { splats: arena.take(n_splats)?, rects: arena.take(n_splats)?, n: 0 },
            order: arena.take(n_splats)?,
            spare: arena.take(n_splats)?,
        })
    }

    /// The bundle it draws.
    #[must_use]
    pub fn bundle(&self) -> &Bundle<'b> {
        &self.bundle
    }

    /// Draws the scene as `camera` sees it and hands it to `sink` tile by tile.
    ///
    /// Nothing reaches the sink unless the whole frame can be drawn.
    ///
    /// # Errors
    /// [`DecodeError::TooManySplats`] names how many splats this view needs; [`DecodeError::OutOfRange`] for a frame
    /// larger than planned; [`DecodeError::BadFloat`] for an unusable camera; [`DecodeError::ChunkStream`] for a chunk
    /// that no writer makes.
    ///
    /// # Budget
    /// No memory beyond the bound one, under 3 KiB of stack. Work: every anchor of a chunk in view is decoded, the heads
    /// run for anchors that pass the prefilter, and a pixel is finished when its transmittance falls below 1e-4.
    pub fn render(&mut self, camera: &Camera, sink: &mut impl TileSink) -> Result<FrameReport, DecodeError> {
        let view = View::new(camera)?;
        let budget = *self.plan.budget();
        for (field, found, limit) in [
            (Field::FrameWidth, camera.width_px, budget.width_px),
            (Field::FrameHeight, camera.height_px, budget.height_px),
        ] {
            if found > limit {
                return Err(DecodeError::OutOfRange { field, found: found.into(), limit: limit.into() });
            }
        }
        let mut report = FrameReport::default();
        self.splats.n = 0;
        for chunk in self.planned_chunks() {
            if view.sees_box(chunk.ink_box()) {
                self.project_sound_chunk(&chunk, &view, &mut report)?;
            }
        }
        report.splats = self.splats.n;
        if self.splats.n > self.plan.max_splats() {
            let planned = self.plan.max_splats();
            return Err(DecodeError::TooManySplats { needed: self.splats.n, planned });
        }
        self.draw(camera, sink, &mut report);
        Ok(report)
    }

    /// The chunks of the tiers that are drawn.
    fn planned_chunks(&self) -> impl Iterator<Item = Chunk<'b>> + use<'b> {
        let n_chunks = self.bundle.up_to_tier(self.plan.n_tiers()).n_chunks;
        self.bundle.chunks().take(n_chunks as usize)
    }

    /// Keeps the splats of a chunk, or none of them and a note in the report if it is damaged and that is allowed.
    fn project_sound_chunk(
        &mut self,
        chunk: &Chunk<'b>,
        view: &View,
        report: &mut FrameReport,
    ) -> Result<(), DecodeError> {
        report.chunks_decoded += 1;
        if !self.skip_damage {
            return self.project_chunk(chunk, view, report);
        }
        let (n_splats, before) = (self.splats.n, *report);
        let result = match chunk.check() {
            Ok(()) => self.project_chunk(chunk, view, report),
            Err(error) => Err(error),
        };
        match result {
            Err(DecodeError::ChunkChecksum { chunk, .. } | DecodeError::ChunkStream { chunk, .. }) => {
                self.splats.n = n_splats;
                *report = before;
                report.chunks_damaged += 1;
                report.first_damaged = report.first_damaged.or(Some(chunk));
                Ok(())
            }
            result => result,
        }
    }

    /// Decodes a chunk and keeps the splats of its anchors.
    fn project_chunk(&mut self, chunk: &Chunk<'b>, view: &View, report: &mut FrameReport) -> Result<(), DecodeError> {
        let header = self.bundle.header();
        let effects = header.features.effects;
        let mut anchors = chunk.anchors(&mut self.models);
        for _ in 0..chunk.n_anchors() {
            report.anchors_decoded += 1;
            let site = anchors.site();
            let position = self.bundle.position(site.lattice);
            anchors.values(self.row);
            let anchor = Anchor::from_row(header, position, site.mask, self.row).ok_or(DecodeError::Internal)?;
            if !view.sees_anchor(position, anchor.extent) {
                continue;
            }
            report.anchors_visible += 1;
            for_each_gaussian(&anchor, effects, view.eye, &self.heads, &mut self.work, |gaussian| {
                if let Some((splat, rect)) = view.project(gaussian, effects.dilation_compensation) {
                    self.splats.push(splat, rect);
                }
            });
        }
        anchors.finish()
    }

    /// Orders the splats and draws tile after tile.
    fn draw(&mut self, camera: &Camera, sink: &mut impl TileSink, report: &mut FrameReport) {
        let n = self.splats.n as usize;
        let (Some(splats), Some(rects)) = (self.splats.splats.get(..n), self.splats.rects.get(..n)) else { return };
        let (Some(order), Some(spare)) = (self.order.get_mut(..n), self.spare.get_mut(..n)) else { return };
        let (order, row_list) = sort_by_depth(splats, order, spare, self.counts);
        let background = self.bundle.header().background.map(|byte| f32::from(byte) / 255.0);
        for (row, (y_px, height)) in (0..).zip(tiles_along(camera.height_px)) {
            let list = gather_row(order, rects, row, row_list);
            for (column, (x_px, width)) in (0..).zip(tiles_along(camera.width_px)) {
                let place = TilePlace { column, row, width, height };
                let work = blend_tile(place, splats, rects, list, background, &mut self.canvas);
                report.tile_splats = report.tile_splats.saturating_add(work.splats);
                report.pixel_splats = report.pixel_splats.saturating_add(work.pixels);
                let n_pixels = usize::from(width) * usize::from(height);
                sink.tile(x_px, y_px, width, height, self.canvas.rgb.get(..n_pixels).unwrap_or_default());
            }
        }
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

/// The splats of the frame in work; counts on when full, to tell how many there are.
struct SplatStore<'s> {
    splats: &'s mut [Splat],
    rects: &'s mut [TileRect],
    n: u32,
}

impl SplatStore<'_> {
    fn push(&mut self, splat: Splat, rect: TileRect) {
        let slot = self.n as usize;
        if let (Some(splat_slot), Some(rect_slot)) = (self.splats.get_mut(slot), self.rects.get_mut(slot)) {
            *splat_slot = splat;
            *rect_slot = rect;
        }
        self.n = self.n.saturating_add(1);
    }
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
