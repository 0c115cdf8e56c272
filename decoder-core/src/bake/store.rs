//! Baked Gaussians in memory, chunk by chunk.

use core::ops::Range;

use pocketsplat_format::bundle::Effects;
use pocketsplat_format::{DecodeError, Field, saturate};

use super::record::BakedGaussian;
use crate::scene::Gaussian;

/// Set in the entry of a chunk that was left out because of damage; there are never so many Gaussians.
const DAMAGED: u32 = 1 << 31;

/// The memory that Gaussians are kept in.
pub(crate) struct BakedMemory<'s> {
    /// `[n_gaussians]`.
    pub(crate) records: &'s mut [BakedGaussian],
    /// `[n_chunks + 1]`.
    pub(crate) starts: &'s mut [u32],
}

/// Takes Gaussians chunk by chunk.
pub(crate) struct Baker<'s> {
    memory: BakedMemory<'s>,
    n_chunks: usize,
    /// Gaussians so far, those without a place included.
    pub(super) n: u32,
}

/// Gaussians evaluated when bound.
#[derive(Clone, Copy)]
pub(crate) struct BakedGaussians<'s> {
    records: &'s [BakedGaussian],
    starts: &'s [u32],
}

impl<'s> Baker<'s> {
    pub(super) fn new(memory: BakedMemory<'s>) -> Self {
        memory.starts.fill(0);
        Self { memory, n_chunks: 0, n: 0 }
    }

    /// Keeps the next Gaussian of a chunk, if there is a place.
    pub(super) fn push(&mut self, gaussian: &Gaussian) {
        if let Some(record) = self.memory.records.get_mut(self.n as usize) {
            *record = BakedGaussian::new(gaussian);
        }
        self.n = self.n.saturating_add(1);
    }

    /// Ends a chunk whose first Gaussian was number `first`; of a damaged one nothing is kept.
    pub(super) fn end_chunk(&mut self, first: u32, is_damaged: bool) {
        if is_damaged {
            self.n = first;
        }
        let end = self.n;
        if let Some([start, next, ..]) = self.memory.starts.get_mut(self.n_chunks..) {
            *start = first | if is_damaged { DAMAGED } else { 0 };
            *next = end;
        }
        self.n_chunks = self.n_chunks.saturating_add(1);
    }

    /// Gaussians of the first `n_chunks` chunks, those without a place included.
    pub(crate) fn n_of_first(&self, n_chunks: u32) -> u32 {
        self.memory.starts.get(n_chunks as usize).map_or(0, |start| start & !DAMAGED)
    }

    /// What was kept.
    ///
    /// # Errors
    /// [`DecodeError::OutOfRange`] when there were more Gaussians than places: the bundle says too few.
    pub(crate) fn finish(self) -> Result<BakedGaussians<'s>, DecodeError> {
        let BakedMemory { records, starts } = self.memory;
        let n_places = saturate(records.len());
        if self.n > n_places {
            return Err(DecodeError::OutOfRange { field: Field::TierGaussians, found: self.n, limit: n_places });
        }
        Ok(BakedGaussians { records, starts })
    }
}

impl BakedGaussians<'_> {
    /// Whether a chunk was left out because of damage.
    pub(crate) fn is_damaged(&self, chunk: u32) -> bool {
        self.starts.get(chunk as usize).is_some_and(|start| start & DAMAGED != 0)
    }

    /// Gaussians of a chunk.
    pub(crate) fn n_of_chunk(&self, chunk: u32) -> u32 {
        self.numbers_of_chunk(chunk).len() as u32
    }

    /// The numbers of the Gaussians of a chunk, in the order of the file.
    pub(crate) fn numbers_of_chunk(&self, chunk: u32) -> Range<u32> {
        match self.starts.get(chunk as usize..) {
            Some([first, end, ..]) => first & !DAMAGED..end & !DAMAGED,
            _ => 0..0,
        }
    }

    /// The Gaussian of this number, if there is one.
    pub(crate) fn gaussian(&self, number: u32, effects: Effects) -> Option<Gaussian> {
        Some(self.records.get(number as usize)?.unpack(effects))
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

    use super::{BakedGaussian, BakedMemory, Baker, DecodeError, Effects, Field};
    use crate::scene::Gaussian;

    #[test]
    fn a_damaged_chunk_leaves_nothing_behind() {
        let gaussian = |opacity: f32| Gaussian {
            centre: [0.0; 3],
            scale: [1.0; 3],
            rotation: [1.0, 0.0, 0.0, 0.0],
            opacity,
            colour: [0.5; 3],
        };
        let mut records = [BakedGaussian::zeroed(); 3];
        let mut starts = [9; 4];
        let mut baker = Baker::new(BakedMemory { records: &mut records, starts: &mut starts });
        for (opacities, is_damaged) in [(&[0.1, 0.2][..], false), (&[0.9, 0.9, 0.9, 0.9], true), (&[0.3], false)] {
            let first = baker.n;
            for &opacity in opacities {
                baker.push(&gaussian(opacity));
            }
            baker.end_chunk(first, is_damaged);
        }
        assert_eq!(baker.n, 3, "two and one");
        let baked = baker.finish().expect("a place for each");
        assert_eq!([0, 1, 2, 3].map(|chunk| baked.n_of_chunk(chunk)), [2, 0, 1, 0], "the fourth is none");
        assert_eq!([0, 1, 2].map(|chunk| baked.is_damaged(chunk)), [false, true, false], "the second");
        let kept: std::vec::Vec<f32> =
            baked.records.iter().map(|record| record.unpack(Effects::default()).opacity).collect();
        let near = kept.iter().zip([0.1, 0.2, 0.3]).all(|(kept, whole)| (kept - whole).abs() < 2e-4);
        assert!(near && kept.len() == 3, "{kept:?}");
    }

    #[test]
    fn more_than_there_are_places_for_are_refused_by_number() {
        let gaussian = Gaussian {
            centre: [0.0; 3],
            scale: [1.0; 3],
            rotation: [1.0, 0.0, 0.0, 0.0],
            opacity: 0.5,
            colour: [0.5; 3],
        };
        let (mut records, mut starts) = ([BakedGaussian::zeroed(); 2], [0; 2]);
        let mut baker = Baker::new(BakedMemory { records: &mut records, starts: &mut starts });
        (0..3).for_each(|_| baker.push(&gaussian));
        baker.end_chunk(0, false);
        assert_eq!(baker.n_of_first(1), 3, "counted all the same");
        let expected = DecodeError::OutOfRange { field: Field::TierGaussians, found: 3, limit: 2 };
        assert_eq!(baker.finish().err(), Some(expected), "the bundle said two");
    }
}
