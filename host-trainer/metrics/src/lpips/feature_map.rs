//! What a convolutional network passes from layer to layer.

/// Values of several channels at every pixel of a grid.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FeatureMap {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) n_channels: usize,
    /// `[height, width, n_channels]`: the channels of a pixel lie together, so a patch is three runs of memory.
    pub(super) values: Vec<f32>,
}

impl FeatureMap {
    /// The largest value of every 2×2 pixels; an odd last row or column is left out.
    pub(super) fn max_pooled(&self) -> Self {
        let (width, height, n) = (self.width / 2, self.height / 2, self.n_channels);
        let mut values = Vec::with_capacity(width * height * n);
        for y in 0..height {
            for x in 0..width {
                let at = |dx, dy| &self.values[((2 * y + dy) * self.width + 2 * x + dx) * n..][..n];
                let (a, b, c, d) = (at(0, 0), at(1, 0), at(0, 1), at(1, 1));
                values.extend((0..n).map(|i| a[i].max(b[i]).max(c[i].max(d[i]))));
            }
        }
        Self { width, height, n_channels: n, values }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pooling_keeps_the_largest_of_four_and_drops_an_odd_border() {
        let values =
            vec![1.0, -1.0, 2.0, -2.0, 9.0, -9.0, 4.0, -4.0, 3.0, -3.0, 9.0, -9.0, 9.0, -9.0, 9.0, -9.0, 9.0, -9.0];
        let map = FeatureMap { width: 3, height: 3, n_channels: 2, values };
        assert_eq!(map.max_pooled(), FeatureMap { width: 1, height: 1, n_channels: 2, values: vec![4.0, -1.0] });
    }
}
