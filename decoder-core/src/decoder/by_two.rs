//! A frame drawn by two painters in two phases: each gathers the splats of half of the scene, then each blends some of the tiles, of the
//! splats of both. Between the phases they wait for each other, within them for nothing.

use core::ops::Range;

use pocketsplat_format::rules::TILE_PX;
use pocketsplat_format::{Bundle, Camera, DecodeError, saturate};

use super::drawing::{gather_row, size_along};
use super::overflow::{OverflowPolicy, check_work};
use super::render_error::RenderError;
use super::share::{Half, Painter};
use super::tile::{Tile, TileSink};
use super::{Decoder, FrameReport};
use crate::arithmetic::Arithmetic;
use crate::project::{PackedSplat, TILE_PIXELS, TileRect};
use crate::raster::{Blending, DIGITS, Pixel, Splats, TileRegion, blend_tile, finish_tile, order_list_by_digit};

/// The bit of the numbers of the second painter's splats.
const OF_SECOND: u32 = 1 << 31;
/// What a tile costs without any splat, in pairs of a tile and a splat.
const EMPTY_TILE: u32 = 8;

/// What a painter took so far.
#[derive(Clone, Copy)]
struct Spent {
    report: FrameReport,
    /// Model instructions that the report does not have.
    unreported: u64,
}

/// The splats that one painter gathered, which both read.
#[derive(Clone, Copy)]
struct Gathered<'d> {
    splats: &'d [PackedSplat],
    rects: &'d [TileRect],
    /// Where those of each chunk end.
    ends: &'d [u32],
}

/// Those of both.
#[derive(Clone, Copy)]
struct OfBoth<'d>([Gathered<'d>; 2]);

/// What a painter blends with.
struct Palette<'d> {
    order: &'d mut [u32],
    spare: &'d mut [u32],
    counts: &'d mut [u32],
    pixels: &'d mut [Pixel],
    rgb: &'d mut [[u8; 3]],
}

/// What is the same for both.
struct Canvas<'d, 'b> {
    bundle: &'d Bundle<'b>,
    size_px: [u16; 2],
    alpha_cut: u8,
    most_work: u64,
}

impl<A: Arithmetic> Decoder<'_, '_, A> {
    /// As [`render_by_two`](Self::render_by_two).
    // Not inlined, here and below: a caller's stack frame would keep what only this needs.
    #[inline(never)]
    pub(super) fn draw_by_two<S>(
        [first, second]: &mut [Self; 2],
        camera: &Camera,
        sinks: [&mut S; 2],
        mut join: impl FnMut(&mut (dyn FnMut() + Send), &mut (dyn FnMut() + Send)),
    ) -> Result<[FrameReport; 2], RenderError<S::Error>>
    where
        S: TileSink + Send,
        S::Error: Send,
    {
        check_pair(first, second)?;
        let [mut by_first, mut by_second] = [(); 2].map(|()| Err(DecodeError::Internal));
        join(&mut || by_first = first.gather(camera, Painter::First), &mut || {
            by_second = second.gather(camera, Painter::Second);
        });
        let (mut of_first, mut of_second) = (by_first?, by_second?);
        // Both have as many places.
        let most = of_first.report.splats.max(of_second.report.splats);
        for spent in [&mut of_first, &mut of_second] {
            spent.report.scratch_used = saturate(first.plan.len_with_splats(most));
        }
        let budget = *first.plan.budget();
        let canvas = Canvas {
            bundle: &first.bundle.clone(),
            size_px: [camera.width_px, camera.height_px],
            alpha_cut: budget.quality.alpha_cut,
            most_work: budget.most_work,
        };
        let ((gathered_first, mut palette), (gathered_second, mut second_palette)) = (first.parts(), second.parts());
        let both = OfBoth([gathered_first, gathered_second]);
        // A frame has 255 rows and columns at most.
        let [n_columns, n_rows] = canvas.size_px.map(|size_px| size_px.div_ceil(TILE_PX) as u8);
        let middle = both.middle([n_columns, n_rows], palette.counts);
        let n_tiles = u32::from(n_columns) * u32::from(n_rows);
        let [sink, second_sink] = sinks;
        let [mut by_first, mut by_second] = [(); 2].map(|()| Err(DecodeError::Internal.into()));
        join(
            &mut || by_first = paint::<A, S>(&canvas, both, 0..middle, &mut palette, &mut of_first, sink),
            &mut || {
                by_second =
                    paint::<A, S>(&canvas, both, middle..n_tiles, &mut second_palette, &mut of_second, second_sink);
            },
        );
        by_first.and(by_second)?;
        Ok([of_first.report, of_second.report])
    }

