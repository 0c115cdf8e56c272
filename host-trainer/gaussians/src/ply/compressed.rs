//! `.compressed.ply` of SuperSplat: 16 bytes a Gaussian, between the least and the largest of its chunk of 256.
//!
//! An element `chunk` has the bounds of centres, ln of scales and colours; `vertex` has four words: centre and scales in 11, 10 and 11
//! bits, the rotation as the index of its largest part in two bits and the others in 10 each, colour and opacity in 8 each. An element `sh`
//! may have the other harmonics in 8 bits from −4 to 4.

use std::f32::consts::SQRT_2;

use pocketsplat_files::ply::{Element, Encoding, Header, Scalar, cut_off};

use super::rows::degree_of;
use crate::opacity::{constant_of_colour, logit_of_byte};
use crate::{Gaussians, Unreadable};

/// Gaussians that share bounds.
const CHUNK: usize = 256;

/// Whether a header is one of these.
pub(super) fn is_one(header: &Header<'_>) -> bool {
    header.vertex().properties.iter().any(|property| property.name == "packed_position")
}

/// The rows of one element, and where its properties are in a row.
struct Table<'a> {
    element: &'a Element<'a>,
    row_bytes: usize,
    bytes: &'a [u8],
}

impl<'a> Table<'a> {
    fn of(header: &'a Header<'a>, name: &str, body: &'a [u8]) -> Result<Option<Self>, Unreadable> {
        let Some((element, bytes)) = header.element(name, body)? else { return Ok(None) };
        let row_bytes = element.n_bytes().filter(|&bytes| bytes > 0).ok_or_else(|| {
            Unreadable::new(format!("is a compressed .ply whose element `{name}` has lists or no properties"))
        })?;
        let held = bytes.len() / row_bytes;
        if held < element.count {
            return Err(cut_off(held, element.count, &format!("rows of `{name}`")).into());
        }
        Ok(Some(Self { element, row_bytes, bytes }))
    }

    /// Where in a row the property `name` is; `None` where there is none of this type.
    fn offset(&self, name: &str, scalar: Scalar) -> Option<usize> {
        let index = self.element.properties.iter().position(|property| property.name == name)?;
        let sizes = self.element.properties[..index].iter().filter_map(|property| property.scalar);
        (self.element.properties[index].scalar == Some(scalar)).then(|| sizes.map(Scalar::n_bytes).sum())
    }

    fn offsets<const N: usize>(&self, names: [&str; N], scalar: Scalar) -> Result<[usize; N], Unreadable> {
        let mut offsets = [0; N];
        for (offset, name) in offsets.iter_mut().zip(names) {
            *offset = self.offset(name, scalar).ok_or_else(|| {
                Unreadable::new(format!(
                    "is an incomplete compressed .ply: its element `{}` has no property `{name}` of the usual type",
                    self.element.name
                ))
            })?;
        }
        Ok(offsets)
    }

    fn word(&self, row: usize, offset: usize) -> [u8; 4] {
        let at = row * self.row_bytes + offset;
        *self.bytes[at..].first_chunk().expect("the rows are there")
    }
}

/// The bits of `word` from `shift` on, as a number from 0 to 1.
fn share(word: u32, shift: u32, n_bits: u32) -> f32 {
    let most = (1u32 << n_bits) - 1;
    (word >> shift & most) as f32 / most as f32
}

/// Least and largest of three numbers in a chunk.
type Bounds = [[f32; 3]; 2];

fn between([least, largest]: Bounds, shares: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|axis| least[axis] + shares[axis] * (largest[axis] - least[axis]))
}

