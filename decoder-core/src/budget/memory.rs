//! What scratch memory holds: one list of slices, which both the sum and the carving are made of.
//!
//! First lies what stays between frames, then the memory of a frame. What binding alone needs lies where the frame's memory lies
//! later. Each list is a [`Part`], which lies in one region.

use pocketsplat_format::bundle::RecordMemory;
use pocketsplat_format::{DecodeError, Region};

use super::placement::{Part, Placement, Regions};
use super::shape::ScratchShape;
use crate::arena::{Arena, words_for};
use crate::bake::{BakedGaussian, BakedMemory};
use crate::project::{PackedSplat, TILE_PIXELS, TileRect};
use crate::raster::{N_RADIX, Pixel};
use crate::scene::HeadOutputs;

/// Makes of one list of slices the words that they take and the function that takes them, in this order.
macro_rules! slices {
    ($($(#[$doc:meta])* $memory:ident: $words:ident, $take:ident($shape:ident) {
        $($field:ident: [$item:ty; $len:expr],)*
    })*) => {$(
        const fn $words($shape: &ScratchShape) -> usize {
            0_usize$(.saturating_add(match words_for::<$item>($len) {
                Some(words) => words,
                None => usize::MAX,
            }))*
        }

        $(#[$doc])*
        fn $take<'s>($shape: &ScratchShape, arena: &mut Arena<'s>) -> Result<$memory<'s>, DecodeError> {
            Ok($memory { $($field: arena.take::<$item>($len)?,)* })
        }
    )*};
}

slices! {
    /// The heads' weights, and the anchor that they are evaluated for.
    AnchorMemory: anchor_words, take_anchor(shape) {
        heads: [u32; shape.heads().words(shape.model.head_weights)],
        row: [f32; shape.n_channels()],
        inputs: [f32; shape.heads().inputs()],
        hidden: [f32; shape.heads().hidden_len()],
        detail_sums: [f32; shape.heads().sums_len()],
        outputs: [HeadOutputs; shape.heads().offsets],
    }

    /// What the models of the symbols work in.
    ModelMemory: models_words, take_models(shape) {
        words: [u32; shape.coder.words()],
    }

    /// What a second painter reads and evaluates anchors with: a context's numbers, the anchor, and the one that waits for another.
    ReaderMemory: reader_words, take_reader(shape) {
        models: [u32; if shape.resident.is_anchors() { 0 } else { shape.coder.own_words() }],
        row: [f32; shape.n_channels()],
        inputs: [f32; shape.heads().inputs()],
        hidden: [f32; shape.heads().hidden_len()],
        detail_sums: [f32; shape.heads().sums_len()],
        outputs: [HeadOutputs; shape.heads().offsets],
        pair: [u32; shape.pair_words()],
    }

    /// Anchors between frames: their records, a bit a chunk, and the scale of each table.
    RecordMemory: record_words, take_records(shape) {
        records: [u16; shape.record_layout().n_words().saturating_mul(shape.resident.len())],
        damaged: [u32; shape.resident.n_chunks().div_ceil(u32::BITS as usize)],
        scales: [[f32; 2]; shape.coder.n_tables as usize],
    }

    /// The sums of anchors' features between frames.
    SumsMemory: sums_words, take_sums(shape) {
        sums: [f32; shape.sums_len()],
    }

    /// Gaussians between frames, and where those of each chunk begin and end.
    BakedMemory: baked_words, take_baked(shape) {
        records: [BakedGaussian; shape.resident.len()],
        starts: [u32; shape.resident.n_chunks().saturating_add(1)],
    }

    /// What tiles are drawn in.
    TileMemory: tile_words, take_tiles(shape) {
        pixels: [Pixel; TILE_PIXELS.saturating_mul(shape.frame.canvas_tiles as usize)],
        rgb: [[u8; 3]; TILE_PIXELS],
        counts: [u32; N_RADIX],
    }

    /// The splats of a strip or slab.
    SplatMemory: splat_words, take_splats(shape) {
        splats: [PackedSplat; shape.frame.max_splats as usize],
    }

    /// What lists and sorts them.
    ListMemory: list_words, take_lists(shape) {
        rects: [TileRect; shape.frame.max_splats as usize],
        order: [u32; shape.list_len()],
        spare: [u32; shape.list_len()],
        ends: [u32; shape.frame.shared_chunks as usize],
    }
}

