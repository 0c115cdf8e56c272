//! How many bytes of scratch memory what takes: one sum for plans and for static buffers.

use super::arena::{Arena, words_for};
use super::work::Kept;
use crate::bake::BakedGaussian;
use crate::bundle::{
    Bundle, Coder, MAX_FEATURE_DIM, MAX_LATTICE_BITS, MAX_OFFSETS, RecordLayout, Tier, covariance_outputs, model_words,
    n_log_scales,
};
use crate::context::{FEATURES_PER_LEVEL, MAX_CONTEXT_HIDDEN, MAX_CONTEXT_LEVELS};
use crate::mlp::HeadShape;
use crate::project::PackedSplat;
use crate::raster::{N_RADIX, Pixel, TILE_PIXELS, TileRect};
use crate::scene::HeadOutputs;

/// What the size of the scratch memory follows from.
///
/// More of anything never takes fewer bytes, so the length of a shape suffices for every plan of every bundle within it that
/// is baked, resident or streamed, as the shape is:
///
/// ```
/// use pocketsplat_core::ScratchShape;
///
/// const LEN: usize = ScratchShape {
///     colour_hidden: 16,
///     detail_hidden: 0,
///     n_tables: 0,
///     max_splats: 1500,
///     ..ScratchShape::most(16, 4)
/// }
/// .scratch_len();
/// static SCRATCH: [u8; LEN] = [0; LEN];
/// # assert_eq!(SCRATCH.len(), LEN);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ScratchShape {
    /// Feature width F, 1..=[`MAX_FEATURE_DIM`].
    pub feature_dim: u16,
    /// Offsets K of an anchor, 1..=[`MAX_OFFSETS`].
    pub n_offsets: u16,
    /// Whether Gaussians have three deviations and a rotation.
    pub anisotropic: bool,
    /// Inputs of the opacity and covariance heads besides the feature, at most 4.
    pub n_geometry_inputs: u16,
    /// Inputs of the colour head besides the feature, at most 4.
    pub n_colour_inputs: u16,
    /// Hidden width of the colour head.
    pub colour_hidden: u16,
    /// Hidden width of the detail head, 0 without one.
    pub detail_hidden: u16,
    /// Frequency tables; 0 for bundles with a context.
    pub n_tables: u16,
    /// Inputs of the context, four a grid level; 0 for bundles with tables.
    pub context_inputs: u16,
    /// Hidden units of the context; 0 for bundles with tables.
    pub context_hidden: u16,
    /// Bits of the symbols of features, log-scales and offsets in memory, each at most 16.
    pub symbol_bits: [u8; 3],
    /// Bits of a lattice coordinate.
    pub lattice_bits: u8,
    /// Whether anchors say which of their offsets are drawn.
    pub masks: bool,
    /// Tiles in work at once: 1, or those of a strip that is drawn in [slabs](crate::Overflow::Slabs).
    pub canvas_tiles: u32,
    /// Splats in memory.
    pub max_splats: u32,
    /// Anchors in memory; 0 when they are streamed.
    pub resident_anchors: u32,
    /// Chunks of those.
    pub resident_chunks: u32,
    /// Gaussians in memory, evaluated when bound.
    pub baked_gaussians: u32,
    /// Chunks of those; 0 when Gaussians are evaluated in each frame.
    pub baked_chunks: u32,
}

impl ScratchShape {
    /// The largest bundles of F features and K offsets that the writer makes, streamed; without memory for splats yet.
    #[must_use]
    pub const fn most(feature_dim: u16, n_offsets: u16) -> Self {
        Self {
            feature_dim,
            n_offsets,
            anisotropic: true,
            n_geometry_inputs: 4,
            n_colour_inputs: 4,
            colour_hidden: MAX_FEATURE_DIM,
            detail_hidden: MAX_FEATURE_DIM,
            n_tables: feature_dim.saturating_add(n_log_scales(true)).saturating_add(n_offsets.saturating_mul(3)),
            context_inputs: (MAX_CONTEXT_LEVELS as u16).saturating_mul(FEATURES_PER_LEVEL as u16),
            context_hidden: MAX_CONTEXT_HIDDEN,
            symbol_bits: [16; 3],
            lattice_bits: MAX_LATTICE_BITS,
            masks: true,
            canvas_tiles: 1,
            max_splats: 0,
            resident_anchors: 0,
            resident_chunks: 0,
            baked_gaussians: 0,
            baked_chunks: 0,
        }
    }

