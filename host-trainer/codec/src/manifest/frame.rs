//! What one frame takes, tier by tier.

use pocketsplat_format::bundle::{STRIPS, TierMeasures};

use pocketsplat_capture::camera::Camera;
use pocketsplat_kernels::ops::image::project::{ALPHA_CUTOFF, Footprint, Splat};
use pocketsplat_kernels::ops::image::tiles::TILE_PX;
use pocketsplat_kernels::scene::ModelShape;
use pocketsplat_kernels::step::Block;

/// As the decoder rounds the box of a splat to tiles, pixels.
const BOX_SLACK_PX: f64 = 0.01;

/// Counts of a frame, or their maxima over frames; pairs are of a 16×16 tile and a splat.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct TierCounts {
    visible_anchors: u64,
    splats: u64,
    /// Largest over the strips of a frame, for each number of strips.
    strip_splats: [u64; 4],
    strip_pairs: [u64; 4],
    head_macs: u64,
    pixels: u64,
    pub(super) decoded_anchors: u64,
}

impl TierCounts {
    /// Lifts each count to that of `other`.
    pub(super) fn raise_to(&mut self, other: &Self) {
        for (count, other) in self.each_mut().into_iter().zip(other.clone().each_mut()) {
            *count = (*count).max(*other);
        }
    }

    fn each_mut(&mut self) -> Vec<&mut u64> {
        let mut all = vec![
            &mut self.visible_anchors,
            &mut self.splats,
            &mut self.head_macs,
            &mut self.pixels,
            &mut self.decoded_anchors,
        ];
        all.extend(self.strip_splats.iter_mut().chain(&mut self.strip_pairs));
        all
    }

    /// The record of a tier whose maxima these are.
    pub(super) fn measures(&self, n_cameras: usize) -> TierMeasures {
        let count = |n: u64| u32::try_from(n).unwrap_or(u32::MAX);
        TierMeasures {
            psnr_db: None,
            n_views: 0,
            n_cameras: u16::try_from(n_cameras).unwrap_or(u16::MAX),
            max_visible_anchors: count(self.visible_anchors),
            max_splats: count(self.splats),
            max_strip_splats: self.strip_splats.map(count),
            max_strip_pairs: self.strip_pairs.map(count),
            max_head_kilo_macs: count(self.head_macs.div_ceil(1024)),
            max_kilo_pixels: count(self.pixels.div_ceil(1024)),
            max_decoded_anchors: count(self.decoded_anchors),
            // Whoever declares one checks it.
            level: 0,
        }
    }
}

/// What a tier alone adds to a frame.
#[derive(Clone, Default)]
struct Added {
    visible_anchors: u64,
    /// Anchors with a Gaussian of positive opacity.
    open_anchors: u64,
    gaussians: u64,
    splats: u64,
    /// `[STRIPS][strip]`.
    strip_splats: [[u64; 8]; 4],
    strip_pairs: [[u64; 8]; 4],
    pixels: u64,
}

/// Counts a frame just drawn: those of the scene up to each tier.
///
/// * `ends`: `[n_tiers]` anchors up to and with each tier; the anchors of `blocks` are in file order.
pub(super) fn count(shape: &ModelShape, blocks: &[Block<f32>], ends: &[u32], camera: &Camera) -> Vec<TierCounts> {
    let mut added = vec![Added::default(); ends.len()];
    let tier_of = |anchor: u32| ends.partition_point(|end| *end <= anchor).min(ends.len() - 1);
    let size_px = [camera.width_px, camera.height_px];
    for block in blocks {
        let mut open = vec![false; block.anchors.len()];
        for source in &block.sources {
            open[source.row as usize] = true;
            added[tier_of(block.anchors[source.row as usize])].gaussians += 1;
        }
        for (&anchor, open) in block.anchors.iter().zip(open) {
            let tier = &mut added[tier_of(anchor)];
            tier.visible_anchors += 1;
            tier.open_anchors += u64::from(open);
        }
        for ((drawn, splat), footprint) in block.drawn.iter().zip(&block.splats).zip(&block.footprints) {
            let row = block.sources[*drawn as usize].row;
            added[tier_of(block.anchors[row as usize])].add_splat(splat, footprint, size_px);
        }
    }
    let mut sum = Added::default();
    added.iter().map(|tier| sum.add(tier).counts(shape)).collect()
}

impl Added {
    fn add_splat(&mut self, splat: &Splat<f32>, footprint: &Footprint<f32>, size_px: [u32; 2]) {
        self.splats += 1;
        let [(first_column, last_column), (first_row, last_row)] = [0, 1].map(|axis| {
            let (mean, half) = (f64::from(splat.mean_px[axis]), f64::from(footprint.half_extent_px[axis]));
            let last_px = f64::from(size_px[axis]) - 1.0;
            let low = (mean - half - 0.5 - BOX_SLACK_PX).clamp(0.0, last_px);
            let high = (mean + half - 0.5 + BOX_SLACK_PX).clamp(0.0, last_px);
            (low as usize / TILE_PX, high as usize / TILE_PX)
        });
        let n_rows = (size_px[1] as usize).div_ceil(TILE_PX);
        let n_columns = (last_column - first_column + 1) as u64;
        for (i, n_strips) in STRIPS.into_iter().enumerate() {
            let strip_rows = n_rows.div_ceil(n_strips.into());
            for strip in first_row / strip_rows..=last_row / strip_rows {
                let rows = (last_row + 1).min((strip + 1) * strip_rows) - first_row.max(strip * strip_rows);
                self.strip_splats[i][strip] += 1;
                self.strip_pairs[i][strip] += rows as u64 * n_columns;
            }
        }
        self.pixels += pixels_inside(splat, footprint, size_px);
    }

