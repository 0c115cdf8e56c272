//! The masks section: how often each offset is drawn.

use crate::bytes::Cursor;
use crate::entropy::{FREQUENCY_TOTAL, MaskModel, N_MASK_CONTEXTS};
use crate::error::{DecodeError, Field, SectionKind, in_range};

impl<'a> MaskModel<'a> {
    /// Reads and checks the frequencies of `n_offsets` offsets.
    pub(super) fn parse(section: &'a [u8], n_offsets: u16) -> Result<Self, DecodeError> {
        let mut cursor = Cursor::new(section, SectionKind::Masks);
        let frequencies = cursor.pairs(usize::from(n_offsets).saturating_mul(N_MASK_CONTEXTS))?;
        cursor.end()?;
        for &frequency in frequencies {
            let most = FREQUENCY_TOTAL.saturating_sub(1);
            in_range(Field::MaskFrequency, u16::from_le_bytes(frequency).into(), 1, most.into())?;
        }
        let (offsets, _) = frequencies.as_chunks();
        Ok(Self::new(offsets))
    }

    /// The section's bytes: the reverse of `parse`.
    pub fn emit(&self) -> impl Iterator<Item = u8> + use<'a> {
        self.offsets().as_flattened().as_flattened().iter().copied()
    }
}