/// Memory that anchors are evaluated in.
pub(crate) struct AnchorMemory<'s> {
    /// The weights, in whatever format the arithmetic keeps them.
    pub(crate) heads: &'s mut [u32],
    /// `[n_channels]` of the current anchor.
    pub(crate) row: &'s mut [f32],
    /// The inputs of the head that sees most.
    pub(crate) inputs: &'s mut [f32],
    /// A hidden layer.
    pub(crate) hidden: &'s mut [f32],
    /// The detail head's share of an anchor.
    pub(crate) detail_sums: &'s mut [f32],
    /// `[K]`.
    pub(crate) outputs: &'s mut [HeadOutputs],
}

/// Memory of the models of the symbols.
pub(crate) struct ModelMemory<'s> {
    /// As many as [`Bundle::anchor_scratch_words`](crate::Bundle::anchor_scratch_words) says.
    pub(crate) words: &'s mut [u32],
}

/// Memory of a second reader of anchors, as that of the [first](AnchorMemory), but for heads.
pub(crate) struct ReaderMemory<'s> {
    /// What the models of the symbols do not share; empty where nothing is decoded.
    pub(crate) models: &'s mut [u32],
    pub(crate) row: &'s mut [f32],
    pub(crate) inputs: &'s mut [f32],
    pub(crate) hidden: &'s mut [f32],
    pub(crate) detail_sums: &'s mut [f32],
    pub(crate) outputs: &'s mut [HeadOutputs],
    /// The anchor that waits for another, where two are evaluated at a time.
    pub(crate) pair: &'s mut [u32],
}

/// Memory of sums.
pub(crate) struct SumsMemory<'s> {
    /// Of all anchors, one after the other; empty where none are kept.
    pub(crate) sums: &'s mut [f32],
}

/// Memory that tiles are drawn in.
pub(crate) struct TileMemory<'s> {
    /// `[TILE_PIXELS]` of the current tile, or of each tile of a strip that is drawn in slabs.
    pub(crate) pixels: &'s mut [Pixel],
    /// `[TILE_PIXELS]` of a finished tile.
    pub(crate) rgb: &'s mut [[u8; 3]],
    /// Counts of the sort.
    pub(crate) counts: &'s mut [u32],
}

/// Memory of splats.
pub(crate) struct SplatMemory<'s> {
    /// Those of a strip or slab.
    pub(crate) splats: &'s mut [PackedSplat],
}

/// Memory that splats are listed and sorted in.
pub(crate) struct ListMemory<'s> {
    /// The tiles of each.
    pub(crate) rects: &'s mut [TileRect],
    /// Their order.
    pub(crate) order: &'s mut [u32],
    /// The order before.
    pub(crate) spare: &'s mut [u32],
    /// Of two painters: where the splats of each chunk end.
    pub(crate) ends: &'s mut [u32],
}

/// Memory that a frame is drawn in.
pub(crate) struct FrameMemory<'s> {
    /// For tiles.
    pub(crate) tiles: TileMemory<'s>,
    /// For splats.
    pub(crate) splats: SplatMemory<'s>,
    /// For their lists.
    pub(crate) lists: ListMemory<'s>,
}

/// What the second painter has of its own.
pub(crate) struct PainterMemory<'s> {
    /// To read and evaluate anchors; `None` where Gaussians are in memory.
    pub(crate) anchors: Option<ReaderMemory<'s>>,
    /// To draw in.
    pub(crate) frame: FrameMemory<'s>,
}

