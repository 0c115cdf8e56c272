//! From the anchors in view to the splats of one strip, or of a slab of its depth.

use core::marker::PhantomData;

use pocketsplat_format::bundle::{Chunk, Effects};
use pocketsplat_format::{DecodeError, Stage, Stopwatch};

use super::first_come::{FirstCome, splat_order};
use super::slab_index::IndexState;
use super::source::{AnchorSource, Anchors, GaussianSource};
use super::splats::{Slab, SplatStore};
use super::strip::{Strip, StripLayout};
use super::strips_of_chunks::StripsOfChunks;
use super::{Decoder, FrameReport};
use crate::arithmetic::Arithmetic;
use crate::bake::BakedGaussian;
use crate::functions::Functions;
use crate::project::{Band, TileRect, View};
use crate::scene::{Anchor, Gaussian, GaussianSink};

/// The current frame.
pub(super) struct Frame {
    pub(super) view: View,
    pub(super) strips: StripLayout,
    pub(super) policy: OverflowPolicy,
    pub(super) report: FrameReport,
}

/// Which splats are drawn where there may not be places for all.
#[expect(clippy::large_enum_variant, reason = "a frame has one, and there is no allocator to box with")]
pub(super) enum OverflowPolicy {
    /// All: each strip surely has places enough.
    Fits,
    /// Those that have a place in every strip; the first strip goes over the whole scene to find out which, and which strips its chunks
    /// lie in.
    FirstCome { first_come: FirstCome, strips_of_chunks: StripsOfChunks },
    /// All, in slabs of depth, as many as it takes.
    Slabs { index: IndexState },
}

/// Going over the scene once, for a strip.
struct Pass {
    strip: Strip,
    slab: Slab,
    /// What the pass can leave out; nothing when it goes over the whole scene.
    band: Option<Band>,
    /// Whether it makes the index of where splats lie.
    makes_index: bool,
}

impl Pass {
    /// Also leaves out what lies beyond the slab.
    fn end_earlier(&mut self, view: &View) {
        if self.makes_index {
            return;
        }
        let band = self.band.unwrap_or(Band::WHOLE);
        self.band = Some(band.between_depths(view, self.slab.from, self.slab.end));
    }
}

impl OverflowPolicy {
    /// Which splats were counted and admitted so far.
    fn first_come(&self) -> Option<FirstCome> {
        match self {
            Self::FirstCome { first_come, .. } => Some(*first_come),
            Self::Fits | Self::Slabs { .. } => None,
        }
    }
}

impl Frame {
    /// What the pass of a strip has to look at.
    fn band(&self, strip: Strip) -> Option<Band> {
        let whole = strip.end_row - strip.first_row == self.strips.n_rows()
            || (strip.index == 0 && matches!(self.policy, OverflowPolicy::FirstCome { .. }));
        (!whole).then(|| self.view.band(self.strips.pixels(strip)))
    }

    /// Whether the pass of a strip needs a chunk.
    fn needs(&self, strip: Strip, chunk: &Chunk<'_>) -> bool {
        self.band(strip).is_none_or(|band| band.sees_box(chunk.ink_box()))
    }
}

