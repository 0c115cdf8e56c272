//! How far away what a picture is of lies: what a camera turns around.

use pocketsplat_format::bundle::AnchorSite;
use pocketsplat_format::{Bundle, DecodeError};

/// Anchors that are looked at, about: those of some chunks, so that large scenes open as fast as small ones.
const N_ANCHORS: u32 = 16_384;
/// The part of the picture's width and height, around its middle, that counts.
const MIDDLE: f32 = 0.6;
/// Halvings of the range of depths: below a thousandth of it.
const N_HALVINGS: u32 = 12;

/// The median depth of the anchors in the middle of the preview, normalised units; NaN where there are none.
pub(crate) fn distance(bundle: &Bundle<'_>) -> f64 {
    median(&depths(bundle).unwrap_or_default())
}

/// Depths of anchors in the middle of the preview.
fn depths(bundle: &Bundle<'_>) -> Result<Vec<f32>, DecodeError> {
    let header = bundle.header();
    let (camera, rotation) = (header.preview, header.preview.rotation.to_array());
    let every = bundle.n_anchors().div_ceil(N_ANCHORS).max(1) as usize;
    let (n_most, n_channels) = (usize::from(header.max_chunk_anchors), header.n_channels());
    let mut words = vec![0; bundle.anchor_scratch_words()];
    let mut models = bundle.anchor_models(&mut words)?;
    let (mut sites, mut values) = (vec![AnchorSite::default(); n_most], vec![0.0; n_most * n_channels]);
    let mut depths = Vec::new();
    for chunk in bundle.chunks().step_by(every) {
        chunk.decode_values(&mut models, &mut sites, &mut values)?;
        for site in &sites[..usize::from(chunk.n_anchors())] {
            let position = bundle.position(site.lattice);
            let along = |row: usize| {
                let [a, b, c] = [0, 1, 2].map(|i| rotation[3 * row + i] * position[i]);
                a + b + c + camera.translation[row]
            };
            let depth = along(2);
            let off = |axis: usize, size_px: u16| camera.focal_px[axis] * along(axis) / depth / f32::from(size_px);
            let is_middle =
                [off(0, camera.width_px), off(1, camera.height_px)].iter().all(|off| off.abs() < 0.5 * MIDDLE);
            if depth > 0.0 && is_middle {
                depths.push(depth);
            }
        }
    }
    Ok(depths)
}

/// By halving the range: sorting would be a twentieth of the WebAssembly module.
fn median(depths: &[f32]) -> f64 {
    let [mut low, mut high] = [f32::min, f32::max].map(|pick| depths.iter().copied().fold(f32::NAN, pick));
    for _ in 0..N_HALVINGS {
        let middle = 0.5 * (low + high);
        let n_nearer = depths.iter().filter(|depth| **depth < middle).count();
        if 2 * n_nearer > depths.len() { high = middle } else { low = middle }
    }
    f64::from(0.5 * (low + high))
}

#[cfg(test)]
mod tests {
    use pocketsplat_format::Bundle;

    use super::{distance, median};

    #[test]
    fn the_median_has_as_many_below_as_above() {
        assert!(median(&[]).is_nan(), "of nothing");
        assert_eq!(median(&[2.5]), 2.5);
        let depths: Vec<f32> = (0..1001_u16).map(|i| f32::from(i * 5 % 1001)).collect();
        assert!((median(&depths) - 500.0).abs() < 1.0, "{}", median(&depths));
    }

    #[test]
    fn the_sample_is_as_far_away_as_its_middle() {
        let bundle = Bundle::parse(include_bytes!("../../tests/golden/static.psb")).expect("a sound bundle");
        let [x, y, z] = bundle.header().preview.centre().map(f64::from);
        let to_origin = (x * x + y * y + z * z).sqrt();
        let found = distance(&bundle);
        assert!((found / to_origin - 1.0).abs() < 0.3, "{found}, {to_origin} from the origin");
    }
}
