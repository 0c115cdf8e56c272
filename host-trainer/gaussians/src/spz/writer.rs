//! Version 3, which the readers of all other programs know, with records of its axes and its frame.

use std::io::Write as _;

use flate2::Compression;
use flate2::write::GzEncoder;

use super::{COLOUR_SCALE, FLAG_ANTIALIASED, FLAG_RECORDS, MAGIC, records, rotation};
use crate::axes::SpzAxes;
use crate::opacity::byte_of_logit;
use crate::{Gaussians, Notes, Unreadable};

/// Bits after the point of a centre's coordinate: 1/65536 of a unit, unless a centre lies too far out.
pub(crate) const MAX_FRACTION_BITS: u8 = 16;
/// The largest number of 24 bits.
pub(crate) const MAX_COORDINATE: f32 = 8_388_607.0;
/// Least and largest ln of a deviation.
pub(crate) const SCALE_RANGE: [f32; 2] = [-10.0, 255.0 / 16.0 - 10.0];
/// Largest constant coefficient.
const COLOUR_RANGE: f32 = 0.5 / COLOUR_SCALE;
/// Steps of 1/128 in which harmonics are rounded. A writer may choose any number of bits; the 5 and 4 that are usual cost 0.4 dB (lego, a
/// bundle of 33.4 dB), 7 cost 0.01.
const HARMONIC_STEP: f32 = 2.0;

/// Writes version 3, with its axes as [`Notes::spz_axes`] says, or as described.
///
/// # Errors
/// [`Unreadable`] where a centre lies more than 8,388,607 units out, which no file of this format can say.
pub fn write(gaussians: &Gaussians, notes: &Notes) -> Result<Vec<u8>, Unreadable> {
    let fraction_bits = fraction_bits(gaussians)?;
    let n_points = u32::try_from(gaussians.len()).map_err(|_| {
        Unreadable::new(format!("would hold {} Gaussians, a .spz holds {} at most", gaussians.len(), u32::MAX))
    })?;
    let axes = notes.spz_axes.unwrap_or(SpzAxes::AsDescribed);
    let signs = axes.signs();
    let flags = FLAG_RECORDS | if notes.compensation { FLAG_ANTIALIASED } else { 0 };
    let degree = gaussians.degree.number() as u8;
    let mut out = GzEncoder::new(Vec::new(), Compression::best());
    let mut put = |bytes: &[u8]| out.write_all(bytes).expect("memory takes all bytes");
    put(&MAGIC);
    put(&3u32.to_le_bytes());
    put(&n_points.to_le_bytes());
    put(&[degree, fraction_bits, flags, 0]);
    for &centre in &gaussians.centres {
        for coordinate in signs.centre(centre) {
            let fixed = (f64::from(coordinate) * f64::from(1u32 << fraction_bits)).round() as i32;
            put(&fixed.to_le_bytes()[..3]);
        }
    }
    for &logit in &gaussians.opacity_logits {
        put(&[byte_of_logit(logit)]);
    }
    for index in 0..gaussians.len() {
        // Casts saturate.
        put(&gaussians.harmonics_of(index)[0].map(|channel| ((COLOUR_SCALE * channel + 0.5) * 255.0).round() as u8));
    }
    for scales in &gaussians.log_scales {
        put(&scales.map(|scale| ((scale + 10.0) * 16.0).round() as u8));
    }
    for &quaternion in &gaussians.rotations {
        put(&rotation::pack(signs.rotation(quaternion)).to_le_bytes());
    }
    for index in 0..gaussians.len() {
        for (number, &colour) in gaussians.harmonics_of(index).iter().enumerate().skip(1) {
            put(&signs.harmonic(number, colour).map(harmonic_byte));
        }
    }
    put(&records::write(axes, &notes.frame));
    Ok(out.finish().expect("memory takes all bytes"))
}

/// The most bits after the point with which every centre fits into 24.
fn fraction_bits(gaussians: &Gaussians) -> Result<u8, Unreadable> {
    let largest = gaussians.centres.iter().flatten().fold(0.0f32, |largest, coordinate| largest.max(coordinate.abs()));
    (0..=MAX_FRACTION_BITS).rev().find(|&bits| largest * ((1u32 << bits) as f32) <= MAX_COORDINATE).ok_or_else(|| {
        Unreadable::new(format!(
            "would hold a centre {largest} units out, a .spz holds {MAX_COORDINATE} at most; write a .ply"
        ))
    })
}

/// A coefficient in 8 bits, the last of which is 0.
fn harmonic_byte(value: f32) -> u8 {
    (((value * 128.0 + 128.0) / HARMONIC_STEP).round() * HARMONIC_STEP) as u8
}

/// A sentence for each kind of number that lies beyond what a .spz holds by more than its step.
pub(crate) fn clips(gaussians: &Gaussians) -> Vec<String> {
    let mut said = Vec::new();
    let mut say = |what: &str, of: usize, n_beyond: usize, farthest: f32, range: &str| {
        if n_beyond > 0 {
            let share = 100.0 * n_beyond as f64 / of as f64;
            said.push(format!(
                "{n_beyond} of {of} {what} ({share:.2} %) lie beyond {range}, where a .spz ends, the farthest at {farthest:.3}: they are cut"
            ));
        }
    };
    let n = gaussians.len();
    let beyond = |values: &mut dyn Iterator<Item = f32>, [least, largest]: [f32; 2], step: f32| {
        let middle = f32::midpoint(least, largest);
        values.filter(|value| *value < least - step || *value > largest + step).fold(
            (0, middle),
            |(count, farthest), value| {
                let is_farther = (value - middle).abs() > (farthest - middle).abs();
                (count + 1, if is_farther { value } else { farthest })
            },
        )
    };
    let (count, farthest) = beyond(&mut gaussians.log_scales.iter().flatten().copied(), SCALE_RANGE, 1.0 / 16.0);
    say("ln of deviations", 3 * n, count, farthest, "−10 to 5.94");
    let constants = &mut (0..n).flat_map(|index| gaussians.harmonics_of(index)[0]);
    let (count, farthest) = beyond(constants, [-COLOUR_RANGE, COLOUR_RANGE], COLOUR_RANGE / 127.5);
    say("numbers of constant colours", 3 * n, count, farthest, "±3.33");
    let others = &mut (0..n).flat_map(|index| gaussians.harmonics_of(index)[1..].iter().flatten().copied());
    let (count, farthest) = beyond(others, [-1.0, 1.0], HARMONIC_STEP / 128.0);
    say("harmonics that follow the view", 3 * n * (gaussians.degree.n_coefficients() - 1), count, farthest, "±1");
    said
}
