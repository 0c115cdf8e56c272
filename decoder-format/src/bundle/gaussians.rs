//! The section of Gaussian counts: how many Gaussians a scene consists of that looks the same from everywhere.

use super::directory::Directory;
use super::header::Header;
use crate::bytes::Cursor;
use crate::error::{DecodeError, Field, SectionKind, in_range};

/// Length of a tier's count, bytes.
const COUNT_LEN: usize = 4;

/// One count a tier, of it and those before it.
#[derive(Clone, Copy, Debug)]
pub(super) struct GaussianCounts<'a>(&'a [[u8; COUNT_LEN]]);

impl<'a> GaussianCounts<'a> {
    /// Reads and checks the counts: they do not fall, and no anchor has more Gaussians than offsets.
    pub(super) fn parse(section: &'a [u8], header: &Header, directory: &Directory<'_>) -> Result<Self, DecodeError> {
        let mut cursor = Cursor::new(section, SectionKind::Gaussians);
        let (counts, _) = cursor.bytes(usize::from(header.n_tiers).saturating_mul(COUNT_LEN))?.as_chunks();
        cursor.end()?;
        let mut least = 0;
        for (tier, count) in (0..header.n_tiers).zip(counts) {
            let count = u32::from_le_bytes(*count);
            let n_anchors = directory.tier(tier).map_or(0, |tier| tier.n_anchors);
            in_range(Field::TierGaussians, count, least, n_anchors.saturating_mul(header.n_offsets.into()))?;
            least = count;
        }
        Ok(Self(counts))
    }

    /// The count of the first `n_tiers` tiers.
    pub(super) fn up_to(&self, n_tiers: u8) -> u32 {
        let last = n_tiers.checked_sub(1).and_then(|last| self.0.get(usize::from(last)));
        last.map_or(0, |count| u32::from_le_bytes(*count))
    }
}
