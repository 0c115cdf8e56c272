//! What scratch memory holds: one list of slices, which both the sum and the carving are made of.
//!
//! First lies what stays between frames, then the memory of a frame. What binding alone needs lies where the frame's memory lies
//! later. Each list is a [`Part`], which lies in one region.

mod lengths;
#[cfg(test)]
mod tests;

use pocketsplat_format::DecodeError;
use pocketsplat_format::bundle::RecordMemory;

use super::placement::{Part, Regions};
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