/// * `body`: what follows the header.
pub(super) fn read(header: &Header<'_>, body: &[u8]) -> Result<Gaussians, Unreadable> {
    if header.encoding != Encoding::Little {
        return Err(Unreadable::new("is a compressed .ply that is not little-endian, as no program writes it"));
    }
    let needed = |name: &str| {
        Table::of(header, name, body)?
            .ok_or_else(|| Unreadable::new(format!("is an incomplete compressed .ply: it has no element `{name}`")))
    };
    let (chunks, vertices) = (needed("chunk")?, needed("vertex")?);
    let n = vertices.element.count;
    if chunks.element.count < n.div_ceil(CHUNK) {
        return Err(Unreadable::new(format!(
            "is an incomplete compressed .ply: {n} Gaussians need {} chunks, it has {}",
            n.div_ceil(CHUNK),
            chunks.element.count
        )));
    }
    let words =
        vertices.offsets(["packed_position", "packed_rotation", "packed_scale", "packed_color"], Scalar::U32)?;
    let centre_bounds = chunks.offsets(["min_x", "min_y", "min_z", "max_x", "max_y", "max_z"], Scalar::F32)?;
    let scale_bounds = chunks.offsets(
        ["min_scale_x", "min_scale_y", "min_scale_z", "max_scale_x", "max_scale_y", "max_scale_z"],
        Scalar::F32,
    )?;
    // Earlier files have none: colours are from 0 to 1.
    let colour_bounds = chunks.offsets(["min_r", "min_g", "min_b", "max_r", "max_g", "max_b"], Scalar::F32).ok();
    let bounds = |chunk: usize, offsets: [usize; 6]| -> Bounds {
        let [a, b, c, d, e, f] = offsets.map(|offset| f32::from_le_bytes(chunks.word(chunk, offset)));
        [[a, b, c], [d, e, f]]
    };
    let others = Table::of(header, "sh", body)?;
    let others = others.as_ref().map(Harmonics::of).transpose()?;
    if others.as_ref().is_some_and(|others| others.table.element.count < n) {
        return Err(Unreadable::new("is an incomplete compressed .ply: it has fewer harmonics than Gaussians"));
    }
    let degree = others.as_ref().map_or_else(Default::default, |others| others.degree);
    let mut gaussians = Gaussians { degree, ..Gaussians::default() };
    for index in 0..n {
        let [place, rotation, scale, colour] = words.map(|offset| u32::from_le_bytes(vertices.word(index, offset)));
        let thirds = |word: u32| [share(word, 21, 11), share(word, 11, 10), share(word, 0, 11)];
        let chunk = index / CHUNK;
        gaussians.centres.push(between(bounds(chunk, centre_bounds), thirds(place)));
        gaussians.log_scales.push(between(bounds(chunk, scale_bounds), thirds(scale)));
        gaussians.rotations.push(unpack_rotation(rotation));
        let shares = [share(colour, 24, 8), share(colour, 16, 8), share(colour, 8, 8)];
        let rgb = colour_bounds.map_or(shares, |offsets| between(bounds(chunk, offsets), shares));
        gaussians.harmonics.push(rgb.map(constant_of_colour));
        gaussians.opacity_logits.push(logit_of_byte(colour as u8));
        if let Some(others) = &others {
            gaussians.harmonics.extend(others.row(index));
        }
    }
    Ok(gaussians)
}

/// (w, x, y, z) of length 1.
fn unpack_rotation(word: u32) -> [f32; 4] {
    let parts = [20, 10, 0].map(|shift| (share(word, shift, 10) - 0.5) * SQRT_2);
    let largest = (1.0 - parts.iter().map(|part| part * part).sum::<f32>()).max(0.0).sqrt();
    let mut rotation = [largest; 4];
    for (part, index) in parts.into_iter().zip((0..4).filter(|&index| index != (word >> 30) as usize)) {
        rotation[index] = part;
    }
    rotation
}

/// The element `sh`.
struct Harmonics<'a> {
    table: &'a Table<'a>,
    degree: crate::Degree,
    /// `f_rest_0` and on: all of red, then of green, then of blue.
    offsets: Vec<usize>,
}

impl<'a> Harmonics<'a> {
    fn of(table: &'a Table<'a>) -> Result<Self, Unreadable> {
        let offsets: Vec<usize> =
            (0..).map_while(|number| table.offset(&format!("f_rest_{number}"), Scalar::U8)).collect();
        let degree = degree_of(offsets.len()).ok_or_else(|| {
            Unreadable::new(format!(
                "is a compressed .ply with {} harmonics, of which there are 9, 24 or 45",
                offsets.len()
            ))
        })?;
        Ok(Self { table, degree, offsets })
    }

    fn row(&self, index: usize) -> impl Iterator<Item = [f32; 3]> {
        let n_held = self.offsets.len() / 3;
        let value = move |offset: usize| of_byte(self.table.bytes[index * self.table.row_bytes + offset]);
        (0..self.degree.n_coefficients() - 1)
            .map(move |number| [0, 1, 2].map(|channel| value(self.offsets[channel * n_held + number])))
    }
}

/// The middle of a byte's step from −4 to 4; the least and the largest stand for the ends.
fn of_byte(byte: u8) -> f32 {
    match byte {
        0 => -4.0,
        255 => 4.0,
        _ => (f32::from(byte) + 0.5) / 32.0 - 4.0,
    }
}