impl<'b, A: Arithmetic> Decoder<'b, '_, A> {
    /// Whether each strip surely has a place for all of its splats: all baked Gaussians, or all offsets of all anchors, of the
    /// chunks it sees.
    ///
    /// # Budget
    /// About 100 multiplications a chunk and strip; reads the directory alone.
    pub(super) fn surely_fits(&self, view: &View, strips: StripLayout) -> bool {
        let n_offsets = u64::from(self.bundle.header().n_offsets);
        strips.iter().all(|strip| {
            let band = view.band(strips.pixels(strip));
            let seen = self.planned_chunks().map(|(chunk, _)| chunk);
            let seen = seen.filter(|chunk| view.sees_box(chunk.ink_box()) && band.sees_box(chunk.ink_box()));
            let most_of = |chunk: Chunk<'_>| match &self.source {
                GaussianSource::Baked(baked) if cfg!(feature = "baked") => baked.n_of_chunk(chunk.index()).into(),
                _ => u64::from(chunk.n_anchors()).saturating_mul(n_offsets),
            };
            let most: u64 = seen.map(most_of).sum();
            most <= self.splats.places().into()
        })
    }

    /// Notes the damaged chunks in view, before strips are drawn in slabs, whose passes look at a chunk any number of times.
    pub(super) fn note_damage(&self, frame: &mut Frame) {
        let in_view =
            self.planned_chunks().map(|(chunk, _)| chunk).filter(|chunk| frame.view.sees_box(chunk.ink_box()));
        for chunk in in_view.filter(|chunk| !self.is_sound(chunk)) {
            frame.report.chunks_damaged += 1;
            frame.report.first_damaged = frame.report.first_damaged.or(Some(chunk.index()));
        }
    }

    /// Whether a chunk is known to be undamaged, or damage is an error.
    fn is_sound(&self, chunk: &Chunk<'b>) -> bool {
        match &self.source {
            GaussianSource::Baked(baked) => !(cfg!(feature = "baked") && baked.is_damaged(chunk.index())),
            GaussianSource::Anchors(Anchors { source: AnchorSource::Resident(records), .. }) => {
                !records.is_damaged(chunk.index())
            }
            GaussianSource::Anchors(_) => !self.skips_damage() || chunk.check().is_ok(),
        }
    }

    /// Fills the splat memory with the splats of `strip` from depth `from` on, and returns the slab that they fill: all of
    /// the rest when there are places enough, or when splats are left out instead.
    ///
    /// * `strip`: ends earlier afterwards if it was several and there is no room for all of them.
    pub(super) fn gather(
        &mut self,
        strip: &mut Strip,
        from: f32,
        frame: &mut Frame,
        watch: &mut impl Stopwatch,
    ) -> Result<Slab, DecodeError> {
        (self.splats.n, self.splats.most) = (0, 0);
        let mut pass = Pass { strip: *strip, slab: Slab::behind(from), band: frame.band(*strip), makes_index: false };
        let is_indexed = matches!(frame.policy, OverflowPolicy::Slabs { index: IndexState::Made });
        if is_indexed {
            pass.slab.end = self.splats.end_of_slab(*strip, from);
        }
        if from > 0.0 || pass.slab.ends() {
            pass.end_earlier(&frame.view);
        }
        if let OverflowPolicy::Slabs { index: index @ IndexState::Due } = &mut frame.policy {
            (*index, pass.band, pass.makes_index) = (IndexState::Made, None, true);
        }
        let decodes = u8::from(self.source.is_streamed());
        frame.report.decode_passes = frame.report.decode_passes.saturating_add(decodes);
        for (chunk, first_anchor) in self.planned_chunks() {
            watch.enter(Stage::Project);
            let may_lie_here = match &frame.policy {
                OverflowPolicy::Slabs { .. } if is_indexed => {
                    self.splats.may_lie_in(chunk.index(), pass.strip, &pass.slab)
                }
                OverflowPolicy::FirstCome { strips_of_chunks, .. } if strip.index > 0 => {
                    strips_of_chunks.may_lie_in(chunk.index(), pass.strip)
                }
                _ => true,
            };
            let ink_box = chunk.ink_box();
            let is_seen = || frame.view.sees_box(ink_box) && pass.band.is_none_or(|band| band.sees_box(ink_box));
            if may_lie_here && is_seen() {
                self.gather_sound_chunk(&chunk, first_anchor, &mut pass, frame, watch)?;
            }
        }
        frame.report.splats_dropped = frame.report.splats_dropped.saturating_add(pass.slab.n_left_out);
        *strip = pass.strip;
        Ok(pass.slab)
    }

    /// Keeps the splats of a chunk, or none of them and a note in the report if it is damaged and that is allowed.
    fn gather_sound_chunk(
        &mut self,
        chunk: &Chunk<'b>,
        first_anchor: u32,
        pass: &mut Pass,
        frame: &mut Frame,
        watch: &mut impl Stopwatch,
    ) -> Result<(), DecodeError> {
        watch.enter(Stage::Decode);
        // What its splats displaced is gone when strips are drawn in slabs.
        let can_undo = self.skips_damage() && !matches!(frame.policy, OverflowPolicy::Slabs { .. });
        let before = can_undo.then(|| (self.splats.n, frame.policy.first_come(), frame.report));
        if self.is_sound(chunk) {
            match self.gather_chunk(chunk, first_anchor, pass, frame, watch) {
                Err(DecodeError::ChunkStream { .. }) if can_undo => {}
                result => return result,
            }
        }
        let Some((n_splats, admitted, report)) = before else { return Ok(()) };
        (self.splats.n, frame.report) = (n_splats, report);
        if let (OverflowPolicy::FirstCome { first_come, .. }, Some(admitted)) = (&mut frame.policy, admitted) {
            *first_come = admitted;
        }
        // Once a frame.
        let mut earlier = frame.strips.iter().take(pass.strip.index.into());
        if !earlier.any(|strip| frame.needs(strip, chunk)) {
            frame.report.chunks_damaged += 1;
        }
        let first = frame.report.first_damaged.map_or(chunk.index(), |first| first.min(chunk.index()));
        frame.report.first_damaged = Some(first);
        Ok(())
    }

    /// Keeps the splats of a chunk that lie in the strip.
    fn gather_chunk(
        &mut self,
        chunk: &Chunk<'b>,
        first_anchor: u32,
        pass: &mut Pass,
        frame: &mut Frame,
        watch: &mut impl Stopwatch,
    ) -> Result<(), DecodeError> {
        let Self { bundle, source, splats, .. } = self;
        let Frame { view, strips, policy, report } = frame;
        let header = bundle.header();
        let effects = header.features.effects;
        let splats = SplatCollector { view, strips, policy, pass, splats, chunk: chunk.index() };
        // As if its Gaussians were baked, which know nothing of the anchor's extent.
        let as_baked = bundle.n_gaussians(0).is_some();
        let mut gaussians =
            GaussianCollector { splats, report, effects, as_baked, functions: PhantomData::<A::Functions> };
        let Anchors { source, row, evaluator } = match source {
            GaussianSource::Anchors(anchors) => anchors,
            // Unreachable without the feature; this arm drops the code.
            GaussianSource::Baked(_) if !cfg!(feature = "baked") => return Err(DecodeError::Internal),
            GaussianSource::Baked(baked) => {
                watch.enter(Stage::Project);
                let GaussianCollector { splats, report, .. } = &mut gaussians;
                report.gaussians = report.gaussians.saturating_add(baked.n_of_chunk(chunk.index()));
                for (number, gaussian) in baked.of_chunk(chunk.index(), effects) {
                    if splats.pass.band.is_none_or(|band| band.sees_gaussian(&gaussian)) {
                        splats.project::<A::Functions>(number, &gaussian, effects);
                    }
                }
                return Ok(());
            }
        };
        let n_scalars = u32::from(header.feature_dim) + u32::from(header.n_log_scales());
        let decoded = u32::from(!source.is_resident());
        gaussians.report.chunks_decoded = gaussians.report.chunks_decoded.saturating_add(decoded);
        evaluator.discard_waiting();
        source.for_each(chunk, first_anchor, row, watch, |number, site, row, watch| {
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
            if !is_seen || splats.pass.band.as_ref().is_some_and(|band| !band.sees_anchor(&anchor)) {
                return Ok(());
            }
            report.anchors_visible = report.anchors_visible.saturating_add(1);
            evaluator.visit::<A::Functions>(number, &anchor, (effects, view.eye), watch, &mut gaussians);
            Ok(())
        })?;
        evaluator.finish::<A::Functions>(effects, watch, &mut gaussians);
        Ok(())
    }
}

