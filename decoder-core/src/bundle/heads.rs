//! The heads section: f16 weights, read where they lie.

use half::f16;

use super::cursor::{Cursor, saturate};
use super::header::Header;
use crate::error::{DecodeError, Field, SectionKind};

/// IEEE half-precision numbers in flash, each read when asked for.
#[derive(Clone, Copy, Debug)]
pub struct Halves<'a>(&'a [[u8; 2]]);

impl<'a> Halves<'a> {
    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Number `index`.
    #[must_use]
    pub fn get(&self, index: usize) -> Option<f32> {
        self.0.get(index).map(|&bytes| f16::from_le_bytes(bytes).to_f32())
    }

    /// All numbers in file order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = f32> + use<'a> {
        self.0.iter().map(|&bytes| f16::from_le_bytes(bytes).to_f32())
    }
}

/// One head of the file: `y = W2·relu(W1·x + b1) + b2`.
#[derive(Clone, Copy, Debug)]
pub struct HeadView<'a> {
    /// Inputs.
    pub n_in: usize,
    /// Hidden units F.
    pub n_hidden: usize,
    /// Outputs.
    pub n_out: usize,
    /// `[n_hidden, n_in]`, row-major.
    pub w1: Halves<'a>,
    /// `[n_hidden]`.
    pub b1: Halves<'a>,
    /// `[n_out, n_hidden]`, row-major.
    pub w2: Halves<'a>,
    /// `[n_out]`.
    pub b2: Halves<'a>,
}

/// The three heads of the file.
#[derive(Clone, Copy, Debug)]
pub struct HeadsView<'a> {
    /// K outputs: row k is the opacity logit of offset k, through tanh.
    pub opacity: HeadView<'a>,
    /// 7K outputs: rows 7k..7k+3 scale logits, 7k+3..7k+7 an unnormalised quaternion (w, x, y, z).
    pub covariance: HeadView<'a>,
    /// 3K outputs: rows 3k..3k+3 the colour logits.
    pub colour: HeadView<'a>,
}

impl<'a> HeadsView<'a> {
    pub(super) fn parse(bytes: &'a [u8], header: &Header) -> Result<Self, DecodeError> {
        let mut cursor = Cursor::new(bytes, SectionKind::Heads);
        let [opacity, covariance, colour] =
            [1, 7, 3].map(|per_offset| HeadView::parse(&mut cursor, header, per_offset));
        let heads = Self { opacity: opacity?, covariance: covariance?, colour: colour? };
        if !cursor.rest().is_empty() {
            return Err(DecodeError::WrongLength {
                section: SectionKind::Heads,
                expected: saturate(cursor.position()),
                found: saturate(bytes.len()),
            });
        }
        // One pass over all weights: an infinite one would make frames of NaN without any notice.
        for (index, pair) in (0..).zip(bytes.as_chunks::<2>().0) {
            if !f16::from_le_bytes(*pair).is_finite() {
                return Err(DecodeError::BadFloat { field: Field::HeadWeight, index });
            }
        }
        Ok(heads)
    }
}

impl<'a> HeadView<'a> {
    fn parse(cursor: &mut Cursor<'a>, header: &Header, per_offset: usize) -> Result<Self, DecodeError> {
        let n_in = header.head_inputs();
        let n_hidden = usize::from(header.feature_dim);
        let n_out = usize::from(header.n_offsets).saturating_mul(per_offset);
        Ok(Self {
            n_in,
            n_hidden,
            n_out,
            w1: Halves(cursor.pairs(n_hidden.saturating_mul(n_in))?),
            b1: Halves(cursor.pairs(n_hidden)?),
            w2: Halves(cursor.pairs(n_out.saturating_mul(n_hidden))?),
            b2: Halves(cursor.pairs(n_out)?),
        })
    }
}