/// Memory of the scene: what stays between frames (`'s`), and what binding works in (`'f`).
pub(crate) enum SceneMemory<'s, 'f> {
    /// Each frame decodes.
    Streamed { anchor: AnchorMemory<'s>, models: ModelMemory<'s> },
    /// Binding decodes.
    Resident { anchor: AnchorMemory<'s>, records: RecordMemory<'s>, sums: SumsMemory<'s>, models: ModelMemory<'f> },
    /// Binding decodes and evaluates.
    Baked { baked: BakedMemory<'s>, anchor: AnchorMemory<'f>, models: ModelMemory<'f> },
}

impl<'s, 'f> SceneMemory<'s, 'f> {
    /// Takes the memory of the scene from the front of `regions`.
    ///
    /// # Errors
    /// [`DecodeError::ScratchTooSmall`] when a region has fewer words than [`ScratchShape::lens`] counts.
    pub(crate) fn take(shape: &ScratchShape, regions: &'f mut Regions<'s>) -> Result<Self, DecodeError> {
        if shape.resident.is_gaussians() {
            let baked = take_baked(shape, regions.of(Part::Scene))?;
            let mut free = regions.borrow();
            let anchor = take_anchor(shape, free.of(Part::Heads))?;
            return Ok(Self::Baked { baked, anchor, models: take_models(shape, free.of(Part::Models))? });
        }
        let anchor = take_anchor(shape, regions.of(Part::Heads))?;
        if shape.resident.is_anchors() {
            let records = take_records(shape, regions.of(Part::Scene))?;
            let sums = take_sums(shape, regions.of(Part::Scene))?;
            let models = take_models(shape, regions.borrow().of(Part::Models))?;
            return Ok(Self::Resident { anchor, records, sums, models });
        }
        Ok(Self::Streamed { anchor, models: take_models(shape, regions.of(Part::Models))? })
    }
}

impl<'s> FrameMemory<'s> {
    /// Takes the memory of a frame from what [`SceneMemory::take`] left.
    ///
    /// # Errors
    /// As for [`SceneMemory::take`].
    pub(crate) fn take(shape: &ScratchShape, regions: &mut Regions<'s>) -> Result<Self, DecodeError> {
        let tiles = take_tiles(shape, regions.of(Part::Tiles))?;
        let splats = take_splats(shape, regions.of(Part::Splats))?;
        Ok(Self { tiles, splats, lists: take_lists(shape, regions.of(Part::Lists))? })
    }
}

impl<'s> PainterMemory<'s> {
    /// Takes the memory of the second painter from what [`FrameMemory::take`] left.
    ///
    /// # Errors
    /// As for [`SceneMemory::take`].
    pub(crate) fn take(shape: &ScratchShape, regions: &mut Regions<'s>) -> Result<Self, DecodeError> {
        let arena = regions.of(Part::SecondPainter);
        let anchors = if shape.resident.is_gaussians() { None } else { Some(take_reader(shape, arena)?) };
        let (tiles, splats) = (take_tiles(shape, arena)?, take_splats(shape, arena)?);
        Ok(Self { anchors, frame: FrameMemory { tiles, splats, lists: take_lists(shape, arena)? } })
    }
}

/// When a part is needed.
#[derive(Clone, Copy)]
enum When {
    /// From binding to the last frame.
    Kept,
    /// While binding.
    Bound,
    /// In a frame; lies where what was [bound](Self::Bound) lay before.
    Frame,
}

/// Words of several parts, by when they are needed.
#[derive(Clone, Copy)]
struct Words {
    kept: usize,
    bound: usize,
    frame: usize,
}

impl Words {
    const NONE: Self = Self { kept: 0, bound: 0, frame: 0 };

    /// Words of memory.
    const fn most(self) -> usize {
        self.kept.saturating_add(if self.bound > self.frame { self.bound } else { self.frame })
    }
}

impl ScratchShape {
    /// Bytes of scratch memory, whatever their alignment; [`usize::MAX`] beyond the address space.
    #[must_use]
    pub const fn scratch_len(&self) -> usize {
        let [len, _] = self.lens(Placement::FAST);
        len
    }

    /// Bytes of fast and of slow memory, whatever their alignment, when the parts are placed so.
    pub(super) const fn lens(&self, placement: Placement) -> [usize; 2] {
        let [fast, slow] = self.words(placement);
        [bytes_for(fast.most()), bytes_for(slow.most())]
    }

    /// Bytes that binding takes without a frame after it.
    pub(crate) const fn bind_len(&self) -> usize {
        let [fast, _] = self.words(Placement::FAST);
        bytes_for(fast.kept.saturating_add(fast.bound))
    }

    /// Bytes of a part while frames are drawn.
    pub(super) const fn part_len(&self, part: Part) -> usize {
        let (when, mut words) = self.words_of(part);
        if matches!(part, Part::SecondPainter) && self.frame.shared_chunks > 0 {
            let of_frame = tile_words(self).saturating_add(splat_words(self)).saturating_add(list_words(self));
            words = words.saturating_add(of_frame);
        }
        if matches!(when, When::Bound) { 0 } else { words.saturating_mul(4) }
    }

