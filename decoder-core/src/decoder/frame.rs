//! Drawing a frame: strip after strip, slab after slab, tile after tile.

use super::gather::{Admission, Frame};
use super::splats::{Slab, SplatStore};
use super::strip::{Strip, StripLayout};
use super::tally::Tally;
use super::{Decoder, FrameReport, TileSink};
use crate::arithmetic::Arithmetic;
use crate::budget::Overflow;
use crate::camera::Camera;
use crate::error::{Field, RenderError, in_range, saturate};
use crate::project::{TILE_PIXELS, TileRect, View};
use crate::raster::{BlendRule, EMPTY, TilePlace, blend_tile, finish_tile, sort_by_depth};
use crate::rules::TILE_PX;
use crate::stopwatch::{Stage, Stopwatch};

impl<A: Arithmetic> Decoder<'_, '_, A> {
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
        let budget = *self.plan.budget();
        let view = View::new(camera)?.cutting_at(budget.quality.alpha_cut);
        in_range(Field::FrameWidth, camera.width_px.into(), 1, budget.width_px.into())?;
        in_range(Field::FrameHeight, camera.height_px.into(), 1, budget.height_px.into())?;
        let strips = StripLayout::new(camera.height_px, self.plan.n_strips());
        let admission = if budget.overflow == Overflow::Slabs {
            Admission::Slab
        } else if strips.len() > 1 && self.surely_fits(&view, strips) {
            Admission::All
        } else {
            Admission::Tally(Tally::new(self.splats.places()))
        };
        let mut frame = Frame { view, strips, admission, report: FrameReport::default() };
        if self.skip_damage && matches!(admission, Admission::Slab) {
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
                let alive =
                    self.draw(strip, slab, camera, sink, &mut frame.report, watch).map_err(RenderError::Sink)?;
                if !slab.ends() {
                    break;
                }
                from = slab.end;
                if !alive {
                    // Nothing behind can be seen: the strip goes out as it is.
                    self.splats.n = 0;
                    self.draw(strip, Slab::behind(from), camera, sink, &mut frame.report, watch)
                        .map_err(RenderError::Sink)?;
                    break;
                }
            }
            frame.report.strip_splats = frame.report.strip_splats.saturating_add(in_strip);
            frame.report.max_splats = frame.report.max_splats.max(in_strip);
        }
        let Frame { admission, mut report, .. } = frame;
        if let Admission::Tally(tally) = admission {
            report.splats_dropped = report.splats_dropped.saturating_add(tally.n_dropped());
            report.max_splats = report.max_splats.max(tally.max_demand());
        }
        report.scratch_used = saturate(self.plan.shape().with_splats(most_in_memory).scratch_len());
        Ok(report)
    }

    /// Orders the splats of a strip's slab and draws tile after tile; behind the last slab tiles go to `sink`. Returns whether
    /// more can be seen behind them.
    ///
    /// # Errors
    /// The sink's.
    fn draw<S: TileSink>(
        &mut self,
        strip: Strip,
        slab: Slab,
        camera: &Camera,
        sink: &mut S,
        report: &mut FrameReport,
        watch: &mut impl Stopwatch,
    ) -> Result<bool, S::Error> {
        watch.enter(Stage::Sort);
        let SplatStore { splats, rects, n, order, spare, counts } = &mut self.splats;
        let n = *n as usize;
        let (Some(splats), Some(rects)) = (splats.get(..n), rects.get(..n)) else { return Ok(false) };
        let (Some(order), Some(spare)) = (order.get_mut(..n), spare.get_mut(..n)) else { return Ok(false) };
        let (order, row_list) = sort_by_depth(splats, order, spare, counts);
        // One after the other, or all at once.
        let keeps_tiles = self.plan.shape().frame.canvas_tiles > 1;
        let (mut n_tiles, mut alive) = (0, 0);
        let quality = self.plan.budget().quality;
        let rule = BlendRule::new(quality.alpha_cut, quality.transmittance_stop);
        let header = self.bundle.header();
        let has_background = header.features.effects.background;
        let background = has_background.then(|| header.background.map(|byte| f32::from(byte) / 255.0));
        // A frame has 255 rows and columns at most.
        for row in strip.first_row as u8..strip.end_row as u8 {
            let (y_px, height) = tile_along(camera.height_px, row);
            watch.enter(Stage::Sort);
            let list = gather_row(order, rects, row, row_list);
            for column in 0..camera.width_px.div_ceil(TILE_PX) as u8 {
                let (x_px, width) = tile_along(camera.width_px, column);
                watch.enter(Stage::Blend);
                let place = TilePlace { column, row, width, height };
                let Some(pixels) = self.pixels.chunks_exact_mut(TILE_PIXELS).nth(if keeps_tiles { n_tiles } else { 0 })
                else {
                    return Ok(false);
                };
                n_tiles += 1;
                if slab.from == 0.0 {
                    pixels.fill(EMPTY);
                }
                let work = blend_tile::<A::Functions, _>(place, splats, rects, list, &rule, pixels);
                alive += work.alive;
                report.tile_splats = report.tile_splats.saturating_add(work.splats);
                report.row_splats = report.row_splats.saturating_add(work.rows);
                report.pixel_splats = report.pixel_splats.saturating_add(work.pixels);
                if !slab.ends() {
                    finish_tile(place, pixels, background, self.rgb);
                    let n_pixels = usize::from(width) * usize::from(height);
                    watch.enter(Stage::Output);
                    sink.tile(x_px, y_px, width, height, self.rgb.get(..n_pixels).unwrap_or_default())?;
                }
            }
        }
        Ok(alive > 0)
    }
}

/// First pixel and size of a tile along an axis that it lies in.
fn tile_along(size_px: u16, index: u8) -> (u16, u16) {
    let first_px = u16::from(index) * TILE_PX;
    (first_px, TILE_PX.min(size_px.saturating_sub(first_px)))
}

/// Copies the splats that touch tile row `row` from `order` to the front of `list`, in order.
// Not inlined: its loop would not stay in registers.
#[inline(never)]
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