    /// The shape of one bundle's heads and models.
    pub(crate) fn of_heads(bundle: &Bundle<'_>) -> Self {
        Self::of(bundle, 1, 0, 0, Kept::Nothing)
    }

    /// The shape of one bundle's scratch memory.
    ///
    /// * `kept`: what of the first `n_tiers` tiers is in memory.
    pub(super) fn of(bundle: &Bundle<'_>, canvas_tiles: u32, max_splats: u32, n_tiers: u8, kept: Kept) -> Self {
        let header = bundle.header();
        let few = |n: usize| u16::try_from(n).unwrap_or(u16::MAX);
        let [n_tables, context_inputs, context_hidden] = match bundle.coder() {
            Coder::Static(tables) => [few(tables.len()), 0, 0],
            Coder::Context(context) => [0, few(context.n_inputs()), few(context.n_hidden())],
        };
        let tier = bundle.up_to_tier(n_tiers);
        let resident = if kept == Kept::Anchors { tier } else { Tier::default() };
        let is_baked = cfg!(feature = "baked") && kept == Kept::Gaussians;
        Self {
            feature_dim: header.feature_dim,
            n_offsets: header.n_offsets,
            anisotropic: header.features.effects.anisotropic,
            n_geometry_inputs: few(header.geometry_inputs()).saturating_sub(header.feature_dim),
            n_colour_inputs: few(header.colour_inputs()).saturating_sub(header.feature_dim),
            colour_hidden: header.colour_hidden,
            detail_hidden: header.detail_hidden,
            n_tables,
            context_inputs,
            context_hidden,
            symbol_bits: header.symbol_bits,
            lattice_bits: bundle.lattice().bits,
            masks: bundle.masks().is_some(),
            canvas_tiles,
            max_splats,
            resident_anchors: resident.n_anchors,
            resident_chunks: resident.n_chunks,
            baked_gaussians: if is_baked { bundle.n_gaussians(n_tiers).unwrap_or_default() } else { 0 },
            baked_chunks: if is_baked { tier.n_chunks } else { 0 },
        }
    }

    /// Bytes of scratch memory, whatever their alignment; [`usize::MAX`] beyond the address space.
    #[must_use]
    pub const fn scratch_len(&self) -> usize {
        let (before, when_bound, frame) = (self.words_before_frame(), self.words_when_bound(), self.frame_words());
        let words = before.saturating_add(if when_bound > frame { when_bound } else { frame });
        match Arena::bytes_for(words) {
            Some(len) if len < isize::MAX as usize => len,
            _ => usize::MAX,
        }
    }

    /// The most splats, up to those of the shape, that `len` bytes have places for; 0 if not even the rest fits.
    pub(crate) const fn splats_within(&self, len: usize) -> u32 {
        let room = (len.saturating_sub(3) / 4).saturating_sub(self.words_before_frame());
        if self.words_when_bound() > room {
            return 0;
        }
        let rest = Self { max_splats: 0, ..*self }.frame_words();
        let places = match room.saturating_sub(rest).checked_div(Self::splat_words()) {
            Some(places) => places,
            None => 0,
        };
        if places < self.max_splats as usize { places as u32 } else { self.max_splats }
    }

    const fn model_words(&self) -> usize {
        model_words(self.n_tables, self.context_inputs, self.context_hidden)
    }

    /// Gaussians, or heads, the anchor in work, and where anchors come from.
    const fn words_before_frame(&self) -> usize {
        if cfg!(feature = "baked") && self.baked_chunks > 0 {
            return self.baked_words();
        }
        let for_anchor = self.head_words().saturating_add(self.anchor_words());
        for_anchor.saturating_add(if self.resident_chunks == 0 { self.model_words() } else { self.resident_words() })
    }

    /// What binding works in, where later the frame's memory lies: the models of resident anchors, and for Gaussians heads and the
    /// anchor in work as well.
    const fn words_when_bound(&self) -> usize {
        if cfg!(feature = "baked") && self.baked_chunks > 0 {
            self.words_to_evaluate()
        } else if self.resident_chunks > 0 {
            self.model_words()
        } else {
            0
        }
    }

    /// Words that evaluating the Gaussians of the scene takes besides an entry a chunk.
    pub(crate) const fn words_to_evaluate(&self) -> usize {
        self.model_words().saturating_add(self.head_words()).saturating_add(self.anchor_words())
    }

    /// Bytes of one anchor in memory.
    #[must_use]
    pub const fn resident_anchor_len(&self) -> usize {
        self.record_layout().len().saturating_mul(2)
    }

