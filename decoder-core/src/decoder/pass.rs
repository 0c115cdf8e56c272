//! Going over the scene once for a strip, or for a slab of its depth: a few anchors at a time.

use core::iter::Take;
use core::marker::PhantomData;
use core::ops::Range;

use pocketsplat_format::bundle::{Chunk, Chunks, SuspendedReader};
use pocketsplat_format::{DecodeError, Stage, Stopwatch};

use super::collect::{GaussianCollector, SplatCollector, Target};
use super::first_come::FirstCome;
use super::overflow::{CHUNK_LOOKED_AT, Frame, OverflowPolicy, checksum_work};
use super::share::Share;
use super::slab_index::IndexState;
use super::source::{Anchors, GaussianSource};
use super::splats::Slab;
use super::strip::Strip;
use super::{Decoder, FrameReport};
use crate::arithmetic::Arithmetic;
use crate::scene::Anchor;

/// Model instructions after which a pass stops for a while, to go on where it was.
const STEP: u64 = 200_000;

/// A pass that is not complete.
pub(super) struct Pass<'b> {
    pub(super) target: Target,
    /// Whether its chunks are looked up in the index.
    is_indexed: bool,
    chunks: PlannedChunks<'b>,
    open: Option<OpenChunk<'b>>,
}

/// The chunks of the tiers that are drawn, each with the number of its first anchor.
pub(super) struct PlannedChunks<'b> {
    chunks: Take<Chunks<'b>>,
    n_anchors: u32,
}

/// A chunk that was not gone over to its end.
struct OpenChunk<'b> {
    chunk: Chunk<'b>,
    /// Its anchors to come, or its baked Gaussians.
    numbers: Range<u32>,
    /// Where anchors are streamed.
    reader: Option<SuspendedReader<'b>>,
    before: Option<Before>,
}

/// What a chunk that turns out to be damaged is undone to.
struct Before {
    n_splats: u32,
    first_come: Option<FirstCome>,
    report: FrameReport,
}

impl<'b> PlannedChunks<'b> {
    pub(super) fn new(chunks: Chunks<'b>, n_chunks: u32) -> Self {
        Self { chunks: chunks.take(n_chunks as usize), n_anchors: 0 }
    }
}

