//! The matrices of the heads, weight by weight, however they are stored.

use super::{DecodeError, Field, Halves, Matrices, N_MATRICES, SectionKind};
use crate::bundle::tables::FrequencyTable;
use crate::bytes::Cursor;
use crate::entropy::AnsReader;
use crate::math::from_half;

/// Limits of the step of a coded weight: a power of two, and |weight| ≤ 32768·step within the range of an f16.
const STEPS: core::ops::RangeInclusive<f32> = 1.0 / 16_777_216.0..=1.0;

/// Matrices stored as symbols: a weight is `symbol·step`.
#[derive(Clone, Copy, Debug)]
pub struct CodedHeads<'a> {
    /// Of all first layers, of all second layers.
    pub tables: [FrequencyTable<'a>; 2],
    /// Words of the one stream that holds W1 and W2 of each head, row-major.
    pub words: &'a [[u8; 2]],
}

/// Reads the matrices in their order: W1 and W2 of opacity, covariance, colour, and of detail if there is one.
#[derive(Clone, Copy, Debug)]
pub struct WeightReader<'a> {
    sizes: [[usize; 2]; N_MATRICES / 2],
    n_read: usize,
    source: Source<'a>,
}

#[derive(Clone, Copy, Debug)]
enum Source<'a> {
    Raw([Halves<'a>; N_MATRICES]),
    Coded([FrequencyTable<'a>; 2], AnsReader<'a>),
}

/// The weights of one matrix, row-major; read it to its end before the next.
#[derive(Debug)]
pub struct LayerWeights<'r, 'a> {
    n_left: usize,
    source: LayerSource<'r, 'a>,
}

#[derive(Debug)]
enum LayerSource<'r, 'a> {
    Raw(Halves<'a>),
    Coded(FrequencyTable<'a>, &'r mut AnsReader<'a>),
}

impl<'a> CodedHeads<'a> {
    pub(super) fn parse_tables(cursor: &mut Cursor<'a>) -> Result<[FrequencyTable<'a>; 2], DecodeError> {
        let tables = [FrequencyTable::parse(cursor)?, FrequencyTable::parse(cursor)?];
        for (index, table) in (0..).zip(&tables) {
            table.check(SectionKind::Heads, index)?;
            let power_of_two = table.step.to_bits() & 0x7F_FFFF == 0;
            if !(table.origin == 0.0 && power_of_two && STEPS.contains(&table.step)) {
                return Err(DecodeError::BadFloat { field: Field::HeadStep, index });
            }
        }
        Ok(tables)
    }

    pub(super) fn new(tables: [FrequencyTable<'a>; 2], words: &'a [u8]) -> Result<Self, DecodeError> {
        let (words, odd_byte) = words.as_chunks();
        if !odd_byte.is_empty() {
            return Err(DecodeError::HeadStream { left_bytes: 1 });
        }
        Ok(Self { tables, words })
    }
}

impl<'a> WeightReader<'a> {
    pub(super) fn new(matrices: &Matrices<'a>, sizes: [[usize; 2]; N_MATRICES / 2]) -> Self {
        let source = match matrices {
            Matrices::Raw(halves) => Source::Raw(*halves),
            Matrices::Coded(coded) => Source::Coded(coded.tables, AnsReader::new(coded.words)),
        };
        Self { sizes, n_read: 0, source }
    }

    /// The next matrix; empty after the last.
    ///
    /// # Budget
    /// A conversion or a symbol a weight.
    pub fn next_layer(&mut self) -> LayerWeights<'_, 'a> {
        let index = self.n_read;
        self.n_read = index.saturating_add(1);
        let n_left = self.sizes.as_flattened().get(index).copied().unwrap_or_default();
        let source = match &mut self.source {
            Source::Raw(halves) => LayerSource::Raw(halves.get(index).copied().unwrap_or_default()),
            Source::Coded([w1, w2], symbols) => LayerSource::Coded(if index & 1 == 0 { *w1 } else { *w2 }, symbols),
        };
        LayerWeights { n_left, source }
    }

    /// Ends after the last matrix; tells how many bytes of a coded stream are left when it does not end there.
    pub(super) fn finish(self) -> Result<(), usize> {
        match self.source {
            Source::Raw(_) => Ok(()),
            Source::Coded(_, symbols) => symbols.finish(),
        }
    }
}

impl Iterator for LayerWeights<'_, '_> {
    type Item = f32;

    #[inline]
    fn next(&mut self) -> Option<f32> {
        self.n_left = self.n_left.checked_sub(1)?;
        match &mut self.source {
            LayerSource::Raw(Halves(halves)) => {
                let (&first, rest) = halves.split_first()?;
                *halves = rest;
                Some(from_half(u16::from_le_bytes(first)))
            }
            LayerSource::Coded(table, symbols) => Some(table.value(table.symbol(symbols))),
        }
    }
}
