//! From a scene to its coded sections.

use pocketsplat_core::bundle::Features;
use pocketsplat_core::context::Context;
use rayon::prelude::*;

use super::channel_coder::ChannelCoder;
use super::channels::{ContextWork, GROUPS};
use super::chunk::{ChunkRows, Models};
use super::ink::InkBox;
use super::lattice::LatticeModel;
use super::layout::{self, CodedScene, Counts, Parts};
use super::mask::MaskModel;
use super::order::Placement;
use super::quantise::{Rows, StepSource, check_lengths, quantise};
use super::table::TableSet;
use super::{BundleInfo, SizeReport, WriteError, directory, heads};
use crate::integer_model;
use crate::scene::QuantisationSteps;
use crate::scene::Scene;

/// What gives the symbols of the channels their frequencies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Coder {
    /// The smaller file. Quality is not compared: tables' steps do not follow the place.
    #[default]
    Auto,
    /// Tables, the same for all anchors: cheap to decode.
    Static,
    /// The scene's context model.
    Context,
}

/// How a scene is written.
#[derive(Clone, Debug, PartialEq)]
pub struct WriteOptions {
    /// Steps of a scene without a context model.
    pub steps: QuantisationSteps,
    /// What gives the symbols their frequencies.
    pub coder: Coder,
    /// Steps of static tables for a scene that has a context model, in units of the mean steps of that.
    pub mean_step_share: f32,
    /// `[n_anchors]` larger for anchors that matter more; they come into earlier tiers. Without it there is one tier.
    pub importance: Option<Vec<f32>>,
    /// Pruning rates of the tiers, falling to 0: the share of anchors that the scene of tiers up to each one lacks.
    pub pruning_rates: Vec<f32>,
    /// Bits of the fraction of the heads' weights, those of W1 and of W2, where coding them saves a tenth of their bytes;
    /// without it they stay halves. Nine cost no more than 0.01 dB and save a fifth to a third (`docs/benchmarks.md`).
    pub head_fraction_bits: Option<[u8; 2]>,
    /// Anchors of a chunk at most: neighbours enough to pay for its record, few enough to skip.
    pub chunk_anchors: u16,
}

impl Default for WriteOptions {
    fn default() -> Self {
        Self {
            steps: QuantisationSteps::default(),
            coder: Coder::Auto,
            mean_step_share: 1.0,
            importance: None,
            pruning_rates: vec![0.40, 0.30, 0.20, 0.10, 0.05, 0.0],
            head_fraction_bits: Some([9, 9]),
            chunk_anchors: 256,
        }
    }
}

/// A bundle just written.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The file.
    pub bytes: Vec<u8>,
    /// Where its bytes went.
    pub report: SizeReport,
}

/// Codes a scene: all of its bundle but what is measured.
///
/// Anchors without a drawn offset are left out. With a scene that has a context model the static coder takes each group's
/// mean step over the anchors (geometric, to the eighth of an octave): about the same quality where steps differ little from place to
/// place, decibels less where they differ much.
///
/// # Errors
/// [`WriteError`] naming the anchor and channel, weight, or count that has no place in the format.
pub fn code(scene: &Scene<f32>, info: &BundleInfo, options: &WriteOptions) -> Result<CodedScene, WriteError> {
    check_lengths(scene)?;
    let n_chunk = usize::from(options.chunk_anchors).max(1);
    let placement = Placement::of(scene, options.importance.as_deref(), &options.pruning_rates, n_chunk)?;
    let writer = Writer { scene, info, placement, options };
    match (&scene.context, options.coder) {
        (None, Coder::Context) => Err(WriteError::NoContext),
        (None, Coder::Auto | Coder::Static) => {
            let QuantisationSteps { feature, log_scale, offset } = options.steps;
            writer.with_tables([feature, log_scale, offset])
        }
        (Some(model), coder) => {
            let section = integer_model::section(model, scene.shape.values_per_anchor())?;
            let context = integer_model::parse(&section, &scene.shape).map_err(WriteError::ReadBack)?;
            let with_context = || writer.with_context(&context, &section);
            let with_tables = || writer.with_tables(writer.mean_steps(&context, model.base_steps));
            match coder {
                Coder::Context => with_context(),
                Coder::Static => with_tables(),
                Coder::Auto => {
                    let [by_context, by_tables] = [with_context()?, with_tables()?];
                    Ok(if by_tables.file_len() < by_context.file_len() { by_tables } else { by_context })
                }
            }
        }
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
    fn with_tables(&self, steps: [f32; 3]) -> Result<CodedScene, WriteError> {
        let rows = quantise(self.scene, &self.placement, StepSource::Fixed(steps))?;
        let tables = TableSet::build(&rows, &self.scene.shape, steps);
        let section = tables.section();
        self.code(&rows, ChannelCoder::Tables(tables), section)
    }

    fn with_context(&self, context: &Context<'_>, section: &[u8]) -> Result<CodedScene, WriteError> {
        let rows = quantise(self.scene, &self.placement, StepSource::Context(context))?;
        self.code(&rows, ChannelCoder::Context(*context), section.to_vec())
    }

    /// `share·base·2^(q̄/8)` for each group, q̄ being the mean exponent over the anchors.
    fn mean_steps(&self, context: &Context<'_>, base_steps: [f32; 3]) -> [f32; 3] {
        let mut work = ContextWork::default();
        let mut sums = [0_i64; 3];
        for &anchor in &self.placement.order {
            let steps = work.enter(context, self.scene.anchors.lattice[anchor]);
            for (sum, group) in sums.iter_mut().zip(GROUPS) {
                *sum += i64::from(steps.exponent(group));
            }
        }
        let n = self.placement.order.len().max(1) as f64;
        let share = self.options.mean_step_share;
        std::array::from_fn(|group| share * base_steps[group] * (sums[group] as f64 / n / 8.0).exp2() as f32)
    }

    /// * `coder`: the section of `channels`.
    fn code(&self, rows: &Rows, channels: ChannelCoder<'_>, coder: Vec<u8>) -> Result<CodedScene, WriteError> {
        let (shape, placement) = (self.scene.shape, &self.placement);
        let code_runs = placement.chunks.iter().map(|chunk| &placement.codes[chunk.clone()]);
        let all_drawn = u32::MAX.unbounded_shr(u32::BITS - shape.n_offsets as u32);
        let has_masks = placement.drawn.iter().any(|&drawn| drawn != all_drawn);
        let models = Models {
            shape,
            lattice: LatticeModel::count(placement.frame, code_runs),
            masks: has_masks.then(|| MaskModel::count(&placement.drawn, shape.n_offsets)),
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
            chunks: chunks.concat(),
        };
        CodedScene::new(layout::header(self.scene, self.info, &counts)?, parts)
    }
}
