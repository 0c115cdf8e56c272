//! What an anchor's hidden layers are computed with: two anchors' together, so that each weight is widened once for both, or from sums in
//! memory.

use super::sums::AnchorSums;

/// What an anchor's hidden layers are computed with.
pub(crate) enum Role<'p> {
    /// By themselves.
    Alone,
    /// From what they begin with.
    Begun(AnchorSums<'p>),
    /// With those of a second anchor.
    First {
        /// What the second anchor's heads read.
        inputs: &'p [f32],
        /// `[3, hidden_len]`, for the second anchor's hidden units.
        units: &'p mut [f32],
        /// Heads whose units are there.
        n_known: usize,
    },
    /// With those of the first anchor, as far as that one's were needed.
    Second {
        /// `[3, hidden_len]`.
        units: &'p [f32],
        /// Heads whose units are there.
        n_known: usize,
    },
}

impl<'p> Role<'p> {
    /// The second anchor's, once the first one's layers are computed.
    pub(crate) fn of_second(self) -> Self {
        match self {
            Self::First { units, n_known, .. } => Self::Second { units, n_known },
            other => other,
        }
    }

    /// What the hidden layers begin with, if that is in memory.
    pub(crate) fn sums(&self) -> Option<&AnchorSums<'p>> {
        match self {
            Self::Begun(sums) if cfg!(feature = "baked") => Some(sums),
            _ => None,
        }
    }

    /// The second anchor's hidden units of head `number`, if they were computed with the first one's.
    pub(super) fn known(&self, number: usize, hidden_len: usize) -> Option<&[f32]> {
        match self {
            Self::Second { units, n_known } if number < *n_known => units.chunks_exact(hidden_len.max(1)).nth(number),
            _ => None,
        }
    }

    /// The second anchor's inputs, and where its hidden units of head `number` go; heads follow one another.
    pub(super) fn second(&mut self, number: usize, hidden_len: usize) -> Option<(&[f32], &mut [f32])> {
        match self {
            Self::First { inputs, units, n_known } => {
                *n_known = number + 1;
                Some((inputs, units.chunks_exact_mut(hidden_len.max(1)).nth(number)?))
            }
            _ => None,
        }
    }
}
