//! The file: `PSO1`, a checksum, and a deflated body, all little-endian:
//!
//! | what | bytes |
//! |---|---|
//! | side of the grid | 4 |
//! | degree | 1 |
//! | for each plane: the least and the largest number | 4 each |
//! | images, each with its length: low and high bytes of places, log-scales, quaternions, opacities, colours, the other harmonics | 4, and as many |
//!
//! An image is a PNG of 8 bits a pixel that has the planes of its attribute under one another.

use std::io::Cursor;
use std::ops::Range;

use image::codecs::png::{CompressionType, FilterType, PngDecoder, PngEncoder};
use image::{ColorType, ExtendedColorType, ImageDecoder as _, ImageEncoder as _, Limits};
use pocketsplat_gaussians::Degree;

use super::attributes::{CENTRE, COLOUR, LOG_SCALE, OPACITY, ROTATION, bands};
use super::quantisation::{Quantised, most};
use crate::baseline::Unreadable;
use crate::packed::{Body, Mark, opened, put_count, sealed};

const MARK: Mark = *b"PSO1";

/// Bytes that deflate makes of one at most.
const MOST_EXPANSION: usize = 1032;

/// Pixels of an image.
const MOST_PIXELS: usize = 1 << 30;

/// Of a place, as files have it: ln of the largest number.
const MOST_CONTRACTED: f32 = 88.7;

/// Bytes that a PNG's decoder may take beside the pixels.
const MOST_DECODER: u64 = 1 << 24;

/// The planes of each image, and the bit with which they begin.
fn images(degree: Degree) -> [(Range<usize>, u32); 7] {
    let of_bytes = [LOG_SCALE, ROTATION, OPACITY, COLOUR, bands(degree)].map(|planes| (planes, 0));
    let [scales, rotations, opacities, colours, bands] = of_bytes;
    [(CENTRE, 0), (CENTRE, 8), scales, rotations, opacities, colours, bands]
}

/// The file of a grid.
pub(super) fn written(quantised: &Quantised) -> Vec<u8> {
    sealed(MARK, &body(quantised))
}

/// The grid of a file.
pub(super) fn read(bytes: &[u8]) -> Result<Quantised, Unreadable> {
    of_body(&opened(MARK, bytes)?)
}

fn body(Quantised { side, degree, ranges, planes }: &Quantised) -> Vec<u8> {
    let mut body = Vec::new();
    put_count(*side, &mut body);
    body.extend(u8::try_from(degree.number()));
    ranges.as_flattened().iter().for_each(|bound| body.extend(bound.to_le_bytes()));
    for (of, shift) in images(*degree) {
        let rows: Vec<u8> = planes[of].iter().flatten().map(|step| (step >> shift).to_le_bytes()[0]).collect();
        let png = if rows.is_empty() { Vec::new() } else { png(&rows, *side) };
        put_count(png.len(), &mut body);
        body.extend(png);
    }
    body
}

fn of_body(bytes: &[u8]) -> Result<Quantised, Unreadable> {
    let mut body = Body(bytes);
    let side = body.count("the side of the grid")?;
    let number = usize::from(body.bytes(1, "the degree")?[0]);
    let Some(degree) = Degree::ALL.get(number).copied() else {
        return Err(Unreadable(format!("the degree is {number}, needed: 0 to 3; write the file again")));
    };
    let mut bound = || body.number("ranges");
    let n_planes = bands(degree).end;
    let ranges = (0..n_planes).map(|_| Ok([bound()?, bound()?])).collect::<Result<Vec<_>, _>>()?;
    let faulty = |(of, range): &(usize, &[f32; 2])| {
        let most = if CENTRE.contains(of) { MOST_CONTRACTED } else { f32::MAX };
        !range.iter().all(|bound| bound.abs() <= most)
    };
    if let Some((of, [least, largest])) = ranges.iter().enumerate().find(faulty) {
        return Err(Unreadable(format!(
            "plane {of} lies from {least} to {largest}, needed: finite numbers, of places {MOST_CONTRACTED} at most; write the file again"
        )));
    }
    let mut planes = vec![Vec::new(); n_planes];
    for (of, shift) in images(degree) {
        let n = body.count("the length of an image")?;
        let image = body.bytes(n, "an image")?;
        let pixels = if side == 0 || of.is_empty() { Vec::new() } else { pixels(image, side, of.len())? };
        for (plane, part) in of.zip(pixels.chunks(side.max(1) * side.max(1))) {
            planes[plane].resize(part.len(), 0);
            planes[plane].iter_mut().zip(part).for_each(|(step, byte)| *step |= u16::from(*byte) << shift);
        }
    }
    if let Some((of, step)) = planes.iter().enumerate().find_map(|(of, plane)| {
        let step = plane.iter().find(|step| **step > most(of))?;
        Some((of, step))
    }) {
        let most = most(of);
        return Err(Unreadable(format!(
            "plane {of} has the step {step}, needed: {most} at most; write the file again"
        )));
    }
    body.end()?;
    Ok(Quantised { side, degree, ranges, planes })
}