    /// Gathers the splats of half of the scene.
    #[inline(never)]
    fn gather(&mut self, camera: &Camera, painter: Painter) -> Result<Spent, DecodeError> {
        let view = self.view_of(camera)?;
        self.splats.ends.fill(0);
        let mut frame = self.begin_frame(camera, view).frame;
        let strip = frame.strips.between(0, frame.strips.len());
        let mut pass = self.begin_pass(strip, 0.0, &mut frame);
        let mut share = Half::of(painter);
        loop {
            let is_complete = self.go_on(&mut pass, &mut frame, &mut share, &mut ())?;
            check_work(frame.instructions(), self.plan.budget().most_work)?;
            if is_complete {
                break;
            }
        }
        let n = self.splats.n;
        let mut report = frame.report;
        (report.slabs, report.splats, report.strip_splats) = (1, n, n);
        if let OverflowPolicy::FirstCome { first_come, .. } = &frame.policy {
            (report.splats_dropped, report.max_splats) = (first_come.n_dropped(), first_come.max_demand());
        }
        if painter == Painter::Second && !self.source.is_streamed() {
            // The first one has looked at the same chunks.
            report.chunks_damaged = 0;
        }
        Ok(Spent { report, unreported: frame.unreported })
    }

    /// What it gathered, and what it blends with.
    fn parts(&mut self) -> (Gathered<'_>, Palette<'_>) {
        let Self { splats: store, pixels, rgb, .. } = self;
        let n = store.n as usize;
        let gathered = Gathered {
            splats: store.splats.get(..n).unwrap_or_default(),
            rects: store.rects.get(..n).unwrap_or_default(),
            ends: store.ends,
        };
        (gathered, Palette { order: store.order, spare: store.spare, counts: store.counts, pixels, rgb })
    }
}

impl Splats for OfBoth<'_> {
    #[inline(always)]
    fn splat(&self, number: u32) -> Option<(&TileRect, &PackedSplat)> {
        let Gathered { splats, rects, .. } = self.of(number);
        let index = (number & !OF_SECOND) as usize;
        let (Some(rect), Some(splat)) = (rects.get(index), splats.get(index)) else { return None };
        Some((rect, splat))
    }

    #[inline(always)]
    fn rect(&self, number: u32) -> Option<&TileRect> {
        self.of(number).rects.get((number & !OF_SECOND) as usize)
    }
}

impl<'d> OfBoth<'d> {
    /// Whose splat a number is.
    #[inline(always)]
    fn of(&self, number: u32) -> &Gathered<'d> {
        let [first, second] = &self.0;
        if number & OF_SECOND == 0 { first } else { second }
    }

    /// How many tiles of a frame of `n_rows` of `n_columns` the first painter blends, row by row from the top, so that both have about as much to do.
    ///
    /// * `counts`: [`N_RADIX`](crate::raster::N_RADIX) entries; a frame has 255 rows and columns at most.
    fn middle(&self, [n_columns, n_rows]: [u8; 2], counts: &mut [u32]) -> u32 {
        let rects = || self.0.iter().flat_map(|gathered| gathered.rects);
        let row_costs = counts.get_mut(..n_rows.into()).unwrap_or_default();
        row_costs.fill(EMPTY_TILE.saturating_mul(n_columns.into()));
        for rect in rects() {
            let n = u32::from(rect.last_column - rect.first_column) + 1;
            let rows = usize::from(rect.first_row)..=rect.last_row.into();
            row_costs.get_mut(rows).unwrap_or_default().iter_mut().for_each(|cost| *cost = cost.saturating_add(n));
        }
        let mut left = row_costs.iter().fold(0_u32, |sum, cost| sum.saturating_add(*cost)) / 2;
        let row = n_within(row_costs, &mut left);
        let column_costs = counts.get_mut(..n_columns.into()).unwrap_or_default();
        column_costs.fill(EMPTY_TILE);
        for rect in rects().filter(|rect| (rect.first_row..=rect.last_row).contains(&row)) {
            let columns = usize::from(rect.first_column)..=rect.last_column.into();
            column_costs
                .get_mut(columns)
                .unwrap_or_default()
                .iter_mut()
                .for_each(|cost| *cost = cost.saturating_add(1));
        }
        u32::from(row) * u32::from(n_columns) + u32::from(n_within(column_costs, &mut left))
    }

    /// Lists the splats of some rows of tiles in the order of the file; returns how many.
    #[inline(never)]
    fn list(&self, rows: &Range<u8>, list: &mut [u32]) -> usize {
        let [first, second] = self.0;
        let (mut slots, mut from) = (list.iter_mut(), [0; 2]);
        let mut n = 0;
        for (chunk, ends) in (0..).zip(first.ends.iter().zip(second.ends)) {
            let of_first = (0, first.rects, *ends.0, 0);
            let of_second = (1, second.rects, *ends.1, OF_SECOND);
            let in_order = match Painter::ahead_in(chunk) {
                Painter::First => [of_first, of_second],
                Painter::Second => [of_second, of_first],
            };
            for (painter, rects, end, bit) in in_order {
                let Some(from) = from.get_mut(painter) else { continue };
                for number in *from..end {
                    let Some(rect) = rects.get(number as usize) else { break };
                    if rect.first_row < rows.end
                        && rect.last_row >= rows.start
                        && let Some(slot) = slots.next()
                    {
                        *slot = number | bit;
                        n += 1;
                    }
                }
                *from = end.max(*from);
            }
        }
        n
    }
}

