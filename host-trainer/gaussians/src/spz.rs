//! .spz of Niantic, versions 2 and 3: whole numbers of 8 to 24 bits, gzip around them.
//!
//! After a header of 16 bytes come all centres, all opacities, all colours, all scales, all rotations and all harmonics. Its axes are x
//! right, y up, z back; reader and writer turn them from and to x right, y down, z forward. What it loses: centres are rounded to a step
//! that the header names, ln of scales to 1/16 between −10 and 5.9, opacities and the constant colour to 8 bits, rotations to 10 bits a
//! part, harmonics to 1/64 between −1 and 1.

mod rotation;
#[cfg(test)]
mod tests;

use std::io::{Read as _, Write as _};

use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;

use crate::axes::{turn_centre, turn_harmonic, turn_rotation};
use crate::opacity::{byte_of_logit, logit_of_byte};
use crate::{Degree, Gaussians, Notes, Unreadable};

/// `NGSP`.
const MAGIC: [u8; 4] = *b"NGSP";
const HEADER_BYTES: usize = 16;
/// Set where opacities are compensated for the dilation.
const FLAG_ANTIALIASED: u8 = 1;
/// Set where records of vendors follow, which are not read.
const FLAG_EXTENSIONS: u8 = 2;
/// Bits after the point of a centre's coordinate: 1/65536 of a unit, unless a centre lies too far out.
const MAX_FRACTION_BITS: u8 = 16;
const MAX_COORDINATE: f32 = 8_388_607.0;
/// Numbers of the constant colour are stored as 0.15·c + 1/2 of 255.
const COLOUR_SCALE: f32 = 0.15;
/// Steps of 1/128 in which harmonics are rounded. A writer may choose any number of bits; the 5 and 4 that are usual cost 0.4 dB (lego, a
/// bundle of 33.4 dB), 7 cost 0.01.
const HARMONIC_STEP: f32 = 2.0;
/// Bytes that one byte of a file may become, and that any file may become: more is no scene.
const MAX_EXPANSION: usize = 64;
const ANY_EXPANSION: usize = 1 << 24;

