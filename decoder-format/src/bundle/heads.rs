//! The heads section: f16 biases, and matrices of f16 or of coded steps.

mod weights;

pub use weights::{CodedHeads, LayerWeights, WeightReader};

use super::header::{Header, covariance_outputs};
use crate::bytes::Cursor;
use crate::error::{DecodeError, Field, SectionKind, saturate};
use crate::math::{from_half, is_finite_half};

/// Matrices of all heads at most: W1 and W2 of opacity, covariance, colour, detail.
const N_MATRICES: usize = if cfg!(feature = "detail") { 8 } else { 6 };

/// IEEE half-precision numbers in flash, each read when asked for.
#[derive(Clone, Copy, Debug, Default)]
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
        self.0.get(index).map(|&bytes| from_half(u16::from_le_bytes(bytes)))
    }

    /// All numbers in file order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = f32> + use<'a> {
        self.0.iter().map(|&bytes| from_half(u16::from_le_bytes(bytes)))
    }

    /// Takes `n` numbers; an infinite one would make frames of NaN without any notice.
    fn parse(cursor: &mut Cursor<'a>, n: usize) -> Result<Self, DecodeError> {
        let first = cursor.position() >> 1;
        let halves = cursor.pairs(n)?;
        for (index, pair) in (first..).zip(halves) {
            if !is_finite_half(u16::from_le_bytes(*pair)) {
                return Err(DecodeError::BadFloat { field: Field::HeadWeight, index: saturate(index) });
            }
        }
        Ok(Self(halves))
    }
}

/// One head of the file, `y = W2·relu(W1·x + b1) + b2`; its matrices come from [`HeadsView::weights`].
#[derive(Clone, Copy, Debug)]
pub struct HeadView<'a> {
    /// Inputs.
    pub n_in: usize,
    /// Hidden units.
    pub n_hidden: usize,
    /// Outputs.
    pub n_out: usize,
    /// `[n_hidden]`.
    pub b1: Halves<'a>,
    /// `[n_out]`.
    pub b2: Halves<'a>,
}

impl HeadView<'_> {
    /// Weights of W1 and of W2.
    fn matrix_sizes(&self) -> [usize; 2] {
        [self.n_hidden.saturating_mul(self.n_in), self.n_out.saturating_mul(self.n_hidden)]
    }
}

/// The heads of the file.
#[derive(Clone, Copy, Debug)]
pub struct HeadsView<'a> {
    /// K outputs: row k is the opacity logit of offset k, through tanh.
    pub opacity: HeadView<'a>,
    /// 7K outputs: rows 7k..7k+3 scale logits, 7k+3..7k+7 an unnormalised quaternion (w, x, y, z). Where Gaussians are
    /// isotropic K outputs: row k the scale logit.
    pub covariance: HeadView<'a>,
    /// 3K outputs: rows 3k..3k+3 the colour logits.
    pub colour: HeadView<'a>,
    /// From feature and colour of a Gaussian to what is added to the colour, if the scene has it.
    pub detail: Option<HeadView<'a>>,
    matrices: Matrices<'a>,
}

#[derive(Clone, Copy, Debug)]
enum Matrices<'a> {
    Raw([Halves<'a>; N_MATRICES]),
    Coded(CodedHeads<'a>),
}

impl<'a> HeadsView<'a> {
    pub(super) fn parse(section: &'a [u8], header: &Header) -> Result<Self, DecodeError> {
        let mut cursor = Cursor::new(section, SectionKind::Heads);
        let shape = |n_in, n_hidden: u16, n_out| HeadView {
            n_in,
            n_hidden: n_hidden.into(),
            n_out,
            b1: Halves::default(),
            b2: Halves::default(),
        };
        let (of_geometry, k) = (header.geometry_inputs(), usize::from(header.n_offsets));
        let effects = header.features.effects;
        let mut all = [
            shape(of_geometry, header.feature_dim, k),
            shape(of_geometry, header.feature_dim, k.saturating_mul(covariance_outputs(effects.anisotropic).into())),
            shape(header.colour_inputs(), header.colour_hidden, k.saturating_mul(3)),
            shape(usize::from(header.feature_dim).saturating_add(3), header.detail_hidden, 3),
        ];
        let has_detail = cfg!(feature = "detail") && effects.detail;
        let n_heads = if has_detail { 4 } else { 3 };
        let heads = all.get_mut(..n_heads).unwrap_or_default();
        // Coded matrices follow the biases of all heads.
        let coded = header.features.coded_heads;
        let tables = if coded { Some(CodedHeads::parse_tables(&mut cursor)?) } else { None };
        let mut matrices = [Halves::default(); N_MATRICES];
        for (head, [w1, w2]) in heads.iter_mut().zip(matrices.as_chunks_mut().0) {
            let [n1, n2] = if coded { [0; 2] } else { head.matrix_sizes() };
            for (halves, n) in [(w1, n1), (&mut head.b1, head.n_hidden), (w2, n2), (&mut head.b2, head.n_out)] {
                *halves = Halves::parse(&mut cursor, n)?;
            }
        }
        let matrices = match tables {
            Some(tables) => Matrices::Coded(CodedHeads::new(tables, cursor.rest())?),
            None => {
                cursor.end()?;
                Matrices::Raw(matrices)
            }
        };
        let [opacity, covariance, colour, detail] = all;
        let detail = has_detail.then_some(detail);
        let heads = Self { opacity, covariance, colour, detail, matrices };
        heads.check()?;
        Ok(heads)
    }

    /// Opacity, covariance, colour, then detail if there is one.
    pub fn each(&self) -> impl Iterator<Item = HeadView<'a>> + use<'a> {
        [self.opacity, self.covariance, self.colour].into_iter().chain(self.detail)
    }

    /// How the matrices are coded, if they are.
    #[must_use]
    pub fn coded(&self) -> Option<&CodedHeads<'a>> {
        match &self.matrices {
            Matrices::Raw(_) => None,
            Matrices::Coded(coded) => Some(coded),
        }
    }

    /// Starts reading the matrices, one after the other.
    #[must_use]
    pub fn weights(&self) -> WeightReader<'a> {
        let mut sizes = [[0; 2]; N_MATRICES / 2];
        for (size, head) in sizes.iter_mut().zip(self.each()) {
            *size = head.matrix_sizes();
        }
        WeightReader::new(&self.matrices, sizes)
    }

    /// Coded matrices end where the section ends.
    fn check(&self) -> Result<(), DecodeError> {
        let mut weights = self.weights();
        if self.coded().is_some() {
            for _ in 0..N_MATRICES {
                weights.next_layer().for_each(drop);
            }
        }
        weights.finish().map_err(|left| DecodeError::HeadStream { left_bytes: saturate(left) })
    }
}