fn png(rows: &[u8], side: usize) -> Vec<u8> {
    let mut png = Vec::new();
    let [width, height] = [side, rows.len() / side].map(|edge| u32::try_from(edge).expect("fewer than 2³² pixels"));
    PngEncoder::new_with_quality(&mut png, CompressionType::Best, FilterType::Adaptive)
        .write_image(rows, width, height, ExtendedColorType::L8)
        .expect("a vector takes all bytes");
    png
}

/// The pixels of an image of `n_planes`: 1 GiB of them at most, and no more than its bytes can stand for.
fn pixels(png: &[u8], side: usize, n_planes: usize) -> Result<Vec<u8>, Unreadable> {
    let n_pixels = side.saturating_mul(side).saturating_mul(n_planes);
    if n_pixels > MOST_PIXELS {
        return Err(Unreadable(format!(
            "an image has {n_planes} planes of {side} × {side} pixels, needed: {MOST_PIXELS} pixels at most; write the file again"
        )));
    }
    if n_pixels > png.len().saturating_mul(MOST_EXPANSION) {
        let n_bytes = png.len();
        return Err(Unreadable(format!(
            "an image has {n_bytes} bytes, too few for {n_planes} planes of {side} × {side} pixels; write the file again"
        )));
    }
    let unreadable =
        |fault: image::ImageError| Unreadable(format!("an image cannot be read: {fault}; write the file again"));
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(n_pixels as u64 + MOST_DECODER);
    let decoder = PngDecoder::with_limits(Cursor::new(png), limits).map_err(unreadable)?;
    let (width, height) = decoder.dimensions();
    let (found, needed) = ([width as usize, height as usize], [side, side * n_planes]);
    if found != needed || decoder.color_type() != ColorType::L8 {
        return Err(Unreadable(format!(
            "an image has {found:?} pixels of {:?}, needed: {needed:?} of L8; write the file again",
            decoder.color_type()
        )));
    }
    let mut pixels = vec![0; n_pixels];
    decoder.read_image(&mut pixels).map_err(unreadable)?;
    Ok(pixels)
}

#[cfg(test)]
mod tests {
    use pocketsplat_trainer::explicit::Cloud;
    use proptest::prelude::*;

    use super::super::quantisation::quantised;
    use super::*;
    use crate::test_files::damage_of_a_body_is_noticed;
    use crate::test_scenes::gaussians;

    fn grid(side: usize, degree: Degree) -> Quantised {
        quantised(&Cloud::from(&gaussians(side * side).reduced_to(degree)), side)
    }

    #[test]
    fn what_was_written_is_read_and_written_again_the_same() {
        for (side, degree) in [(1, Degree::Zero), (4, Degree::One), (7, Degree::Three)] {
            let before = grid(side, degree);
            let bytes = written(&before);
            let read = read(&bytes).unwrap();
            assert_eq!(read, before);
            assert_eq!(written(&read), bytes);
        }
    }

    #[test]
    fn images_larger_than_their_bytes_and_ranges_without_end_are_refused() {
        let mut faulty = body(&grid(3, Degree::Zero));
        for (side, cause) in
            [(6000_u32, "too few for 3 planes of 6000 × 6000 pixels"), (60_000, "needed: 1073741824 pixels at most")]
        {
            faulty[..4].copy_from_slice(&side.to_le_bytes());
            let said = of_body(&faulty).unwrap_err().to_string();
            assert!(said.contains(cause), "{said}");
        }
        faulty[..4].copy_from_slice(&2u32.to_le_bytes());
        let said = of_body(&faulty).unwrap_err().to_string();
        assert!(said.contains("needed: [2, 6] of L8"), "{said}");
        for bound in [f32::NAN, f32::INFINITY, 1e9] {
            let faulty = Quantised { ranges: vec![[0.0, bound]; 14], ..grid(3, Degree::Zero) };
            assert!(read(&written(&faulty)).is_err());
        }
    }

    proptest! {
        #[test]
        fn a_damaged_body_is_gaussians_or_an_error(at: prop::sample::Index, flip in 1..=255u8) {
            let sound = body(&grid(4, Degree::One));
            damage_of_a_body_is_noticed(&sound, (at.index(sound.len()), flip), of_body, Quantised::gaussians);
        }
    }
}
