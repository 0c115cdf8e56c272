//! Where a frame's Gaussians come from: anchors decoded again or kept in memory, or Gaussians kept in memory.

use core::ops::Range;

use pocketsplat_format::bundle::{AnchorModels, AnchorRecords, AnchorSite, Chunk, SuspendedReader};
use pocketsplat_format::{DecodeError, Stage, Stopwatch};

use crate::bake::BakedGaussians;
use crate::budget::ReaderMemory;
use crate::mlp::HeadFormat;
use crate::scene::{Evaluator, Workspace};

/// The scene of the planned tiers.
#[expect(clippy::large_enum_variant, reason = "a decoder has one, and there is no allocator to box with")]
pub(super) enum GaussianSource<'b, 's, N: HeadFormat> {
    /// Evaluated in each frame.
    Anchors(Anchors<'b, 's, N>),
    /// Evaluated when bound.
    Baked(BakedGaussians<'s>),
}

/// Anchors, and what evaluates them.
pub(super) struct Anchors<'b, 's, N: HeadFormat> {
    pub(super) source: AnchorSource<'b, 's>,
    /// `[n_channels]` of the current anchor.
    pub(super) row: &'s mut [f32],
    pub(super) evaluator: Evaluator<'s, N>,
}

/// The anchors of the planned tiers.
pub(super) enum AnchorSource<'b, 's> {
    /// Decoded chunk by chunk, one anchor at a time.
    Streamed(AnchorModels<'b, 's>),
    /// Decoded when bound.
    Resident(AnchorRecords<'b, 's>),
}

impl<N: HeadFormat> GaussianSource<'_, '_, N> {
    /// Whether each frame decodes.
    pub(super) fn is_streamed(&self) -> bool {
        matches!(self, Self::Anchors(anchors) if !anchors.source.is_resident())
    }
}

impl<'s, N: HeadFormat> GaussianSource<'_, 's, N> {
    /// The same scene for a second painter, which reads it at the same time.
    ///
    /// * `memory`: what it needs of its own to read anchors.
    pub(super) fn shared(&self, memory: Option<ReaderMemory<'s>>) -> Result<Self, DecodeError> {
        Ok(match (self, memory) {
            // Unreachable without the feature; this arm drops the code.
            (Self::Baked(baked), _) if cfg!(feature = "baked") => Self::Baked(*baked),
            (Self::Anchors(anchors), Some(memory)) => Self::Anchors(anchors.shared(memory)?),
            _ => return Err(DecodeError::Internal),
        })
    }
}

impl<'s, N: HeadFormat> Anchors<'_, 's, N> {
    /// The same anchors and heads for a second painter.
    fn shared(&self, memory: ReaderMemory<'s>) -> Result<Self, DecodeError> {
        let ReaderMemory { models: own, row, inputs, hidden, detail_sums, outputs, pair } = memory;
        let source = match &self.source {
            AnchorSource::Streamed(models) => AnchorSource::Streamed(models.shared(own)?),
            AnchorSource::Resident(records) => AnchorSource::Resident(*records),
        };
        let evaluator = self.evaluator.shared(inputs, Workspace { hidden, detail_sums, outputs }, pair);
        Ok(Self { source, row, evaluator })
    }
}

impl<N: HeadFormat> Anchors<'_, '_, N> {
    /// Makes the sums of all anchors' features, where they are kept; nothing reads the features after that.
    #[inline(never)]
    pub(super) fn fill_sums(&mut self) -> Result<(), DecodeError> {
        let Self { source: AnchorSource::Resident(records), row, evaluator } = self else { return Ok(()) };
        let Some(sums) = evaluator.sums.as_mut().filter(|_| cfg!(feature = "baked")) else { return Ok(()) };
        sums.fill(|number, sums| {
            records.read(number, row).ok_or(DecodeError::Internal)?;
            evaluator.heads.begin(row.get(..evaluator.heads.shape.feature).unwrap_or_default(), sums);
            Ok::<_, DecodeError>(())
        })?;
        *records = records.without_features();
        Ok(())
    }
}

impl<'b> AnchorSource<'b, '_> {
    /// Whether anchors wait in memory.
    pub(super) fn is_resident(&self) -> bool {
        matches!(self, Self::Resident(_))
    }

    /// What reads the anchors of a chunk; `None` where they wait in memory.
    pub(super) fn open(&mut self, chunk: &Chunk<'b>) -> Option<SuspendedReader<'b>> {
        match self {
            Self::Streamed(models) => Some(chunk.anchors(models).suspend()),
            Self::Resident(_) => None,
        }
    }

    /// Calls `each` with the number in the file, the site and the values of the next anchors of a chunk, until it returns false;
    /// returns whether the chunk is at its end.
    ///
    /// * `numbers`: of the anchors to come. * `reader`: that of [`open`](Self::open). * `row`: `[n_channels]`.
    ///
    /// # Errors
    /// [`DecodeError::ChunkStream`] after the last anchor when they were not sound; never when resident.
    pub(super) fn go_on<W: Stopwatch>(
        &mut self,
        numbers: &mut Range<u32>,
        reader: &mut Option<SuspendedReader<'b>>,
        row: &mut [f32],
        watch: &mut W,
        mut each: impl FnMut(u32, AnchorSite, &[f32], &mut W) -> Result<bool, DecodeError>,
    ) -> Result<bool, DecodeError> {
        match self {
            Self::Streamed(models) => {
                let mut anchors = reader.take().ok_or(DecodeError::Internal)?.resume(models);
                for number in numbers {
                    watch.enter(Stage::Decode);
                    let site = anchors.site();
                    anchors.values_watched(row, watch);
                    if !each(number, site, row, watch)? {
                        *reader = Some(anchors.suspend());
                        return Ok(false);
                    }
                }
                anchors.finish().map(|()| true)
            }
            Self::Resident(records) => {
                for number in numbers {
                    watch.enter(Stage::Decode);
                    let site = records.read(number, row).ok_or(DecodeError::Internal)?;
                    if !each(number, site, row, watch)? {
                        return Ok(false);
                    }
                }
                Ok(true)
            }
        }
    }
}
