//! `.glb` with `KHR_gaussian_splatting` (Khronos, ratified in 2026): one accessor for each attribute.
//!
//! Deviations and opacities are plain numbers, rotations have w last, harmonics one accessor for each coefficient. The axes of glTF are x
//! left, y up, z forward.

#[cfg(test)]
mod tests;
mod writer;

use serde_json::Value;

pub use writer::write;

use crate::account::Account;
use crate::axes::Signs;
use crate::{Degree, Frame, Gaussians, Notes, Unreadable};

const EXTENSION: &str = "KHR_gaussian_splatting";
/// From glTF's axes to x right, y down, z forward.
const SIGNS: Signs = Signs([-1.0, -1.0, 1.0]);
/// Length, type; the header before the first has a magic, a version and the file's length.
const CHUNK_BYTES: usize = 8;
const HEADER_BYTES: usize = 12;
/// In the asset's extras: how the file's numbers lie in the scene ([`crate::Frame`]), and whether opacities make up for the dilation. glTF
/// itself has no word for either.
const FRAME: &str = "pocketsplatFrame";
const ANTIALIAS: &str = "antialias";

/// Reads the first primitive that has Gaussians.
///
/// # Errors
/// [`Unreadable`] for files without any, with compressed ones, and for what is cut off. Memory follows the bytes that are there.
pub fn read(bytes: &[u8]) -> Result<(Gaussians, Notes), Unreadable> {
    let Content { json, binary } = Content::of(bytes)?;
    let clouds = clouds(&json);
    let [primitive, others @ ..] = clouds.as_slice() else {
        return Err(Unreadable::new(format!(
            "is a binary glTF file without {EXTENSION}: a mesh, not Gaussians; train on photographs of it, or on renderings"
        )));
    };
    let file = File { json: &json, binary };
    let gaussians = file.gaussians(primitive)?;
    let (gaussians, mut warnings) = gaussians.meant()?;
    if !others.is_empty() {
        warnings.push(format!("only the first of its {} clouds is read", clouds.len()));
    }
    let moves = ["matrix", "translation", "rotation", "scale"];
    if list(&json, "nodes").any(|node| moves.iter().any(|name| !node[name].is_null())) {
        warnings.push("its nodes move, turn or scale their meshes, which is left out".to_owned());
    }
    let extension = &primitive["extensions"][EXTENSION];
    for (name, known) in [("colorSpace", "srgb_rec709_display"), ("kernel", "ellipse")] {
        if let Some(found) = extension[name].as_str().filter(|found| *found != known) {
            warnings.push(format!("its `{name}` is `{found}`, and is taken for `{known}`"));
        }
    }
    let extras = &json["asset"]["extras"];
    let numbers = serde_json::from_value(extras[FRAME].clone()).ok();
    let frame = numbers.and_then(Frame::of_numbers).unwrap_or_default();
    let compensation = extras[ANTIALIAS].as_bool().unwrap_or(false);
    Ok((gaussians, Notes { compensation, frame, warnings, ..Notes::default() }))
}

/// Where the bytes of a file went, by attribute.
///
/// # Errors
/// As [`read`].
pub(crate) fn account(bytes: &[u8]) -> Result<Account, Unreadable> {
    let Content { json, binary } = Content::of(bytes)?;
    let mut parts = vec![("header", bytes.len() - binary.len())];
    let clouds = clouds(&json);
    let attributes = clouds.first().and_then(|cloud| cloud["attributes"].as_object());
    for (attribute, index) in attributes.into_iter().flatten() {
        let name = match attribute.strip_prefix(EXTENSION).unwrap_or(attribute) {
            "POSITION" => "centres",
            "COLOR_0" => "fallback colours",
            ":ROTATION" => "rotations",
            ":SCALE" => "deviations",
            ":OPACITY" => "opacities",
            ":SH_DEGREE_0_COEF_0" => "constant colours",
            other if other.starts_with(":SH_DEGREE_") => "harmonics",
            _ => "others",
        };
        let accessor = &json["accessors"][index.as_u64().unwrap_or(u64::MAX) as usize];
        let n_parts = match accessor["type"].as_str() {
            Some("SCALAR") => 1,
            Some("VEC3") => 3,
            _ => 4,
        };
        let size = component_bytes(accessor["componentType"].as_u64().unwrap_or(0) as usize).unwrap_or(0);
        let length = (accessor["count"].as_u64().unwrap_or(0) as usize).saturating_mul(n_parts * size);
        let length = length.min(binary.len());
        match parts.iter_mut().find(|(other, _)| *other == name) {
            Some((_, sum)) => *sum += length,
            None => parts.push((name, length)),
        }
    }
    Ok(Account::new(".glb".to_owned(), None, &parts))
}

