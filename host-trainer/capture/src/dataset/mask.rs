//! Which pixels of a photograph count.

/// One flag per pixel of an image: whether the photograph shows something there.
///
/// Undistorting leaves pixels that the photograph does not reach, and a capture may bring masks of its own; neither the
/// loss nor a figure of quality may look at such pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    /// Width, pixels.
    pub width_px: u32,
    /// Height, pixels.
    pub height_px: u32,
    /// `[height, width]`; true where the pixel counts.
    pub valid: Vec<bool>,
}

impl Mask {
    /// How many pixels count.
    pub fn n_valid(&self) -> usize {
        self.valid.iter().filter(|&&valid| valid).count()
    }

    /// The mask of the image reduced by area to `width_px × height_px`: a pixel counts where all it was averaged from
    /// does, so that nothing invented enters a mean.
    ///
    /// # Panics
    /// When a side of either size is 0.
    pub fn area_resized(&self, width_px: u32, height_px: u32) -> Self {
        assert!(width_px > 0 && height_px > 0, "a mask needs pixels, not {width_px}×{height_px}");
        let columns: Vec<_> = (0..width_px).map(|x| overlapped(x, width_px, self.width_px)).collect();
        let mut valid = Vec::with_capacity(width_px as usize * height_px as usize);
        for y in 0..height_px {
            let rows = overlapped(y, height_px, self.height_px);
            valid.extend(columns.iter().map(|columns| {
                let mut rows = rows.clone();
                rows.all(|row| {
                    let row = &self.valid[row * self.width_px as usize..][..self.width_px as usize];
                    row[columns.clone()].iter().all(|&valid| valid)
                })
            }));
        }
        Self { width_px, height_px, valid }
    }
}

/// The pixels of a line of `n_source` that pixel `i` of the same line cut into `n_target` overlaps.
fn overlapped(i: u32, n_target: u32, n_source: u32) -> std::ops::Range<usize> {
    let (i, n_target, n_source) = (u64::from(i), u64::from(n_target), u64::from(n_source));
    #[expect(clippy::cast_possible_truncation, reason = "at most n_source, a u32")]
    let range = (i * n_source / n_target) as usize..((i + 1) * n_source).div_ceil(n_target) as usize;
    range
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_counts_where_all_it_covers_does() {
        let mut mask = Mask { width_px: 6, height_px: 4, valid: vec![true; 24] };
        mask.valid[6 + 2] = false;
        assert_eq!(mask.area_resized(3, 2).valid, [true, false, true, true, true, true]);
        // Two thirds of a pixel reach into column 2: columns 1 and 2 of 4 cover 1.5..3 and 3..4.5.
        assert_eq!(mask.area_resized(4, 1).valid, [true, false, true, true]);
        assert_eq!(mask.area_resized(6, 4), mask);
        assert_eq!(mask.n_valid(), 23);
    }
}
