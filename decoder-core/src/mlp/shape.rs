//! Widths of the heads, and what follows from them: floats in memory and multiply-adds.

use super::block::{HeadWeights, n_rows};
use super::weight::LANES;

/// Widths of the heads of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct HeadShape {
    /// Inputs of the opacity and of the covariance head.
    pub(crate) geometry_inputs: usize,
    /// Inputs of the colour head.
    pub(crate) colour_inputs: usize,
    /// F, which is also the hidden width of the opacity and covariance heads.
    pub(crate) feature: usize,
    /// Outputs of the covariance head an offset: 7, or 1 where Gaussians are isotropic.
    pub(crate) covariance: usize,
    /// Hidden width of the colour head.
    pub(crate) colour: usize,
    /// Hidden width of the detail head; 0 without one.
    pub(crate) detail: usize,
    /// K.
    pub(crate) offsets: usize,
}

impl HeadShape {
    /// Inputs of these three, of which the one that sees less reads the first.
    pub(crate) const fn inputs(&self) -> usize {
        if self.geometry_inputs > self.colour_inputs { self.geometry_inputs } else { self.colour_inputs }
    }

    /// Words of all heads in scratch memory, whatever they are multiplied in: integers take no more than floats of either width.
    pub(crate) const fn words(&self, weights: HeadWeights) -> usize {
        let Self { geometry_inputs, colour_inputs, feature: f, covariance: v, colour: c, detail: d, offsets: k } =
            *self;
        let n = [
            LANES * n_rows::<LANES>(geometry_inputs, f),
            LANES * n_rows::<LANES>(colour_inputs, c),
            n_rows::<1>(f, k),
            v * n_rows::<1>(f, k),
            3 * n_rows::<3>(c, 3 * k),
        ];
        // Integers take a step and a bias for each output, which one pair less a unit pays for when there are two units.
        let steps = if f == 1 { (1 + v) * k } else { 0 } + if c == 1 { 3 * k } else { 0 };
        let floats = 2 * n[0] + n[1] + n[2] + n[3] + n[4] + steps;
        let detail = if d == 0 { 0 } else { LANES * n_rows::<LANES>(f + 3, d) + 3 * n_rows::<3>(d, 3) };
        let of_one = match weights {
            HeadWeights::F32 => floats,
            HeadWeights::F16 => {
                let [w0, w1, w2, w3, w4] =
                    [n[0].div_ceil(2), n[1].div_ceil(2), n[2].div_ceil(2), n[3].div_ceil(2), n[4].div_ceil(2)];
                let halves = 2 * w0 + w1 + w2 + w3 + w4 + self.pair_words();
                let integers = self.integer_words();
                let most = if halves > integers { halves } else { integers };
                if most < floats { most } else { floats }
            }
        };
        of_one + detail
    }

    /// Words of the anchor that waits for a second one, and of what is computed for the second one beside the first.
    pub(crate) const fn pair_words(&self) -> usize {
        3 * self.offsets + self.inputs() + self.pair_units_len()
    }

    /// Floats of the second anchor's hidden units where two are evaluated at a time.
    pub(crate) const fn pair_units_len(&self) -> usize {
        3 * self.hidden_len()
    }

    /// Words of the heads in integers.
    const fn integer_words(&self) -> usize {
        let Self { geometry_inputs, colour_inputs, feature: f, covariance: v, colour: c, offsets: k, .. } = *self;
        2 * (f.next_multiple_of(4) * (geometry_inputs / 2 + 1))
            + c.next_multiple_of(4) * (colour_inputs / 2 + 1)
            + (1 + v) * k * (f.div_ceil(2) + 2)
            + 3 * k * (c.div_ceil(2) + 2)
    }

    /// Floats of the widest hidden layer's activations.
    pub(crate) const fn hidden_len(&self) -> usize {
        let widest = if self.feature > self.colour { self.feature } else { self.colour };
        let widest = if widest > self.detail { widest } else { self.detail };
        widest.next_multiple_of(LANES)
    }

    /// Floats of the detail head's sums, see [`Detail::begin`](super::detail::Detail::begin).
    pub(crate) const fn sums_len(&self) -> usize {
        self.detail.next_multiple_of(LANES)
    }

    /// Floats of what [`FeatureSums`](super::FeatureSums) keep of an anchor: of the hidden units of three heads, and of the detail head.
    pub(crate) const fn anchor_sums_len(&self) -> usize {
        self.head_sums_at(3) + self.sums_len()
    }

    /// Where among them those of head `number` begin, opacity, covariance and colour; of 3 those of the detail head.
    pub(super) const fn head_sums_at(&self, number: usize) -> usize {
        let geometry = self.feature.next_multiple_of(LANES);
        if number < 3 { number * geometry } else { 2 * geometry + self.colour.next_multiple_of(LANES) }
    }

    /// Those of one anchor by heads.
    pub(super) fn head_sums<'p>(&self, sums: &'p mut [f32]) -> [&'p mut [f32]; 4] {
        let (opacity, rest) = sums.split_at_mut_checked(self.head_sums_at(1)).unwrap_or_default();
        let (covariance, rest) = rest.split_at_mut_checked(self.head_sums_at(1)).unwrap_or_default();
        let colour_len = self.head_sums_at(3) - self.head_sums_at(2);
        let (colour, detail) = rest.split_at_mut_checked(colour_len).unwrap_or_default();
        [opacity, covariance, colour, detail]
    }

    /// Multiply-adds over the feature, which sums in memory save: of the opacity head, and of the others.
    pub(crate) const fn feature_macs(&self) -> [usize; 2] {
        let Self { feature: f, colour: c, detail: d, .. } = *self;
        [f * f, f * (f + c + d)]
    }

    /// The largest share, in 1024ths, that sums in memory leave of an anchor's multiply-adds. They save as much whatever its offsets are, so
    /// it is an anchor of K offsets, all of them open or none.
    pub(crate) const fn summed_share(&self) -> u32 {
        let [opacity, others] = self.feature_macs();
        let closed = self.opacity_macs(self.offsets);
        let open = closed + self.open_macs(self.offsets);
        let [closed, open] = [share_left(closed, opacity), share_left(open, opacity + others)];
        if closed > open { closed } else { open }
    }

    /// Multiply-adds of the opacity head, which every visible anchor takes, with `n_drawn` offsets.
    pub(crate) const fn opacity_macs(&self, n_drawn: usize) -> usize {
        self.feature * (self.geometry_inputs + n_drawn)
    }

    /// Multiply-adds of the other heads for an anchor with `n_open` offsets of positive opacity.
    pub(crate) const fn open_macs(&self, n_open: usize) -> usize {
        let Self { geometry_inputs, colour_inputs, feature: f, covariance: v, colour: c, detail: d, .. } = *self;
        let per_anchor = f * geometry_inputs + c * colour_inputs + d * f;
        let per_gaussian = v * f + 3 * c + 6 * d;
        per_anchor + n_open * per_gaussian
    }
}

/// What is left of `all` without `saved`, in 1024ths, rounded up.
const fn share_left(all: usize, saved: usize) -> u32 {
    // Widths of 256 and 32 offsets take less than 2¹⁹ multiply-adds.
    ((all - saved) as u32 * 1024).div_ceil(if all == 0 { 1 } else { all as u32 })
}