/// The primitives that are Gaussians.
fn clouds(json: &Value) -> Vec<&Value> {
    let primitives = list(json, "meshes").flat_map(|mesh| list(mesh, "primitives"));
    primitives.filter(|primitive| !primitive["extensions"][EXTENSION].is_null()).collect()
}

/// A file's two chunks.
struct Content<'a> {
    json: Value,
    binary: &'a [u8],
}

impl<'a> Content<'a> {
    fn of(bytes: &'a [u8]) -> Result<Self, Unreadable> {
        let cut =
            || Unreadable::new("is cut off: its chunks end outside of the file; copy it again from where it was made");
        let (json, rest) = chunk(bytes.get(HEADER_BYTES..).unwrap_or_default(), b"JSON").ok_or_else(cut)?;
        let json = serde_json::from_slice(json)
            .map_err(|error| Unreadable::new(format!("is a .glb whose JSON cannot be read: {error}")))?;
        Ok(Self { json, binary: chunk(rest, b"BIN\0").map_or(&[][..], |(binary, _)| binary) })
    }
}

/// The content of the chunk that begins `bytes`, and what follows it; `None` where it is of another type or cut off.
fn chunk<'a>(bytes: &'a [u8], kind: &[u8; 4]) -> Option<(&'a [u8], &'a [u8])> {
    let (head, rest) = bytes.split_at_checked(CHUNK_BYTES)?;
    let length = u32::from_le_bytes(*head.first_chunk()?) as usize;
    (head[4..] == *kind).then(|| rest.split_at_checked(length)).flatten()
}

fn list<'a>(value: &'a Value, name: &str) -> impl Iterator<Item = &'a Value> {
    value[name].as_array().into_iter().flatten()
}

struct File<'a> {
    json: &'a Value,
    binary: &'a [u8],
}

