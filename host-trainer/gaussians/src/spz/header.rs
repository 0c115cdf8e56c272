//! The header: version, count, degree, and how many bytes each Gaussian has in each section.

use half::f16;

use crate::{Degree, Unreadable};

/// Bytes of the header up to version 3; version 4 begins with the same ones.
pub(super) const HEADER_BYTES: usize = 16;

/// The highest degree that there are files of; what goes beyond 3 is not read.
const MAX_DEGREE: u8 = 4;

/// The first 16 bytes.
pub(super) struct Header {
    pub(super) version: u32,
    pub(super) n_points: usize,
    /// Of the file's harmonics, which may be more than are read.
    pub(super) degree_held: usize,
    fraction_bits: u8,
    pub(super) flags: u8,
    /// Of version 4: how many streams.
    pub(super) n_streams: usize,
}

impl Header {
    pub(super) fn parse(bytes: [u8; HEADER_BYTES]) -> Result<Self, Unreadable> {
        let [m0, m1, m2, m3, v0, v1, v2, v3, n0, n1, n2, n3, degree, fraction_bits, flags, n_streams] = bytes;
        if [m0, m1, m2, m3] != super::MAGIC {
            return Err(Unreadable::new("is no .spz file: what gzip unpacks does not start with `NGSP`"));
        }
        let version = u32::from_le_bytes([v0, v1, v2, v3]);
        if !matches!(version, 1..=4) {
            return Err(Unreadable::new(format!(
                "is a .spz of version {version}, versions 1 to 4 are read; write it as a .ply with the program that made it"
            )));
        }
        if degree > MAX_DEGREE {
            return Err(Unreadable::new(format!(
                "has spherical harmonics of degree {degree}, degrees 0 to {MAX_DEGREE} are read"
            )));
        }
        if fraction_bits > 23 {
            return Err(Unreadable::new(format!(
                "has centres with {fraction_bits} bits after the point, of 24 in all"
            )));
        }
        Ok(Self {
            version,
            n_points: u32::from_le_bytes([n0, n1, n2, n3]) as usize,
            degree_held: usize::from(degree),
            fraction_bits,
            flags,
            n_streams: usize::from(n_streams),
        })
    }

    /// The degree that is read.
    pub(super) fn degree(&self) -> Degree {
        Degree::ALL.get(self.degree_held).copied().unwrap_or(Degree::Three)
    }

    /// Bytes of one Gaussian in each section: centre, opacity, colour, scales, rotation, harmonics.
    pub(super) fn row_bytes(&self) -> [usize; 6] {
        let centre = if self.version == 1 { 6 } else { 9 };
        let rotation = if self.version < 3 { 3 } else { 4 };
        [centre, 1, 3, 3, rotation, 3 * ((self.degree_held + 1).pow(2) - 1)]
    }

    /// Bytes of all sections.
    pub(super) fn n_bytes(&self) -> usize {
        self.n_points.saturating_mul(self.row_bytes().iter().sum())
    }

    /// The centre in its row.
    pub(super) fn centre(&self, row: &[u8]) -> [f32; 3] {
        if self.version == 1 {
            return [0, 1, 2].map(|axis: usize| f16::from_le_bytes([row[2 * axis], row[2 * axis + 1]]).to_f32());
        }
        let scale = 1.0 / (1u32 << self.fraction_bits) as f32;
        [0, 1, 2].map(|axis: usize| {
            let fixed = i32::from_le_bytes([0, row[3 * axis], row[3 * axis + 1], row[3 * axis + 2]]) >> 8;
            fixed as f32 * scale
        })
    }
}
