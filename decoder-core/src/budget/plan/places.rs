//! Places for splats: how many a strip of a frame needs, by what the manifest measured.

use pocketsplat_format::bundle::{STRIPS, TierMeasures};
use pocketsplat_format::rules::TILE_PX;

use crate::budget::limits::Budget;

/// Places for so many measured splats and a sixteenth more; a manifest may have measured views without any.
pub(super) fn with_reserve(n_splats: u32) -> u32 {
    n_splats.saturating_add(n_splats.div_ceil(16)).max(Budget::MIN_SLAB_PLACES)
}

/// Places of one of two painters that share so many splats, `whole` of which they cannot divide.
pub(super) fn half_with_reserve(n_splats: u32, whole: u32) -> u32 {
    // At most 2²⁴ anchors of 32 offsets.
    n_splats.div_ceil(2).wrapping_add(n_splats / 16).wrapping_add(whole).wrapping_add(1).min(n_splats)
}

/// Tiles of a strip.
pub(super) fn tiles_of_strip([width_px, height_px]: [u16; 2], n_strips: u8) -> u32 {
    let rows = height_px.div_ceil(TILE_PX).div_ceil(u16::from(n_strips).max(1));
    u32::from(rows).saturating_mul(width_px.div_ceil(TILE_PX).into())
}

/// Splats of the fullest strip of the finest cut that was measured whose strips are as high a part of their frame as those of
/// `n_strips` strips of a frame of `height_px`: whole rows of tiles make up different parts of different frames. At the
/// training size that is the cut itself, which matters because finer strips can be fuller where they straddle a border of
/// coarser ones.
pub(super) fn fullest_strip(measures: &TierMeasures, training_height_px: u16, height_px: u16, n_strips: u8) -> u32 {
    let rows = |height_px: u16, n_strips: u8| height_px.div_ceil(TILE_PX).div_ceil(u16::from(n_strips).max(1));
    let part = |height_px: u16, n_strips: u8| {
        let strip_px = u32::from(rows(height_px, n_strips)).saturating_mul(TILE_PX.into()).min(height_px.into());
        (strip_px, u32::from(height_px).max(1))
    };
    let (strip_px, frame_px) = part(height_px, n_strips);
    let as_high = |&(measured_strips, _): &(u8, u32)| {
        let (measured_px, measured_frame_px) = part(training_height_px, measured_strips);
        // As products of two 16-bit numbers, the parts compare without rounding.
        measured_px.saturating_mul(frame_px) >= strip_px.saturating_mul(measured_frame_px)
    };
    let measured = STRIPS.into_iter().zip(measures.max_strip_splats);
    // The last one counts. (Going backwards through pairs would link a panic.)
    measured.filter(as_high).fold(measures.max_splats, |_, (_, splats)| splats)
}

#[cfg(test)]
mod tests {
    use super::{TierMeasures, fullest_strip, with_reserve};

    #[test]
    fn strips_count_as_those_measured_that_are_as_high() {
        let measures = TierMeasures {
            psnr_db: None,
            n_views: 0,
            n_cameras: 1,
            max_visible_anchors: 0,
            max_splats: 100,
            max_strip_splats: [100, 60, 70, 30],
            max_strip_pairs: [0; 4],
            max_head_kilo_macs: 0,
            max_kilo_pixels: 0,
            max_decoded_anchors: 0,
            level: 0,
        };
        let splats = |height_px, n_strips| fullest_strip(&measures, 200, height_px, n_strips);
        assert_eq!([1, 2, 4, 8].map(|n| splats(200, n)), [100, 60, 70, 30], "each cut at the size measured");
        assert_eq!(splats(200, 3), 60, "a third fits in a half");
        // 13 rows of tiles in eight strips are two a strip, 16 % of the frame; of 112 pixels one row is 14 %, of 96 17 %.
        assert_eq!([splats(112, 8), splats(96, 8)], [30, 70], "one row of few is a larger part");
        assert_eq!(splats(16, 8), 100, "a frame of one row is one strip");
    }

    #[test]
    fn there_are_places_to_draw_in_slabs_whatever_was_measured() {
        assert_eq!([0, 1, 16, 17, u32::MAX].map(with_reserve), [2, 2, 17, 19, u32::MAX]);
    }
}