impl<'b> Iterator for PlannedChunks<'b> {
    type Item = (Chunk<'b>, u32);

    fn next(&mut self) -> Option<(Chunk<'b>, u32)> {
        let chunk = self.chunks.next()?;
        let first = self.n_anchors;
        self.n_anchors = first.saturating_add(chunk.n_anchors().into());
        Some((chunk, first))
    }
}

impl<'b, A: Arithmetic> Decoder<'b, '_, A> {
    /// Empties the splat memory, and begins to fill it with the splats of `strip` from depth `from` on: all of them when there are
    /// places enough, or when splats are left out instead; else those of the slab that there are places for.
    pub(super) fn begin_pass(&mut self, strip: Strip, from: f32, frame: &mut Frame) -> Pass<'b> {
        (self.splats.n, self.splats.most, self.splats.full_at) = (0, 0, None);
        let mut target = Target { strip, slab: Slab::behind(from), band: frame.band(strip), makes_index: false };
        let is_indexed = matches!(frame.policy, OverflowPolicy::Slabs { index: IndexState::Made });
        if is_indexed {
            target.slab.end = self.splats.end_of_slab(strip, from);
        }
        if from > 0.0 || target.slab.ends() {
            target.end_earlier(&frame.view);
        }
        if let OverflowPolicy::Slabs { index: index @ IndexState::Due } = &mut frame.policy {
            (*index, target.band, target.makes_index) = (IndexState::Made, None, true);
        }
        let decodes = u8::from(self.source.is_streamed());
        frame.report.decode_passes = frame.report.decode_passes.saturating_add(decodes);
        Pass { target, is_indexed, chunks: self.planned_chunks(), open: None }
    }

    /// Goes on with a pass for about [`STEP`] model instructions; whether it is complete.
    ///
    /// * `share`: what of the scene it goes over.
    pub(super) fn go_on(
        &mut self,
        pass: &mut Pass<'b>,
        frame: &mut Frame,
        share: &mut impl Share,
        watch: &mut impl Stopwatch,
    ) -> Result<bool, DecodeError> {
        let until = frame.instructions().saturating_add(STEP);
        while frame.instructions() < until {
            if pass.open.is_none() {
                let Some((chunk, first_anchor)) = pass.chunks.next() else {
                    let Slab { n_left_out, .. } = pass.target.slab;
                    frame.report.splats_dropped = frame.report.splats_dropped.saturating_add(n_left_out);
                    return Ok(true);
                };
                watch.enter(Stage::Project);
                if self.is_needed(&chunk, pass, frame) && share.takes(&chunk, self.source.is_streamed()) {
                    self.open(chunk, first_anchor, pass, frame, share, watch);
                }
            }
            let Pass { target, open, .. } = pass;
            let Some(chunk) = open else {
                frame.unreported = frame.unreported.saturating_add(CHUNK_LOOKED_AT);
                continue;
            };
            let end = until.saturating_sub(frame.unreported);
            let outcome = self.go_on_in(chunk, target, frame, end, watch);
            frame.unreported = frame.unreported.saturating_add(core::mem::take(&mut self.splats.work));
            match outcome {
                Ok(true) => {
                    share.end_chunk(&mut self.splats, chunk.chunk.index());
                    *open = None;
                }
                Ok(false) => return Ok(false),
                Err(DecodeError::ChunkStream { .. }) if chunk.before.is_some() => {
                    self.leave_out(&chunk.chunk, chunk.before.as_ref(), target, frame);
                    *open = None;
                }
                Err(error) => return Err(error),
            }
        }
        Ok(false)
    }

    /// Whether a chunk may have splats that the pass draws.
    fn is_needed(&mut self, chunk: &Chunk<'b>, pass: &Pass<'b>, frame: &Frame) -> bool {
        let Target { strip, slab, band, .. } = &pass.target;
        let may_lie_here = match &frame.policy {
            OverflowPolicy::Slabs { .. } if pass.is_indexed => self.splats.may_lie_in(chunk.index(), *strip, slab),
            OverflowPolicy::FirstCome { strips_of_chunks, .. } if strip.index > 0 => {
                strips_of_chunks.may_lie_in(chunk.index(), *strip)
            }
            _ => true,
        };
        let ink_box = chunk.ink_box();
        may_lie_here && frame.view.sees_box(ink_box) && band.as_ref().is_none_or(|band| band.sees_box(ink_box))
    }

    /// Begins with a chunk, unless it is known to be damaged and that is allowed.
    #[inline(never)]
    fn open(
        &mut self,
        chunk: Chunk<'b>,
        first_anchor: u32,
        pass: &mut Pass<'b>,
        frame: &mut Frame,
        share: &impl Share,
        watch: &mut impl Stopwatch,
    ) {
        watch.enter(Stage::Decode);
        // What its splats displaced is gone when strips are drawn in slabs.
        let can_undo = self.skips_damage() && !matches!(frame.policy, OverflowPolicy::Slabs { .. });
        let before = can_undo.then(|| Before {
            n_splats: self.splats.n,
            first_come: frame.policy.first_come(),
            report: frame.report,
        });
        if self.skips_damage() && self.source.is_streamed() {
            frame.unreported = frame.unreported.saturating_add(checksum_work(&chunk));
        }
        if !self.is_sound(&chunk) {
            self.leave_out(&chunk, before.as_ref(), &pass.target, frame);
            return;
        }
        let anchors = first_anchor..first_anchor.saturating_add(chunk.n_anchors().into());
        let (numbers, reader) = match &mut self.source {
            GaussianSource::Baked(baked) if cfg!(feature = "baked") => (baked.numbers_of_chunk(chunk.index()), None),
            GaussianSource::Baked(_) => (0..0, None),
            GaussianSource::Anchors(Anchors { source, evaluator, .. }) => {
                evaluator.discard_waiting();
                let reader = source.open(&chunk);
                let decoded = u32::from(reader.is_some());
                frame.report.chunks_decoded = frame.report.chunks_decoded.saturating_add(decoded);
                (anchors, reader)
            }
        };
        let numbers = if reader.is_some() { numbers } else { share.of(numbers, chunk.index()) };
        pass.open = Some(OpenChunk { chunk, numbers, reader, before });
    }

    /// Undoes what a damaged chunk did, and notes it in the report; nothing where that cannot be undone.
    // Not inlined, here and above: a caller's stack frame would keep what only this needs.
    #[inline(never)]
    fn leave_out(&mut self, chunk: &Chunk<'b>, before: Option<&Before>, target: &Target, frame: &mut Frame) {
        let Some(before) = before else { return };
        let [now, then] = [&frame.report, &before.report].map(|report| report.instructions(frame.cost));
        frame.unreported = frame.unreported.saturating_add(now.saturating_sub(then));
        (self.splats.n, frame.report) = (before.n_splats, before.report);
        if let (OverflowPolicy::FirstCome { first_come, .. }, Some(admitted)) = (&mut frame.policy, before.first_come) {
            *first_come = admitted;
        }
        // Once a frame.
        let mut earlier = frame.strips.iter().take(target.strip.index.into());
        if !earlier.any(|strip| frame.needs(strip, chunk)) {
            frame.report.chunks_damaged += 1;
        }
        let first = frame.report.first_damaged.map_or(chunk.index(), |first| first.min(chunk.index()));
        frame.report.first_damaged = Some(first);
    }

    /// Keeps the splats of a chunk that the pass draws, until the report comes to `end` model instructions; whether that is the
    /// chunk's end.
    fn go_on_in(
        &mut self,
        open: &mut OpenChunk<'b>,
        target: &mut Target,
        frame: &mut Frame,
        end: u64,
        watch: &mut impl Stopwatch,
    ) -> Result<bool, DecodeError> {
        let Self { bundle, source, splats, .. } = self;
        let Frame { view, strips, policy, report, cost, .. } = frame;
        let header = bundle.header();
        let effects = header.features.effects;
        let splats = SplatCollector { view, strips, policy, target, splats, chunk: open.chunk.index() };
        // As if its Gaussians were baked, which know nothing of the anchor's extent.
        let as_baked = bundle.n_gaussians(0).is_some();
        let mut gaussians =
            GaussianCollector { splats, report, effects, as_baked, functions: PhantomData::<A::Functions> };
        let OpenChunk { numbers, reader, .. } = open;
        let Anchors { source, row, evaluator } = match source {
            GaussianSource::Anchors(anchors) => anchors,
            // Unreachable without the feature; this arm drops the code.
            GaussianSource::Baked(_) if !cfg!(feature = "baked") => return Err(DecodeError::Internal),
            GaussianSource::Baked(baked) => {
                watch.enter(Stage::Project);
                let GaussianCollector { splats, report, .. } = &mut gaussians;
                for number in numbers.by_ref() {
                    report.gaussians = report.gaussians.saturating_add(1);
                    let gaussian = baked.gaussian(number, effects).ok_or(DecodeError::Internal)?;
                    if splats.target.band.is_none_or(|band| band.sees_gaussian(&gaussian)) {
                        splats.project::<A::Functions>(number, &gaussian, effects);
                    }
                    if report.instructions(*cost).saturating_add(splats.splats.work) >= end {
                        break;
                    }
                }
                return Ok(numbers.start >= numbers.end);
            }
        };
        let n_scalars = u32::from(header.feature_dim) + u32::from(header.n_log_scales());
        let decoded = u32::from(!source.is_resident());
        let is_complete = source.go_on(numbers, reader, row, watch, |number, site, row, watch| {
            watch.enter(Stage::Project);
            let GaussianCollector { splats, report, .. } = &mut gaussians;
            report.anchors_read = report.anchors_read.saturating_add(1);
            report.anchors_decoded = report.anchors_decoded.saturating_add(decoded);
            let n_channels = 3 * site.mask.count_ones() + n_scalars;
            report.symbols_decoded += u64::from(decoded * n_channels);
            let position = bundle.position(site.lattice);
            let anchor =
                Anchor::from_row::<A::Functions>(header, position, site.mask, row).ok_or(DecodeError::Internal)?;
            let is_seen = if cfg!(feature = "baked") && as_baked {
                view.sees_box(anchor.ink_box())
            } else {
                view.sees_anchor(position, anchor.extent)
            };
            if is_seen && splats.target.band.as_ref().is_none_or(|band| band.sees_anchor(&anchor)) {
                report.anchors_visible = report.anchors_visible.saturating_add(1);
                evaluator.visit::<A::Functions>(number, &anchor, (effects, view.eye), watch, &mut gaussians);
            }
            let GaussianCollector { splats, report, .. } = &gaussians;
            Ok(report.instructions(*cost).saturating_add(splats.splats.work) < end)
        })?;
        if is_complete {
            evaluator.finish::<A::Functions>(effects, watch, &mut gaussians);
        }
        Ok(is_complete)
    }
}