    /// The most splats, up to those of the shape, that `lens` bytes of fast and slow memory have places for when the parts are
    /// placed so; 0 if not even the rest fits.
    // Not inlined: each caller would have a copy.
    #[inline(never)]
    pub(super) fn splats_within(&self, placement: Placement, lens: [usize; 2]) -> u32 {
        let [none, one] = [0, 1].map(|splats| self.with_splats(splats).words(placement));
        let mut most = self.frame.max_splats;
        for ((Words { kept, bound, frame }, one), len) in none.into_iter().zip(one).zip(lens) {
            let room = (len.saturating_sub(3) / 4).saturating_sub(kept);
            if bound > room || frame > room {
                return 0;
            }
            let places = room.saturating_sub(frame).checked_div(one.frame.saturating_sub(frame));
            most = places.and_then(|places| u32::try_from(places).ok()).map_or(most, |places| places.min(most));
        }
        most
    }

    /// The same with memory for so many splats.
    pub(crate) const fn with_splats(mut self, max_splats: u32) -> Self {
        self.frame.max_splats = max_splats;
        self
    }

    /// Words of fast and of slow memory when the parts are placed so.
    // Not inlined: each caller would have a copy.
    #[inline(never)]
    const fn words(&self, placement: Placement) -> [Words; 2] {
        let ([mut fast, mut slow], mut parts, mut of_frame) = ([Words::NONE; 2], Part::ALL.as_slice(), 0_usize);
        while let [part, rest @ ..] = parts {
            let region = match placement.region(*part) {
                Region::Fast => &mut fast,
                Region::Slow => &mut slow,
            };
            let (when, mut words) = self.words_of(*part);
            if matches!(when, When::Frame) {
                // The last part has all that is for a frame once more.
                if matches!(part, Part::SecondPainter) && self.frame.shared_chunks > 0 {
                    words = words.saturating_add(of_frame);
                }
                of_frame = of_frame.saturating_add(words);
            }
            let sum = match when {
                When::Kept => &mut region.kept,
                When::Bound => &mut region.bound,
                When::Frame => &mut region.frame,
            };
            *sum = sum.saturating_add(words);
            parts = rest;
        }
        [fast, slow]
    }

    /// Words of a part, as [`SceneMemory::take`], [`FrameMemory::take`] and [`PainterMemory::take`] take them; of the second painter without what
    /// it has for a frame as the first has it.
    // Into the loop above, which is unrolled.
    #[inline(always)]
    const fn words_of(&self, part: Part) -> (When, usize) {
        let (is_baked, is_resident) = (self.resident.is_gaussians(), self.resident.is_anchors());
        match part {
            Part::Heads => (if is_baked { When::Bound } else { When::Kept }, anchor_words(self)),
            Part::Models => (if is_baked || is_resident { When::Bound } else { When::Kept }, models_words(self)),
            Part::Scene if is_baked => (When::Kept, baked_words(self)),
            Part::Scene if is_resident => (When::Kept, record_words(self).saturating_add(sums_words(self))),
            Part::Scene => (When::Kept, 0),
            Part::Tiles => (When::Frame, tile_words(self)),
            Part::Splats => (When::Frame, splat_words(self)),
            Part::Lists => (When::Frame, list_words(self)),
            Part::SecondPainter if self.frame.shared_chunks == 0 || is_baked => (When::Frame, 0),
            Part::SecondPainter => (When::Frame, reader_words(self)),
        }
    }
}

const fn bytes_for(words: usize) -> usize {
    if words == 0 {
        return 0;
    }
    match Arena::bytes_for(words) {
        Some(len) if len < isize::MAX as usize => len,
        _ => usize::MAX,
    }
}

#[cfg(test)]
mod tests {
    use std::vec;

    use super::{FrameMemory, PainterMemory, Placement, Regions, SceneMemory};
    use crate::budget::{CoderShape, FrameShape, HeadWeights, ModelShape, RecordShape, Resident, ScratchShape};
    use pocketsplat_format::DecodeError;

    /// A stream of numbers, the same every time.
    struct Numbers(u32);

    impl Numbers {
        fn below(&mut self, n: u32) -> u32 {
            self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (self.0 >> 8) % n
        }