/// Writes version 3.
///
/// # Errors
/// [`Unreadable`] where a centre lies more than 8,388,607 units out, which no file of this format can say.
pub fn write(gaussians: &Gaussians, notes: &Notes) -> Result<Vec<u8>, Unreadable> {
    let fraction_bits = fraction_bits(gaussians)?;
    let n_points = u32::try_from(gaussians.len()).map_err(|_| {
        Unreadable::new(format!("would hold {} Gaussians, a .spz holds {} at most", gaussians.len(), u32::MAX))
    })?;
    let flags = if notes.compensation { FLAG_ANTIALIASED } else { 0 };
    let degree = gaussians.degree.number() as u8;
    let mut out = GzEncoder::new(Vec::new(), Compression::best());
    let mut put = |bytes: &[u8]| out.write_all(bytes).expect("memory takes all bytes");
    put(&MAGIC);
    put(&3u32.to_le_bytes());
    put(&n_points.to_le_bytes());
    put(&[degree, fraction_bits, flags, 0]);
    for &centre in &gaussians.centres {
        for coordinate in turn_centre(centre) {
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
        put(&rotation::pack(turn_rotation(quaternion)).to_le_bytes());
    }
    for index in 0..gaussians.len() {
        for (number, &colour) in gaussians.harmonics_of(index).iter().enumerate().skip(1) {
            put(&turn_harmonic(number, colour).map(harmonic_byte));
        }
    }
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

/// Reads versions 2 and 3.
///
/// # Errors
/// [`Unreadable`] for other versions, files that are cut off or damaged, and files that expand to more than a scene could. Memory follows
/// the bytes that are there: 64 for each of the file's, or 16 MiB.
pub fn read(bytes: &[u8]) -> Result<(Gaussians, Notes), Unreadable> {
    if bytes.starts_with(&MAGIC) {
        let [a, b, c, d] = *bytes.get(4..8).and_then(|found| found.first_chunk()).unwrap_or(&[0; 4]);
        let version = u32::from_le_bytes([a, b, c, d]);
        return Err(Unreadable::new(format!(
            "is a .spz of version {version}, versions 2 and 3 are read; `splat-transform IN.spz --spz-version 3 OUT.spz` writes 3"
        )));
    }
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return Err(Unreadable::new("is no .spz file: it does not start as gzip does"));
    }
    let mut stream = GzDecoder::new(bytes);
    let header = Header::read(&mut stream)?;
    let body = header.body(&mut stream, bytes.len())?;
    let gaussians = header.gaussians(&body)?;
    gaussians.check()?;
    let ignored =
        if header.flags & FLAG_EXTENSIONS == 0 { Vec::new() } else { vec!["extensions of vendors".to_owned()] };
    Ok((gaussians, Notes { compensation: header.flags & FLAG_ANTIALIASED != 0, comments: Vec::new(), ignored }))
}

/// The first 16 bytes.
struct Header {
    version: u32,
    n_points: usize,
    degree: Degree,
    fraction_bits: u8,
    flags: u8,
}

impl Header {
    fn read(stream: &mut GzDecoder<&[u8]>) -> Result<Self, Unreadable> {
        let mut bytes = [0; HEADER_BYTES];
        stream.read_exact(&mut bytes).map_err(|error| {
            Unreadable::new(format!("is no .spz file: its header of {HEADER_BYTES} bytes cannot be unpacked ({error})"))
        })?;
        let [m0, m1, m2, m3, v0, v1, v2, v3, n0, n1, n2, n3, degree, fraction_bits, flags, _] = bytes;
        if [m0, m1, m2, m3] != MAGIC {
            return Err(Unreadable::new("is no .spz file: what gzip unpacks does not start with `NGSP`"));
        }
        let version = u32::from_le_bytes([v0, v1, v2, v3]);
        if !matches!(version, 2 | 3) {
            return Err(Unreadable::new(format!("is a .spz of version {version}, versions 2 and 3 are read")));
        }
        let degree = Degree::ALL.get(usize::from(degree)).copied().ok_or_else(|| {
            Unreadable::new(format!("has spherical harmonics of degree {degree}, degrees 0 to 3 are read"))
        })?;
        if fraction_bits > 23 {
            return Err(Unreadable::new(format!(
                "has centres with {fraction_bits} bits after the point, of 24 in all"
            )));
        }
        Ok(Self { version, n_points: u32::from_le_bytes([n0, n1, n2, n3]) as usize, degree, fraction_bits, flags })
    }

    /// Bytes of one Gaussian: centre, opacity, colour, scales, rotation, harmonics.
    fn n_bytes(&self) -> usize {
        9 + 1 + 3 + 3 + self.rotation_bytes() + 3 * (self.degree.n_coefficients() - 1)
    }

    fn rotation_bytes(&self) -> usize {
        if self.version == 2 { 3 } else { 4 }
    }

    /// All that follows the header.
    fn body(&self, stream: &mut GzDecoder<&[u8]>, file_bytes: usize) -> Result<Vec<u8>, Unreadable> {
        let needed = self.n_points.saturating_mul(self.n_bytes());
        let allowed = file_bytes.saturating_mul(MAX_EXPANSION).max(ANY_EXPANSION);
        if needed > allowed {
            return Err(Unreadable::new(format!(
                "says it holds {} Gaussians, which are {needed} bytes; from a file of {file_bytes} bytes at most {allowed} are unpacked",
                self.n_points
            )));
        }
        // Grows with what is unpacked, never from the header's count.
        let mut body = Vec::new();
        stream.take(needed as u64).read_to_end(&mut body).map_err(|error| {
            Unreadable::new(format!(
                "is damaged or cut off after {} of {needed} bytes: {error}; copy it again",
                body.len()
            ))
        })?;
        if body.len() < needed {
            return Err(Unreadable::new(format!(
                "is cut off: it holds {} of the {needed} bytes of its {} Gaussians; copy it again from where it was made",
                body.len(),
                self.n_points
            )));
        }
        Ok(body)
    }

    fn gaussians(&self, body: &[u8]) -> Result<Gaussians, Unreadable> {
        let n = self.n_points;
        let mut rest = body;
        let mut section = |row: usize| {
            let (section, after) = rest.split_at(n * row);
            rest = after;
            section.chunks_exact(row.max(1))
        };
        let scale = 1.0 / (1u32 << self.fraction_bits) as f32;
        let coordinate = |bytes: &[u8]| (i32::from_le_bytes([0, bytes[0], bytes[1], bytes[2]]) >> 8) as f32 * scale;
        let centres = section(9)
            .map(|row| turn_centre([coordinate(&row[..3]), coordinate(&row[3..6]), coordinate(&row[6..])]))
            .collect();
        let opacity_logits = section(1).map(|row| logit_of_byte(row[0])).collect();
        let colours = section(3);
        let log_scales =
            section(3).map(|row| [row[0], row[1], row[2]].map(|byte| f32::from(byte) / 16.0 - 10.0)).collect();
        let rotations = section(self.rotation_bytes()).map(|row| turn_rotation(rotation::unpack(row))).collect();
        let n_rest = 3 * (self.degree.n_coefficients() - 1);
        let mut others = section(n_rest);
        let mut harmonics = Vec::with_capacity(n * self.degree.n_coefficients());
        for colour in colours {
            harmonics
                .push([colour[0], colour[1], colour[2]].map(|byte| (f32::from(byte) / 255.0 - 0.5) / COLOUR_SCALE));
            for (number, triple) in others.next().into_iter().flat_map(|row| row.chunks_exact(3)).enumerate() {
                let value = [triple[0], triple[1], triple[2]].map(|byte| (f32::from(byte) - 128.0) / 128.0);
                harmonics.push(turn_harmonic(number + 1, value));
            }
        }
        Ok(Gaussians { degree: self.degree, centres, log_scales, rotations, opacity_logits, harmonics })
    }
}