    /// Adds another tier's share.
    fn add(&mut self, other: &Self) -> &Self {
        self.visible_anchors += other.visible_anchors;
        self.open_anchors += other.open_anchors;
        self.gaussians += other.gaussians;
        self.splats += other.splats;
        self.pixels += other.pixels;
        for (sums, others) in
            [(&mut self.strip_splats, &other.strip_splats), (&mut self.strip_pairs, &other.strip_pairs)]
        {
            for (sum, other) in sums.as_flattened_mut().iter_mut().zip(others.as_flattened()) {
                *sum += other;
            }
        }
        self
    }

    fn counts(&self, shape: &ModelShape) -> TierCounts {
        let [f, k] = [shape.feature_dim, shape.n_offsets].map(|n| n as u64);
        let [geometry_inputs, colour_inputs] = [shape.geometry_inputs(), shape.colour_inputs()].map(|n| n as u64);
        // The opacity head runs for every visible anchor; hidden layers of the others for those it opens, their outputs
        // for the Gaussians it opens.
        let [c, d] = [shape.colour_width(), shape.detail_hidden].map(|n| n as u64);
        let hidden = f * geometry_inputs;
        let per_open_anchor = hidden + c * colour_inputs + d * f;
        let per_gaussian = shape.covariance_outputs() as u64 * f + 3 * c + 6 * d;
        let head_macs = self.visible_anchors * (hidden + f * k)
            + self.open_anchors * per_open_anchor
            + self.gaussians * per_gaussian;
        let largest = |strips: [u64; 8]| strips.into_iter().max().unwrap_or_default();
        TierCounts {
            visible_anchors: self.visible_anchors,
            splats: self.splats,
            strip_splats: self.strip_splats.map(largest),
            strip_pairs: self.strip_pairs.map(largest),
            head_macs,
            pixels: self.pixels,
            decoded_anchors: 0,
        }
    }
}

/// Pixel centres of the image inside the ellipse where alpha reaches the cutoff.
fn pixels_inside(splat: &Splat<f32>, footprint: &Footprint<f32>, size_px: [u32; 2]) -> u64 {
    let [mean_x, mean_y] = splat.mean_px.map(f64::from);
    let [shear, row_precision, column_precision] =
        [splat.shear, splat.row_precision, splat.column_precision].map(f64::from);
    let reach = 2.0 * (f64::from(splat.opacity) / ALPHA_CUTOFF).ln();
    let half_height = f64::from(footprint.half_extent_px[1]);
    // First and end of the pixels whose centres lie within `half` of `mean`.
    let span = |mean: f64, half: f64, size: u32| {
        let first = (mean - half - 0.5).ceil().clamp(0.0, f64::from(size)) as u64;
        let end = ((mean + half - 0.5).floor() + 1.0).clamp(0.0, f64::from(size)) as u64;
        (first, end.max(first))
    };
    let (first_row, end_row) = span(mean_y, half_height, size_px[1]);
    let row = |y: u64| {
        let dy = y as f64 + 0.5 - mean_y;
        let left = reach - dy * dy * column_precision;
        let (first, end) = span(mean_x + shear * dy, (left.max(0.0) / row_precision).sqrt(), size_px[0]);
        if left < 0.0 { 0 } else { end - first }
    };
    (first_row..end_row).map(row).sum()
}

#[cfg(test)]
mod tests {
    use super::pixels_inside;
    use pocketsplat_kernels::ops::image::project::{Footprint, Splat};

    #[test]
    fn pixels_inside_are_those_the_cutoff_leaves() {
        let (conic, opacity) = ([0.08_f32, 0.03, 0.05], 0.8_f32);
        let splat = Splat {
            mean_px: [9.3, 7.9],
            shear: -conic[1] / conic[0],
            row_precision: conic[0],
            column_precision: conic[2] - conic[1] * conic[1] / conic[0],
            opacity,
            colour: [0.0; 3],
        };
        let determinant = conic[0] * conic[2] - conic[1] * conic[1];
        let reach = 2.0 * (255.0 * opacity).ln();
        let half_extent_px = [conic[2], conic[0]].map(|c| (reach * c / determinant).sqrt());
        let alpha = |x: u32, y: u32| {
            let [dx, dy] = [x as f32 + 0.5 - splat.mean_px[0], y as f32 + 0.5 - splat.mean_px[1]];
            opacity * (-0.5 * (conic[0] * dx * dx + conic[2] * dy * dy) - conic[1] * dx * dy).exp()
        };
        let size_px = [24, 14];
        let counted =
            (0..size_px[1]).flat_map(|y| (0..size_px[0]).map(move |x| alpha(x, y))).filter(|a| *a >= 1.0 / 255.0);
        let footprint = Footprint { depth: 1.0, half_extent_px };
        assert_eq!(pixels_inside(&splat, &footprint, size_px), counted.count() as u64, "by hand");
    }
}