        /// A shape that keeps nothing, anchors or Gaussians.
        fn shape(&mut self, kept: u32, most: u32) -> ScratchShape {
            let mut up_to = |n: u32| self.below(n) as u16;
            let context = up_to(2);
            ScratchShape {
                model: ModelShape {
                    feature_dim: 1 + up_to(256),
                    n_offsets: 1 + up_to(32),
                    anisotropic: up_to(2) == 1,
                    n_geometry_inputs: up_to(5),
                    n_colour_inputs: up_to(5),
                    colour_hidden: 1 + up_to(256),
                    detail_hidden: up_to(257),
                    head_weights: if up_to(2) == 1 { HeadWeights::F16 } else { HeadWeights::F32 },
                },
                coder: CoderShape {
                    n_tables: (1 - context) * up_to(360),
                    context_inputs: context * 4 * (1 + up_to(32)),
                    context_hidden: context * (1 + up_to(256)),
                    context_kept: context * up_to(257),
                },
                record: RecordShape {
                    symbol_bits: [1 + up_to(16) as u8, 1 + up_to(16) as u8, 1 + up_to(16) as u8],
                    lattice_bits: up_to(22) as u8,
                    masks: up_to(2) == 1,
                },
                resident: match kept {
                    0 => Resident::Nothing,
                    1 => Resident::Anchors {
                        n_anchors: 1 + self.below(most / 3),
                        n_chunks: 1 + self.below(200),
                        with_sums: self.below(2) == 1,
                    },
                    _ => Resident::Gaussians { n_gaussians: self.below(2 * most), n_chunks: 1 + self.below(200) },
                },
                frame: FrameShape {
                    canvas_tiles: 1 + self.below(100),
                    max_splats: self.below(most),
                    shared_chunks: self.below(2) * self.below(200),
                },
            }
        }
    }

    fn most_of(a: ScratchShape, b: ScratchShape) -> ScratchShape {
        let ([a0, a1, a2], [b0, b1, b2]) = (a.record.symbol_bits, b.record.symbol_bits);
        ScratchShape {
            model: ModelShape {
                feature_dim: a.model.feature_dim.max(b.model.feature_dim),
                n_offsets: a.model.n_offsets.max(b.model.n_offsets),
                anisotropic: a.model.anisotropic | b.model.anisotropic,
                n_geometry_inputs: a.model.n_geometry_inputs.max(b.model.n_geometry_inputs),
                n_colour_inputs: a.model.n_colour_inputs.max(b.model.n_colour_inputs),
                colour_hidden: a.model.colour_hidden.max(b.model.colour_hidden),
                detail_hidden: a.model.detail_hidden.max(b.model.detail_hidden),
                head_weights: match (a.model.head_weights, b.model.head_weights) {
                    (HeadWeights::F16, HeadWeights::F16) => HeadWeights::F16,
                    _ => HeadWeights::F32,
                },
            },
            coder: CoderShape {
                n_tables: a.coder.n_tables.max(b.coder.n_tables),
                context_inputs: a.coder.context_inputs.max(b.coder.context_inputs),
                context_hidden: a.coder.context_hidden.max(b.coder.context_hidden),
                context_kept: a.coder.context_kept.max(b.coder.context_kept),
            },
            record: RecordShape {
                symbol_bits: [a0.max(b0), a1.max(b1), a2.max(b2)],
                lattice_bits: a.record.lattice_bits.max(b.record.lattice_bits),
                masks: a.record.masks | b.record.masks,
            },
            resident: match (a.resident, b.resident) {
                (
                    Resident::Anchors { n_anchors, n_chunks, with_sums },
                    Resident::Anchors { n_anchors: more_anchors, n_chunks: more_chunks, with_sums: more_sums },
                ) => Resident::Anchors {
                    n_anchors: n_anchors.max(more_anchors),
                    n_chunks: n_chunks.max(more_chunks),
                    with_sums: with_sums | more_sums,
                },
                (
                    Resident::Gaussians { n_gaussians, n_chunks },
                    Resident::Gaussians { n_gaussians: more_gaussians, n_chunks: more_chunks },
                ) => Resident::Gaussians {
                    n_gaussians: n_gaussians.max(more_gaussians),
                    n_chunks: n_chunks.max(more_chunks),
                },
                (same, _) => same,
            },
            frame: FrameShape {
                canvas_tiles: a.frame.canvas_tiles.max(b.frame.canvas_tiles),
                max_splats: a.frame.max_splats.max(b.frame.max_splats),
                shared_chunks: a.frame.shared_chunks.max(b.frame.shared_chunks),
            },
        }
    }

