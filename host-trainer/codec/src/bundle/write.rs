//! From a scene to its coded sections.

use pocketsplat_format::bundle::Features;
use rayon::prelude::*;

use super::channel_coder::ChannelCoder;
use super::chunk::{ChunkRows, Models};
use super::ink::InkBox;
use super::lattice::LatticeModelDraft;
use super::layout::{self, CodedScene, Counts, Parts, Written};
use super::mask::MaskModelDraft;
use super::order::Placement;
use super::quantise::{StepSource, SymbolRows, check_lengths, check_steps, quantise};
use super::table::TableSet;
use super::{BundleInfo, WriteError, directory, heads};
use pocketsplat_kernels::integer_model;
use pocketsplat_kernels::ops::rate::file_order::{CHUNK_ANCHORS, PRUNING_RATES};
use pocketsplat_kernels::scene::{QuantisationSteps, Scene};

/// What gives the channels their steps, and their symbols their frequencies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ChannelCoding {
    /// These steps and static tables, the same for all anchors: cheap to decode.
    Tables(QuantisationSteps),
    /// The scene's context model, anchor by anchor.
    Context,
}

impl Default for ChannelCoding {
    fn default() -> Self {
        Self::Tables(QuantisationSteps::default())
    }
}

/// How a scene is written.
#[derive(Clone, Debug, PartialEq)]
pub struct WriteOptions {
    /// Steps and frequencies of the channels.
    pub channels: ChannelCoding,
    /// `[n_anchors]` larger for anchors that matter more; they come into earlier tiers. Without it there is one tier.
    pub importance: Option<Vec<f32>>,
    /// Pruning rates of the tiers, falling to 0: the share of anchors that the scene of tiers up to each one lacks.
    pub pruning_rates: Vec<f32>,
    /// Bits of the fraction of the heads' weights, those of W1 and of W2, where coding them saves a tenth of their bytes;
    /// without it they stay halves. Nine cost no more than 0.01 dB and save a fifth to a third
    /// (`docs/experiments/2026-11-21-quantisation-steps.md`).
    pub head_fraction_bits: Option<[u8; 2]>,
    /// Anchors of a chunk at most.
    pub chunk_anchors: u16,
}

impl Default for WriteOptions {
    fn default() -> Self {
        Self {
            channels: ChannelCoding::default(),
            importance: None,
            pruning_rates: PRUNING_RATES.to_vec(),
            head_fraction_bits: Some([9, 9]),
            chunk_anchors: CHUNK_ANCHORS,
        }
    }
}

/// Codes a scene: all of its bundle but what is measured.
///
/// Anchors without a drawn offset are left out. Every value is rounded here, once.
///
/// # Errors
/// [`WriteError`] naming the anchor and channel, weight, or count that has no place in the format.
pub fn code(scene: &Scene<f32>, info: &BundleInfo, options: &WriteOptions) -> Result<CodedScene, WriteError> {
    check_lengths(scene)?;
    let n_chunk = usize::from(options.chunk_anchors).max(1);
    let placement = Placement::of(scene, options.importance.as_deref(), &options.pruning_rates, n_chunk)?;
    let writer = Writer { scene, info, placement, options };
    match options.channels {
        ChannelCoding::Tables(steps) => writer.with_tables(steps),
        ChannelCoding::Context => writer.with_context(),
    }
}

/// Writes a scene as a bundle without measures; reads it back once.
///
/// # Errors
/// As [`code`].
pub fn write(scene: &Scene<f32>, info: &BundleInfo, options: &WriteOptions) -> Result<Written, WriteError> {
    code(scene, info, options)?.into_file(&[])
}

/// A scene whose anchors have their places.
struct Writer<'s> {
    scene: &'s Scene<f32>,
    info: &'s BundleInfo,
    placement: Placement,
    options: &'s WriteOptions,
}

impl Writer<'_> {
    fn with_tables(&self, steps: QuantisationSteps) -> Result<CodedScene, WriteError> {
        check_steps(steps)?;
        let steps = steps.into();
        let rows = quantise(self.scene, &self.placement, StepSource::Fixed(steps))?;
        let tables = TableSet::build(&rows, &self.scene.shape, steps);
        let section = tables.section();
        self.code(&rows, ChannelCoder::Tables(tables), section)
    }

    fn with_context(&self) -> Result<CodedScene, WriteError> {
        let model = self.scene.context.as_ref().ok_or(WriteError::NoContext)?;
        let section = integer_model::section(model, self.scene.shape.values_per_anchor())?;
        let context = integer_model::parse(&section, &self.scene.shape).map_err(WriteError::ReadBack)?;
        let rows = quantise(self.scene, &self.placement, StepSource::Context(&context))?;
        self.code(&rows, ChannelCoder::Context(context), section.clone())
    }

    /// * `coder`: the section of `channels`.
    fn code(&self, rows: &SymbolRows, channels: ChannelCoder<'_>, coder: Vec<u8>) -> Result<CodedScene, WriteError> {
        let (shape, placement) = (self.scene.shape, &self.placement);
        let code_runs = placement.chunks.iter().map(|chunk| &placement.codes[chunk.clone()]);
        let all_drawn = u32::MAX.unbounded_shr(u32::BITS - shape.n_offsets as u32);
        let has_masks = placement.drawn.iter().any(|&drawn| drawn != all_drawn);
        let models = Models {
            shape,
            lattice: LatticeModelDraft::count(placement.frame, code_runs),
            masks: has_masks.then(|| MaskModelDraft::count(&placement.drawn, shape.n_offsets)),
            channels,
        };
        let n_channels = rows.n_channels;
        let coded = placement.chunks.par_iter().map(|chunk| {
            let slots = models.slots(ChunkRows {
                lattice: &rows.lattice[chunk.clone()],
                drawn: &rows.drawn[chunk.clone()],
                symbols: &rows.symbols[chunk.start * n_channels..chunk.end * n_channels],
            });
            (slots.into_bytes(), InkBox::of(rows, chunk.clone(), &shape, self.scene.voxel_size as f32))
        });
        let (chunks, boxes): (Vec<Vec<u8>>, Vec<InkBox>) = coded.unzip();
        let heads = heads::section(&self.scene.heads, self.options.head_fraction_bits)?;
        let features = Features {
            effects: layout::effects(self.scene, self.info),
            masks: has_masks,
            context: matches!(models.channels, ChannelCoder::Context(_)),
            coded_heads: heads.is_coded,
        };
        let counts = Counts {
            features,
            n_anchors: placement.order.len(),
            n_chunks: placement.chunks.len(),
            max_chunk_anchors: self.options.chunk_anchors,
            n_tiers: placement.tier_chunks.len(),
            symbol_bits: rows.symbol_bits(&shape),
        };
        let parts = Parts {
            heads: heads.bytes,
            lattice: models.lattice.view().emit().collect(),
            masks: models.masks.as_ref().map(|masks| masks.view().emit().collect()),
            coder,
            directory: directory::section(placement, &chunks, &boxes),
            chunks: directory::joined(&chunks),
        };
        CodedScene::new(layout::header(self.scene, self.info, &counts)?, parts, self.info.protocol.clone())
    }
}
