//! What the number of bytes of scratch memory follows from.

use pocketsplat_format::Bundle;
use pocketsplat_format::bundle::{
    Coder, MAX_FEATURE_DIM, MAX_LATTICE_BITS, MAX_OFFSETS, RecordLayout, covariance_outputs, model_words, n_log_scales,
};
use pocketsplat_format::context::{FEATURES_PER_LEVEL, MAX_CONTEXT_HIDDEN, MAX_CONTEXT_LEVELS, N_POSITION_INPUTS};

use crate::mlp::{HeadShape, HeadWeights};

/// What the size of the scratch memory follows from.
///
/// More of anything never takes fewer bytes, so the length of a shape suffices for every plan of every bundle within it that
/// keeps the same [resident](Resident), or nothing:
///
/// ```
/// use pocketsplat_core::ScratchShape;
///
/// const LEN: usize = {
///     let mut shape = ScratchShape::most(16, 4);
///     shape.model.colour_hidden = 16;
///     shape.model.detail_hidden = 0;
///     shape.coder.n_tables = 0;
///     shape.frame.max_splats = 1500;
///     shape.scratch_len()
/// };
/// static SCRATCH: [u8; LEN] = [0; LEN];
/// # assert_eq!(SCRATCH.len(), LEN);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ScratchShape {
    /// Widths of an anchor and of the heads.
    pub model: ModelShape,
    /// What the models of the symbols take.
    pub coder: CoderShape,
    /// Bits of an anchor in memory.
    pub record: RecordShape,
    /// What of the scene is in memory between frames.
    pub resident: Resident,
    /// What a frame is drawn in.
    pub frame: FrameShape,
}

/// Widths of an anchor and of the heads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ModelShape {
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
    /// How the weights of the other heads are kept.
    pub head_weights: HeadWeights,
}

/// What the models of the symbols take: tables or a context.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CoderShape {
    /// Frequency tables; 0 for bundles with a context.
    pub n_tables: u16,
    /// Inputs of the context, four a grid level; 0 for bundles with tables.
    pub context_inputs: u16,
    /// Hidden units of the context; 0 for bundles with tables.
    pub context_hidden: u16,
    /// Numbers that a context keeps from feature to feature or from anchor to anchor.
    pub context_kept: u16,
}

/// Bits of an anchor in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RecordShape {
    /// Bits of the symbols of features, log-scales and offsets, each at most 16.
    pub symbol_bits: [u8; 3],
    /// Bits of a lattice coordinate.
    pub lattice_bits: u8,
    /// Whether anchors say which of their offsets are drawn.
    pub masks: bool,
}

/// What of the scene is in memory between frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Resident {
    /// Nothing: each frame decodes the anchors in view.
    Nothing,
    /// Anchors, decoded when bound.
    Anchors {
        /// How many.
        n_anchors: u32,
        /// Chunks of them.
        n_chunks: u32,
        /// Whether the sums of their features are too.
        with_sums: bool,
    },
    /// Gaussians, evaluated when bound.
    Gaussians {
        /// How many.
        n_gaussians: u32,
        /// Chunks of them.
        n_chunks: u32,
    },
}

/// What a frame is drawn in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FrameShape {
    /// Tiles drawn at once: 1, or those of a strip that is drawn in [slabs](crate::Overflow::Slabs).
    pub canvas_tiles: u32,
    /// Splats in memory.
    pub max_splats: u32,
    /// Chunks of a scene that [two painters](crate::Budget::with_two_painters) draw, each in as much memory, at least 1; 0 for one painter.
    pub shared_chunks: u32,
}

/// Inputs of a context at most: of a grid, or of a parent that gives `n_parent`.
const fn most_inputs(n_parent: u16) -> u16 {
    let grid = (MAX_CONTEXT_LEVELS as u16).saturating_mul(FEATURES_PER_LEVEL as u16);
    let levels = n_parent.saturating_add(N_POSITION_INPUTS as u16);
    if grid > levels { grid } else { levels }
}

impl CoderShape {
    /// Words that the models of the symbols work in.
    pub(super) const fn words(&self) -> usize {
        model_words(self.n_tables, self.context_inputs, self.context_hidden, self.context_kept)
    }

    /// Those of them that are one reader's own: tables are read alone.
    pub(super) const fn own_words(&self) -> usize {
        model_words(0, self.context_inputs, self.context_hidden, self.context_kept)
    }
}

impl Resident {
    /// Anchors or Gaussians in memory.
    pub(super) const fn len(&self) -> usize {
        match *self {
            Self::Nothing => 0,
            Self::Anchors { n_anchors, .. } => n_anchors as usize,
            Self::Gaussians { n_gaussians, .. } => n_gaussians as usize,
        }
    }

    /// Chunks of them.
    pub(crate) const fn n_chunks(&self) -> usize {
        match *self {
            Self::Nothing => 0,
            Self::Anchors { n_chunks, .. } | Self::Gaussians { n_chunks, .. } => n_chunks as usize,
        }
    }

    /// Whether anchors are in memory.
    pub(super) const fn is_anchors(&self) -> bool {
        matches!(self, Self::Anchors { .. })
    }

    /// Whether the sums of the anchors' features are in memory; never without the feature `baked`.
    pub(crate) const fn has_sums(&self) -> bool {
        cfg!(feature = "baked") && matches!(self, Self::Anchors { with_sums: true, .. })
    }

    /// Whether Gaussians are; never without the feature `baked`.
    pub(super) const fn is_gaussians(&self) -> bool {
        cfg!(feature = "baked") && matches!(self, Self::Gaussians { .. })
    }
}

