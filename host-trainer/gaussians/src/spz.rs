//! .spz of Niantic, versions 1 to 4: whole numbers of 8 to 24 bits, compressed.
//!
//! All centres come first, then all opacities, all colours, all scales, all rotations and all harmonics: in versions 1 to 3 one after the
//! other behind a header of 16 bytes, with gzip around it all or without; in version 4 as zstd streams of their own behind a header of 32.
//! Its description has the axes x right, y up, z back, which are turned from and to x right, y down, z forward. Many writers keep the
//! axes of the .ply that they read; a record of Adobe's says which axes a file has, where it has one. What it loses: centres are rounded
//! to a step that the header names, ln of scales to 1/16 between −10 and 5.9, opacities and the constant colour to 8 bits, rotations to
//! 10 bits a part, harmonics to 1/64 between −1 and 1.

mod header;
mod records;
mod rotation;
mod streams;
#[cfg(test)]
mod tests;
mod writer;

use crate::account::Account;
use crate::axes::{Signs, SpzAxes};
use crate::opacity::logit_of_byte;
use crate::{Gaussians, Notes, Unreadable};
use header::Header;
use records::Records;
pub use writer::write;
pub(crate) use writer::{MAX_COORDINATE, MAX_FRACTION_BITS, SCALE_RANGE, clips};

/// `NGSP`.
const MAGIC: [u8; 4] = *b"NGSP";
/// Set where opacities are compensated for the dilation.
const FLAG_ANTIALIASED: u8 = 1;
/// Set where records of vendors follow.
const FLAG_RECORDS: u8 = 2;
/// Numbers of the constant colour are stored as 0.15·c + 1/2 of 255.
const COLOUR_SCALE: f32 = 0.15;

/// The option that says what axes a file has.
pub const AXES_OPTION: &str = "--spz-axes";

/// Reads versions 1 to 4.
///
/// * `axes`: what the file's axes are, whatever its record says; `None` believes the record, and the description where there is none.
///
/// # Errors
/// [`Unreadable`] for other versions, files that are cut off or damaged, and files that expand to more than a scene could. Memory follows
/// the bytes that are there: 64 for each of the file's, or 16 MiB.
pub fn read(bytes: &[u8], axes: Option<SpzAxes>) -> Result<(Gaussians, Notes), Unreadable> {
    let (header, body, records) = streams::unpack(bytes)?;
    let records = Records::read(&records);
    let found = records.axes(axes);
    let (gaussians, warnings) = gaussians(&header, &body, found.signs).meant()?;
    let mut ignored = records.unknown;
    if header.degree_held > gaussians.degree.number() {
        ignored.push(format!("spherical harmonics of degree {}", header.degree_held));
    }
    let notes = Notes {
        compensation: header.flags & FLAG_ANTIALIASED != 0,
        frame: records.frame.unwrap_or_default(),
        spz_axes: found.axes,
        ignored,
        warnings,
        remarks: vec![found.said],
        ..Notes::default()
    };
    Ok((gaussians, notes))
}

/// Where the bytes of a file went: of version 4 packed, of the others before gzip.
pub(crate) fn account(bytes: &[u8]) -> Result<Account, Unreadable> {
    let (header, _, records) = streams::unpack(bytes)?;
    let sizes =
        streams::packed_sizes(&header, bytes).unwrap_or_else(|| header.row_bytes().map(|row| row * header.n_points));
    let names = ["centres", "opacities", "constant colours", "deviations", "rotations", "harmonics"];
    let mut parts: Vec<(&str, usize)> = names.into_iter().zip(sizes).collect();
    parts.push(("records", records.len()));
    let packed_by = (header.version < 4 && !bytes.starts_with(&MAGIC)).then_some("gzip");
    Ok(Account::new(format!(".spz, version {}", header.version), packed_by, &parts))
}

/// * `body`: all sections, one after the other.
fn gaussians(header: &Header, body: &[u8], signs: Signs) -> Gaussians {
    let mut rest = body;
    let mut section = |row: usize| {
        let (section, after) = rest.split_at(header.n_points * row);
        rest = after;
        section.chunks_exact(row.max(1))
    };
    let [centre, opacity, colour, scale, rotation, others] = header.row_bytes();
    let centres = section(centre).map(|row| signs.centre(header.centre(row))).collect();
    let opacity_logits = section(opacity).map(|row| logit_of_byte(row[0])).collect();
    let colours = section(colour);
    let log_scales =
        section(scale).map(|row| [row[0], row[1], row[2]].map(|byte| f32::from(byte) / 16.0 - 10.0)).collect();
    let rotations = section(rotation).map(|row| signs.rotation(rotation::unpack(row))).collect();
    let mut others = section(others);
    let n_rest = header.degree().n_coefficients() - 1;
    let mut harmonics = Vec::with_capacity(header.n_points * (n_rest + 1));
    for colour in colours {
        harmonics.push([colour[0], colour[1], colour[2]].map(|byte| (f32::from(byte) / 255.0 - 0.5) / COLOUR_SCALE));
        let triples = others.next().into_iter().flat_map(|row| row.chunks_exact(3)).take(n_rest);
        for (number, triple) in triples.enumerate() {
            let value = [triple[0], triple[1], triple[2]].map(|byte| (f32::from(byte) - 128.0) / 128.0);
            harmonics.push(signs.harmonic(number + 1, value));
        }
    }
    Gaussians { degree: header.degree(), centres, log_scales, rotations, opacity_logits, harmonics }
}