/// Whether two decoders were made as painters of one scene.
fn check_pair<'b, 's, A: Arithmetic>(
    first: &Decoder<'b, 's, A>,
    second: &Decoder<'b, 's, A>,
) -> Result<(), DecodeError> {
    let both = [first, second];
    let is_pair = both.iter().all(|painter| painter.plan.budget().two_painters) && first.plan.draws_as(&second.plan);
    let [needed, planned] = both.map(|painter| painter.plan.len());
    if is_pair { Ok(()) } else { Err(DecodeError::PlanMismatch { needed, planned }) }
}

/// How many of the first `costs` sum up to no more than `left`, of which they are taken.
fn n_within(costs: &[u32], left: &mut u32) -> u8 {
    let within = costs.iter().take_while(|cost| {
        let fits = **cost <= *left;
        if fits {
            *left -= **cost;
        }
        fits
    });
    // There are 255 at most.
    within.count() as u8
}

/// Blends some tiles, which are numbered row by row.
#[inline(never)]
fn paint<A: Arithmetic, S: TileSink>(
    canvas: &Canvas<'_, '_>,
    both: OfBoth<'_>,
    tiles: Range<u32>,
    palette: &mut Palette<'_>,
    spent: &mut Spent,
    sink: &mut S,
) -> Result<(), RenderError<S::Error>> {
    let [width_px, height_px] = canvas.size_px;
    let Palette { order, spare, counts, pixels, rgb } = palette;
    let n_columns = u32::from(width_px.div_ceil(TILE_PX)).max(1);
    let rows = (tiles.start / n_columns) as u8..tiles.end.div_ceil(n_columns) as u8;
    let n = both.list(&rows, order);
    let too_few = || DecodeError::Internal;
    let (mut order, mut spare) = (order.get_mut(..n).ok_or_else(too_few)?, spare.get_mut(..n).ok_or_else(too_few)?);
    for shift in DIGITS {
        if order_list_by_digit(&both, order, spare, counts, shift) {
            core::mem::swap(&mut order, &mut spare);
        }
    }
    let pixels = pixels.get_mut(..TILE_PIXELS).ok_or_else(too_few)?;
    let rule = A::Blending::rule(canvas.alpha_cut);
    let header = canvas.bundle.header();
    let has_background = header.features.effects.background;
    let background = has_background.then(|| header.background.map(|byte| f32::from(byte) / 255.0));
    let cost = canvas.bundle.model_cost();
    for row in rows {
        let n_in_row = gather_row(order, both, row, spare);
        let first = u32::from(row) * n_columns;
        let columns = tiles.start.saturating_sub(first)..tiles.end.saturating_sub(first).min(n_columns);
        for column in columns.start as u8..columns.end as u8 {
            let place =
                TileRegion { column, row, width: size_along(width_px, column), height: size_along(height_px, row) };
            pixels.fill(A::Blending::EMPTY);
            let mut list = spare.get(..n_in_row).unwrap_or_default();
            let report = &mut spent.report;
            loop {
                let work = blend_tile::<A::Blending>(place, both, list, &rule, pixels);
                report.tile_splats = report.tile_splats.saturating_add(work.splats);
                report.row_splats = report.row_splats.saturating_add(work.rows);
                report.pixel_splats = report.pixel_splats.saturating_add(work.pixels);
                check_work(report.instructions(cost).saturating_add(spent.unreported), canvas.most_work)?;
                list = list.get(work.listed..).unwrap_or_default();
                if list.is_empty() {
                    break;
                }
            }
            finish_tile::<A::Blending>(place, pixels, background, rgb);
            let [x_px, y_px] = [column, row].map(|index| u16::from(index) * TILE_PX);
            let TileRegion { width, height, .. } = place;
            let rgb = rgb.get_mut(..usize::from(width) * usize::from(height)).unwrap_or_default();
            sink.tile(Tile { x_px, y_px, width, height, rgb }).map_err(RenderError::Sink)?;
        }
    }
    Ok(())
}