impl ScratchShape {
    /// The largest bundles of F features and K offsets that the writer makes, streamed; without memory for splats yet.
    #[must_use]
    pub const fn most(feature_dim: u16, n_offsets: u16) -> Self {
        Self {
            model: ModelShape {
                feature_dim,
                n_offsets,
                anisotropic: true,
                n_geometry_inputs: 4,
                n_colour_inputs: 4,
                colour_hidden: MAX_FEATURE_DIM,
                detail_hidden: MAX_FEATURE_DIM,
                head_weights: HeadWeights::F32,
            },
            coder: CoderShape {
                n_tables: feature_dim.saturating_add(n_log_scales(true)).saturating_add(n_offsets.saturating_mul(3)),
                context_inputs: most_inputs(feature_dim.saturating_add(n_log_scales(true))),
                context_hidden: MAX_CONTEXT_HIDDEN,
                context_kept: feature_dim.saturating_add(n_log_scales(true)).saturating_mul(2),
            },
            record: RecordShape { symbol_bits: [16; 3], lattice_bits: MAX_LATTICE_BITS, masks: true },
            resident: Resident::Nothing,
            frame: FrameShape { canvas_tiles: 1, max_splats: 0, shared_chunks: 0 },
        }
    }

    /// The shape of one bundle's scratch memory.
    pub(crate) fn of(bundle: &Bundle<'_>, resident: Resident, frame: FrameShape) -> Self {
        let header = bundle.header();
        let few = |n: usize| u16::try_from(n).unwrap_or(u16::MAX);
        Self {
            model: ModelShape {
                feature_dim: header.feature_dim,
                n_offsets: header.n_offsets,
                anisotropic: header.features.effects.anisotropic,
                n_geometry_inputs: few(header.geometry_inputs()).saturating_sub(header.feature_dim),
                n_colour_inputs: few(header.colour_inputs()).saturating_sub(header.feature_dim),
                colour_hidden: header.colour_hidden,
                detail_hidden: header.detail_hidden,
                head_weights: HeadWeights::F32,
            },
            coder: match bundle.coder() {
                Coder::Static(tables) => {
                    CoderShape { n_tables: few(tables.len()), context_inputs: 0, context_hidden: 0, context_kept: 0 }
                }
                Coder::Context(context) => CoderShape {
                    n_tables: 0,
                    context_inputs: few(context.n_inputs()),
                    context_hidden: few(context.n_hidden()),
                    context_kept: few(context.n_kept()),
                },
            },
            record: RecordShape {
                symbol_bits: header.symbol_bits,
                lattice_bits: bundle.lattice().bits,
                masks: bundle.masks().is_some(),
            },
            resident,
            frame,
        }
    }

    /// Floats of the sums of all features in memory.
    pub(super) const fn sums_len(&self) -> usize {
        if self.resident.has_sums() { self.resident.len().saturating_mul(self.heads().anchor_sums_len()) } else { 0 }
    }

    /// At most what is left of multiply-adds of the heads, where the sums of features may be in memory.
    pub(super) const fn evaluated_macs(&self, head_macs: u64) -> u64 {
        let share = if self.resident.has_sums() { self.heads().summed_share() } else { 1024 };
        head_macs.div_ceil(1024).saturating_mul(share as u64)
    }

    /// Widths of the heads that are converted.
    pub(crate) const fn heads(&self) -> HeadShape {
        let model = &self.model;
        let f = limited(model.feature_dim, MAX_FEATURE_DIM);
        HeadShape {
            geometry_inputs: f.saturating_add(model.n_geometry_inputs as usize),
            colour_inputs: f.saturating_add(model.n_colour_inputs as usize),
            feature: f,
            covariance: covariance_outputs(model.anisotropic) as usize,
            colour: limited(model.colour_hidden, MAX_FEATURE_DIM),
            detail: limited(model.detail_hidden, MAX_FEATURE_DIM),
            offsets: limited(model.n_offsets, MAX_OFFSETS),
        }
    }

    /// Words of a second painter's anchor that waits for another, where two are evaluated at a time, which is where weights are halves.
    pub(super) const fn pair_words(&self) -> usize {
        if matches!(self.model.head_weights, HeadWeights::F16) { self.heads().pair_words() } else { 0 }
    }

    /// Entries of each list of splats: those of both painters.
    pub(super) const fn list_len(&self) -> usize {
        (self.frame.max_splats as usize).saturating_mul(if self.frame.shared_chunks > 0 { 2 } else { 1 })
    }

    /// Channels of an anchor: features, log-scales, offsets.
    pub(super) const fn n_channels(&self) -> usize {
        (self.model.feature_dim as usize)
            .saturating_add(n_log_scales(self.model.anisotropic) as usize)
            .saturating_add((self.model.n_offsets as usize).saturating_mul(3))
    }

    /// Where the bits of an anchor in memory lie.
    pub(crate) const fn record_layout(&self) -> RecordLayout {
        let Self { model, record, .. } = *self;
        RecordLayout::new(
            model.feature_dim,
            n_log_scales(model.anisotropic),
            model.n_offsets,
            record.symbol_bits,
            record.lattice_bits,
            if record.masks { model.n_offsets } else { 0 },
            self.coder.context_hidden > 0,
        )
    }
}

/// A width as a length, not above what a bundle may have: no product of two then overflows.
const fn limited(width: u16, most: u16) -> usize {
    (if width < most { width } else { most }) as usize
}