    #[test]
    fn more_never_takes_less() {
        let random = &mut Numbers(1);
        for _ in 0..20_000 {
            let kept = random.below(3);
            let (mut a, mut b) = (random.shape(kept, 100_000), random.shape(kept, 100_000));
            if a.frame.shared_chunks.max(b.frame.shared_chunks) > 0 {
                // Of the smallest heads two halves and what they are evaluated with take more than floats.
                (a.model.head_weights, b.model.head_weights) = (HeadWeights::F32, HeadWeights::F32);
            }
            let both = most_of(a, b);
            let [len_a, len_b, len] = [a, b, both].map(|shape| shape.scratch_len());
            assert!(len >= len_a.max(len_b), "{a:?} takes {len_a}, {b:?} {len_b}, both {len}");
        }
    }

    #[test]
    fn the_sum_is_what_carving_takes() {
        let random = &mut Numbers(7);
        for round in 0..600 {
            let shape = random.shape(round % 3, 300);
            let n_placement = random.below(64) as usize;
            for placement in [Placement::FAST].into_iter().chain(Placement::to_try(true).nth(n_placement)) {
                let lens = shape.lens(placement);
                let mut memory = lens.map(|len| vec![0; len]);
                let mut take_all = |less: [usize; 2]| {
                    let [fast, slow] = &mut memory;
                    let [end_fast, end_slow] = [0, 1].map(|region| lens[region].saturating_sub(less[region]));
                    let mut regions = Regions::new(&mut fast[..end_fast], &mut slow[..end_slow], placement);
                    SceneMemory::take(&shape, &mut regions)?;
                    FrameMemory::take(&shape, &mut regions)?;
                    if shape.frame.shared_chunks > 0 {
                        PainterMemory::take(&shape, &mut regions)?;
                    }
                    Ok::<_, DecodeError>(regions.n_words())
                };
                for (region, less) in [[7, 0], [0, 7]].into_iter().enumerate().filter(|(region, _)| lens[*region] > 7) {
                    assert!(take_all(less).is_err(), "a word less of region {region}: {placement:?} of {shape:?}");
                }
                let left = take_all([0, 0]).unwrap_or_else(|error| panic!("{error}: {placement:?} of {shape:?}"));
                for (super::Words { bound, frame, .. }, left) in shape.words(placement).into_iter().zip(left) {
                    let unused = bound.saturating_sub(frame);
                    assert!(left <= unused + 1, "{left} words over: {placement:?} of {shape:?}");
                }
            }
        }
    }

    #[test]
    fn a_resident_anchor_takes_what_its_symbols_take_and_little_more() {
        let mut shape = ScratchShape::most(16, 4);
        shape.record.lattice_bits = 10;
        shape.coder.context_hidden = 32;
        // 34 symbols of 16 bits, cell, mask, steps.
        assert_eq!(shape.resident_anchor_len(), 2 * (34 * 16 + 30 + 4 + 16_usize).div_ceil(16), "of any symbols");
        shape.coder.context_hidden = 0;
        shape.record = RecordShape { masks: false, symbol_bits: [6, 8, 7], ..shape.record };
        assert_eq!(shape.resident_anchor_len(), 2 * (16 * 6 + 6 * 8 + 12 * 7 + 30_usize).div_ceil(16), "of small ones");
    }

    #[test]
    fn splats_within_a_length_fill_it() {
        for resident in [
            Resident::Nothing,
            Resident::Anchors { n_anchors: 40, n_chunks: 40, with_sums: false },
            Resident::Anchors { n_anchors: 4, n_chunks: 4, with_sums: true },
            Resident::Gaussians { n_gaussians: 40, n_chunks: 40 },
        ] {
            let shape = ScratchShape { resident, ..ScratchShape::most(16, 4) }.with_splats(5000);
            for len in [100_000, 150_001, 999_999] {
                let within = shape.with_splats(shape.splats_within(Placement::FAST, [len, 0]));
                let is_full = within.frame.max_splats == 5000 || within.scratch_len() + 40 > len;
                assert!(within.scratch_len() <= len && is_full, "{within:?} in {len}");
            }
            assert_eq!(shape.splats_within(Placement::FAST, [1000, 0]), 0, "not even the heads");
        }
    }

    #[test]
    fn beyond_the_address_space_is_said_so() {
        let shape = ScratchShape::most(256, 32).with_splats(u32::MAX);
        assert!(size_of::<usize>() > 4 || shape.scratch_len() == usize::MAX, "no wrapped sum");
    }
}
