//! Carves one byte slice into typed slices.

use bytemuck::Pod;
use pocketsplat_format::{DecodeError, Region, saturate};

/// The part of the caller's memory not yet handed out, in words of four bytes.
pub(crate) struct Arena<'s> {
    rest: &'s mut [u32],
}

impl<'s> Arena<'s> {
    /// Bytes to plan so that `n_words` words fit whatever the alignment of the caller's slice.
    pub(crate) const fn bytes_for(n_words: usize) -> Option<usize> {
        let Some(bytes) = n_words.checked_mul(4) else { return None };
        bytes.checked_add(3)
    }

    /// Skips the up to three bytes before the first aligned word.
    pub(crate) fn new(scratch: &'s mut [u8]) -> Self {
        let skipped = scratch.as_ptr().align_offset(align_of::<u32>());
        let (_, aligned) = scratch.split_at_mut_checked(skipped).unwrap_or_default();
        let n_whole = aligned.len() & !3;
        let (words, _) = aligned.split_at_mut_checked(n_whole).unwrap_or_default();
        Self { rest: bytemuck::try_cast_slice_mut(words).unwrap_or_default() }
    }

    /// All of `words`.
    pub(crate) fn of_words(words: &'s mut [u32]) -> Self {
        Self { rest: words }
    }

    /// Words not yet handed out.
    #[cfg(test)]
    pub(crate) fn n_words(&self) -> usize {
        self.rest.len()
    }

    /// The same memory for a while.
    pub(crate) fn borrow(&mut self) -> Arena<'_> {
        Arena { rest: self.rest }
    }

    /// The next `n` values of `T`, whose size must divide the words taken; their content is arbitrary.
    pub(crate) fn take<T: Pod>(&mut self, n: usize) -> Result<&'s mut [T], DecodeError> {
        let n_words = words_for::<T>(n).ok_or(DecodeError::Internal)?;
        let rest = core::mem::take(&mut self.rest);
        let available = saturate(rest.len());
        let Some((head, rest)) = rest.split_at_mut_checked(n_words) else {
            return Err(DecodeError::ScratchTooSmall { region: Region::Fast, needed: saturate(n_words), available });
        };
        self.rest = rest;
        bytemuck::try_cast_slice_mut(head).map_err(|_| DecodeError::Internal)
    }
}

/// Words that `n` values of `T` fill.
pub(crate) const fn words_for<T>(n: usize) -> Option<usize> {
    match size_of::<T>().checked_mul(n) {
        Some(bytes) => Some(bytes.div_ceil(4)),
        None => None,
    }
}

#[cfg(test)]
mod tests {
    use super::Arena;

    #[test]
    fn any_alignment_yields_the_planned_words() {
        let needed = Arena::bytes_for(5).expect("20 bytes and some");
        let mut memory = [0_u8; 64];
        for start in 0..4 {
            let scratch = memory.get_mut(start..start + needed).expect("inside");
            let mut arena = Arena::new(scratch);
            assert_eq!(arena.take::<f32>(2).map(|s| s.len()), Ok(2), "two floats from {start}");
            assert_eq!(arena.take::<[u8; 4]>(3).map(|s| s.len()), Ok(3), "three quads from {start}");
        }
    }
}