    /// Widths of the heads that are converted.
    pub(crate) const fn heads(&self) -> HeadShape {
        let [f, k] = [limited(self.feature_dim, MAX_FEATURE_DIM), limited(self.n_offsets, MAX_OFFSETS)];
        HeadShape {
            geometry_inputs: f.saturating_add(self.n_geometry_inputs as usize),
            colour_inputs: f.saturating_add(self.n_colour_inputs as usize),
            feature: f,
            covariance: covariance_outputs(self.anisotropic) as usize,
            colour: limited(self.colour_hidden, MAX_FEATURE_DIM),
            detail: limited(self.detail_hidden, MAX_FEATURE_DIM),
            offsets: k,
        }
    }

    const fn n_channels(&self) -> usize {
        (self.feature_dim as usize)
            .saturating_add(n_log_scales(self.anisotropic) as usize)
            .saturating_add((self.n_offsets as usize).saturating_mul(3))
    }

    const fn record_layout(&self) -> RecordLayout {
        let masked_offsets = if self.masks { self.n_offsets } else { 0 };
        RecordLayout::new(
            self.feature_dim,
            n_log_scales(self.anisotropic),
            self.n_offsets,
            self.symbol_bits,
            self.lattice_bits,
            masked_offsets,
            self.context_hidden > 0,
        )
    }

    const fn head_words(&self) -> usize {
        self.heads().n_weights()
    }

    /// Channels, inputs, activations and outputs of the anchor in work.
    const fn anchor_words(&self) -> usize {
        let heads = self.heads();
        let outputs = match words_for::<HeadOutputs>(heads.offsets) {
            Some(outputs) => outputs,
            None => usize::MAX,
        };
        self.n_channels()
            .saturating_add(heads.inputs())
            .saturating_add(heads.hidden_len())
            .saturating_add(heads.sums_len())
            .saturating_add(outputs)
    }

    /// Records, a bit a chunk, and the scale of each table.
    const fn resident_words(&self) -> usize {
        let n_numbers = self.record_layout().len().saturating_mul(self.resident_anchors as usize);
        n_numbers
            .div_ceil(2)
            .saturating_add(self.resident_chunks.div_ceil(u32::BITS) as usize)
            .saturating_add((self.n_tables as usize).saturating_mul(2))
    }

    /// Records, and where those of each chunk begin and end.
    const fn baked_words(&self) -> usize {
        match words_for::<BakedGaussian>(self.baked_gaussians as usize) {
            Some(records) => records.saturating_add(self.baked_chunks as usize).saturating_add(1),
            None => usize::MAX,
        }
    }

    /// Counts of the sort, tiles, and the splats with their order.
    const fn frame_words(&self) -> usize {
        let [n_tiles, n_splats] = [self.canvas_tiles as usize, self.max_splats as usize];
        let (pixels, rgb) = match (words_for::<Pixel>(TILE_PIXELS), words_for::<[u8; 3]>(TILE_PIXELS)) {
            (Some(pixels), Some(rgb)) => (pixels.saturating_mul(n_tiles), rgb),
            _ => (usize::MAX, 0),
        };
        N_RADIX.saturating_add(pixels).saturating_add(rgb).saturating_add(Self::splat_words().saturating_mul(n_splats))
    }

    /// A splat, its tiles, its place in the order and in the order before.
    const fn splat_words() -> usize {
        match (words_for::<PackedSplat>(1), words_for::<TileRect>(1)) {
            (Some(splat), Some(rect)) => splat.saturating_add(rect).saturating_add(2),
            _ => usize::MAX,
        }
    }
}

/// A width as a length, not above what a bundle may have: no product of two then overflows.
const fn limited(width: u16, most: u16) -> usize {
    (if width < most { width } else { most }) as usize
}

#[cfg(test)]
mod tests {
    use super::ScratchShape;