impl File<'_> {
    fn gaussians(&self, primitive: &Value) -> Result<Gaussians, Unreadable> {
        let attributes = &primitive["attributes"];
        let named = |name: &str| {
            let index = attributes[name].as_u64().ok_or_else(|| {
                Unreadable::new(format!(
                    "is a .glb whose Gaussians have no attribute `{name}`, as where they are compressed; write it uncompressed, or as a \
                     .ply, with the program that made it"
                ))
            })?;
            Ok::<_, Unreadable>((name.to_owned(), index as usize))
        };
        let of = |name: &str| named(&format!("{EXTENSION}:{name}"));
        let centres: Vec<[f32; 3]> = self.rows(named("POSITION")?)?;
        let n = centres.len();
        let rotations: Vec<[f32; 4]> = self.rows(of("ROTATION")?)?;
        let deviations: Vec<[f32; 3]> = self.rows(of("SCALE")?)?;
        let opacities: Vec<[f32; 1]> = self.rows(of("OPACITY")?)?;
        let mut coefficients: Vec<Vec<[f32; 3]>> = Vec::new();
        let mut degree = Degree::Zero;
        for next in Degree::ALL {
            let first = format!("{EXTENSION}:SH_DEGREE_{}_COEF_0", next.number());
            if next > Degree::Zero && attributes[&first].is_null() {
                break;
            }
            for number in 0..2 * next.number() + 1 {
                coefficients.push(self.rows(of(&format!("SH_DEGREE_{}_COEF_{number}", next.number()))?)?);
            }
            degree = next;
        }
        let lengths = [rotations.len(), deviations.len(), opacities.len()];
        if let Some(other) = lengths.into_iter().chain(coefficients.iter().map(Vec::len)).find(|length| *length != n) {
            return Err(Unreadable::new(format!("is a .glb with {n} centres and {other} of another attribute")));
        }
        Ok(Gaussians {
            degree,
            centres: centres.into_iter().map(|centre| SIGNS.centre(centre)).collect(),
            log_scales: deviations.into_iter().map(|row| row.map(f32::ln)).collect(),
            rotations: rotations.into_iter().map(|[x, y, z, w]| SIGNS.rotation([w, x, y, z])).collect(),
            opacity_logits: opacities.into_iter().map(|[opacity]| (opacity / (1.0 - opacity)).ln()).collect(),
            harmonics: (0..n)
                .flat_map(|index| {
                    coefficients.iter().enumerate().map(move |(number, of)| SIGNS.harmonic(number, of[index]))
                })
                .collect(),
        })
    }

    /// The rows of accessor `index`.
    fn rows<const N: usize>(&self, (name, index): (String, usize)) -> Result<Vec<[f32; N]>, Unreadable> {
        let broken = |what: &str| Unreadable::new(format!("is a .glb whose accessor {index} ({name}) {what}"));
        let accessor = &self.json["accessors"][index];
        let view =
            &self.json["bufferViews"][accessor["bufferView"].as_u64().ok_or_else(|| broken("has no bytes"))? as usize];
        let number = |value: &Value| value.as_u64().unwrap_or(0) as usize;
        let kind = number(&accessor["componentType"]);
        let size = component_bytes(kind).ok_or_else(|| broken("has numbers of an unknown type"))?;
        let count = number(&accessor["count"]);
        let stride = if view["byteStride"].is_null() { N * size } else { number(&view["byteStride"]) };
        let start = number(&view["byteOffset"]).saturating_add(number(&accessor["byteOffset"]));
        let last = count.saturating_sub(1).saturating_mul(stride).saturating_add(N * size);
        let bytes = self.binary.get(start..).filter(|rest| count == 0 || last <= rest.len());
        let bytes = bytes.ok_or_else(|| broken("ends outside of the file: it is cut off; copy it again"))?;
        if view["buffer"].as_u64() != Some(0) || stride == 0 {
            return Err(broken("lies in another file"));
        }
        let is_share = accessor["normalized"].as_bool().unwrap_or(false);
        let row = |index: usize| {
            std::array::from_fn(|part| component(kind, is_share, &bytes[index * stride + part * size..][..size]))
        };
        Ok((0..count).map(row).collect())
    }
}

/// Bytes of a number of glTF's component type.
const fn component_bytes(kind: usize) -> Option<usize> {
    match kind {
        5120 | 5121 => Some(1),
        5122 | 5123 => Some(2),
        5126 => Some(4),
        _ => None,
    }
}

/// A number; whole ones stand for themselves, or where they are shares for −1 or 0 to 1.
fn component(kind: usize, is_share: bool, bytes: &[u8]) -> f32 {
    let (whole, most) = match (kind, bytes) {
        (5120, &[a]) => (f32::from(a as i8), 127.0),
        (5121, &[a]) => (f32::from(a), 255.0),
        (5122, &[a, b]) => (f32::from(i16::from_le_bytes([a, b])), 32_767.0),
        (5123, &[a, b]) => (f32::from(u16::from_le_bytes([a, b])), 65_535.0),
        (_, &[a, b, c, d]) => return f32::from_le_bytes([a, b, c, d]),
        _ => (f32::NAN, 1.0),
    };
    if is_share { (whole / most).max(-1.0) } else { whole }
}
