//! A file cut after a tier, so that it knows its own length.

use super::Bundle;
use super::directory::Tier;
use crate::bytes::crc32;
use crate::error::{DecodeError, Field, SectionKind, in_range};

/// Where the header has the length of the file.
const FILE_LEN: core::ops::Range<usize> = 12..16;

/// Makes a file of the first `n_tiers` tiers: writes its length and the header's checksum anew, and returns how many bytes it has;
/// those behind them belong to it no longer. So it is the smaller scene wherever it lies, at the front of a longer flash partition
/// too.
///
/// * `bytes`: a bundle, which may go on behind its end. * `n_tiers`: 1 to those in the file.
///
/// # Errors
/// As [`Bundle::parse`]; [`DecodeError::OutOfRange`] for tiers that the file has not.
///
/// # Budget
/// That of [`Bundle::parse`], and the header's checksum.
pub fn cut_after(bytes: &mut [u8], n_tiers: u8) -> Result<usize, DecodeError> {
    let bundle = Bundle::parse(bytes)?;
    in_range(Field::TiersToKeep, n_tiers.into(), 1, bundle.n_tiers().into())?;
    let Tier { end, .. } = bundle.up_to_tier(n_tiers);
    let chunks = bundle.sections().find(|section| section.kind == SectionKind::Chunks).ok_or(DecodeError::Internal)?;
    let file_len = chunks.offset.saturating_add(end);
    let crc_at = usize::from(bundle.header().header_len).saturating_sub(4);
    bytes.get_mut(FILE_LEN).ok_or(DecodeError::Internal)?.copy_from_slice(&file_len.to_le_bytes());
    let (checked, rest) = bytes.split_at_mut_checked(crc_at).ok_or(DecodeError::Internal)?;
    *rest.first_chunk_mut().ok_or(DecodeError::Internal)? = crc32(checked).to_le_bytes();
    Ok(file_len as usize)
}