    #[test]
    fn more_never_takes_less() {
        let mut state = 1_u32;
        let mut random = move |n: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) % n
        };
        for _ in 0..20_000 {
            let kept = random(3);
            let [resident, baked] = [kept % 2, kept / 2];
            let mut pair = || {
                let mut up_to = |n: u32| random(n) as u16;
                let context = up_to(2);
                ScratchShape {
                    feature_dim: 1 + up_to(256),
                    n_offsets: 1 + up_to(32),
                    anisotropic: up_to(2) == 1,
                    n_geometry_inputs: up_to(5),
                    n_colour_inputs: up_to(5),
                    colour_hidden: 1 + up_to(256),
                    detail_hidden: up_to(257),
                    n_tables: (1 - context) * up_to(360),
                    context_inputs: context * 4 * (1 + up_to(32)),
                    context_hidden: context * (1 + up_to(256)),
                    symbol_bits: [1 + up_to(16) as u8, 1 + up_to(16) as u8, 1 + up_to(16) as u8],
                    lattice_bits: up_to(22) as u8,
                    masks: up_to(2) == 1,
                    canvas_tiles: 1 + random(100),
                    max_splats: random(100_000),
                    resident_anchors: resident * (1 + random(30_000)),
                    resident_chunks: resident * (1 + random(200)),
                    baked_gaussians: baked * random(200_000),
                    baked_chunks: baked * (1 + random(200)),
                }
            };
            let (a, b) = (pair(), pair());
            let ([a0, a1, a2], [b0, b1, b2]) = (a.symbol_bits, b.symbol_bits);
            let both = ScratchShape {
                feature_dim: a.feature_dim.max(b.feature_dim),
                n_offsets: a.n_offsets.max(b.n_offsets),
                anisotropic: a.anisotropic | b.anisotropic,
                n_geometry_inputs: a.n_geometry_inputs.max(b.n_geometry_inputs),
                n_colour_inputs: a.n_colour_inputs.max(b.n_colour_inputs),
                colour_hidden: a.colour_hidden.max(b.colour_hidden),
                detail_hidden: a.detail_hidden.max(b.detail_hidden),
                n_tables: a.n_tables.max(b.n_tables),
                context_inputs: a.context_inputs.max(b.context_inputs),
                context_hidden: a.context_hidden.max(b.context_hidden),
                symbol_bits: [a0.max(b0), a1.max(b1), a2.max(b2)],
                lattice_bits: a.lattice_bits.max(b.lattice_bits),
                masks: a.masks | b.masks,
                canvas_tiles: a.canvas_tiles.max(b.canvas_tiles),
                max_splats: a.max_splats.max(b.max_splats),
                resident_anchors: a.resident_anchors.max(b.resident_anchors),
                resident_chunks: a.resident_chunks.max(b.resident_chunks),
                baked_gaussians: a.baked_gaussians.max(b.baked_gaussians),
                baked_chunks: a.baked_chunks.max(b.baked_chunks),
            };
            let [len_a, len_b, len] = [a, b, both].map(|shape| shape.scratch_len());
            assert!(len >= len_a.max(len_b), "{a:?} takes {len_a}, {b:?} {len_b}, both {len}");
        }
    }

    #[test]
    fn a_resident_anchor_takes_what_its_symbols_take_and_little_more() {
        let shape = ScratchShape { lattice_bits: 10, context_hidden: 32, masks: true, ..ScratchShape::most(16, 4) };
        // 34 symbols of 16 bits, cell, mask, steps.
        assert_eq!(shape.resident_anchor_len(), 2 * (34 * 16 + 30 + 4 + 16_usize).div_ceil(16), "of any symbols");
        let shape = ScratchShape { n_tables: 9, context_hidden: 0, masks: false, symbol_bits: [6, 8, 7], ..shape };
        assert_eq!(shape.resident_anchor_len(), 2 * (16 * 6 + 6 * 8 + 12 * 7 + 30_usize).div_ceil(16), "of small ones");
    }

    #[test]
    fn splats_within_a_length_fill_it() {
        for [resident, baked] in [[0, 0], [40, 0], [0, 40]] {
            let shape = ScratchShape {
                max_splats: 5000,
                resident_anchors: resident,
                resident_chunks: resident,
                baked_gaussians: baked,
                baked_chunks: baked,
                ..ScratchShape::most(16, 4)
            };
            for len in [100_000, 150_001, 999_999] {
                let within = ScratchShape { max_splats: shape.splats_within(len), ..shape };
                assert!(
                    within.scratch_len() <= len && (within.max_splats == 5000 || within.scratch_len() + 40 > len),
                    "{within:?} in {len}"
                );
            }
            assert_eq!(shape.splats_within(1000), 0, "not even the heads");
        }
    }

    #[test]
    fn beyond_the_address_space_is_said_so() {
        let shape = ScratchShape { max_splats: u32::MAX, ..ScratchShape::most(256, 32) };
        assert!(size_of::<usize>() > 4 || shape.scratch_len() == usize::MAX, "no wrapped sum");
    }
}