/// Keeps the splats of anchors.
struct GaussianCollector<'f, 's, F> {
    splats: SplatCollector<'f, 's>,
    report: &'f mut FrameReport,
    effects: Effects,
    /// Whether Gaussians are rounded as baked ones are.
    as_baked: bool,
    functions: PhantomData<F>,
}

impl<F: Functions> GaussianSink for GaussianCollector<'_, '_, F> {
    fn gaussian(&mut self, anchor: u32, offset: usize, gaussian: &Gaussian) {
        self.report.gaussians = self.report.gaussians.saturating_add(1);
        let order = splat_order(anchor, offset);
        // The first half drops the code where no scene is such.
        if cfg!(feature = "baked") && self.as_baked {
            self.splats.project::<F>(order, &BakedGaussian::rounded(gaussian, self.effects), self.effects);
        } else {
            self.splats.project::<F>(order, gaussian, self.effects);
        }
    }

    fn head_macs(&mut self, n: u64) {
        self.report.head_macs = self.report.head_macs.saturating_add(n);
    }
}

/// Projects Gaussians and keeps the splats that a pass draws.
struct SplatCollector<'f, 's> {
    view: &'f View,
    strips: &'f StripLayout,
    policy: &'f mut OverflowPolicy,
    pass: &'f mut Pass,
    splats: &'f mut SplatStore<'s>,
    chunk: u32,
}

impl SplatCollector<'_, '_> {
    /// * `order`: ascends in the order of the file.
    fn project<F: Functions>(&mut self, order: u32, gaussian: &Gaussian, effects: Effects) {
        let Some((mut splat, rect)) = self.view.project::<F>(gaussian, effects) else { return };
        let touched = self.strips.touched(rect);
        let index = self.pass.strip.index;
        let lies_here = *touched.end() >= index.into() && *touched.start() < self.pass.strip.end_index.into();
        let drawn = match self.policy {
            OverflowPolicy::Fits => true,
            OverflowPolicy::FirstCome { first_come, strips_of_chunks } if index == 0 => {
                strips_of_chunks.add(self.chunk, touched.clone());
                first_come.admit(order, touched)
            }
            OverflowPolicy::FirstCome { first_come, .. } => first_come.admits(order),
            OverflowPolicy::Slabs { .. } => {
                // No slab ends behind an infinite depth.
                if splat.depth > f32::MAX {
                    splat.depth = f32::MAX;
                }
                if self.pass.makes_index {
                    self.splats.add_to_index(self.chunk, splat.depth, touched);
                }
                if lies_here {
                    let end = self.pass.slab.end;
                    self.splats.push_into(&mut self.pass.slab, &splat, rect);
                    if self.pass.slab.end < end {
                        self.pass.end_earlier(self.view);
                    }
                }
                return;
            }
        };
        if drawn && lies_here && self.make_room(rect) {
            self.splats.push(&splat, rect);
        }
    }

    /// Ends the pass above as many strips as it takes to have a place; returns whether a splat of `rect` lies in it then.
    #[inline(always)]
    fn make_room(&mut self, rect: TileRect) -> bool {
        while self.splats.n >= self.splats.places() {
            let Strip { index, end_index, .. } = self.pass.strip;
            // A strip by itself has places enough.
            if end_index <= index + 1 {
                return true;
            }
            self.pass.strip = self.strips.between(index, end_index - 1);
            self.splats.end_above(self.pass.strip.end_row);
        }
        u16::from(rect.first_row) < self.pass.strip.end_row
    }
}
