//! `.glb` with `KHR_gaussian_splatting` (Khronos, release candidate of 2026), read: one accessor for each attribute.
//!
//! Deviations and opacities are plain numbers, rotations have w last, harmonics one accessor for each coefficient. The axes of glTF are x
//! left, y up, z forward.

use serde_json::Value;

use crate::axes::Signs;
use crate::{Degree, Gaussians, Notes, Unreadable};

const EXTENSION: &str = "KHR_gaussian_splatting";
/// From glTF's axes to x right, y down, z forward.
const SIGNS: Signs = Signs([-1.0, -1.0, 1.0]);
/// Length, type; the header before the first has a magic, a version and the file's length.
const CHUNK_BYTES: usize = 8;
const HEADER_BYTES: usize = 12;

/// Reads the first primitive that has Gaussians.
///
/// # Errors
/// [`Unreadable`] for files without any, with compressed ones, and for what is cut off. Memory follows the bytes that are there.
pub fn read(bytes: &[u8]) -> Result<(Gaussians, Notes), Unreadable> {
    let cut =
        || Unreadable::new("is cut off: its chunks end outside of the file; copy it again from where it was made");
    let (json, rest) = chunk(bytes.get(HEADER_BYTES..).unwrap_or_default(), b"JSON").ok_or_else(cut)?;
    let json: Value = serde_json::from_slice(json)
        .map_err(|error| Unreadable::new(format!("is a .glb whose JSON cannot be read: {error}")))?;
    let binary = chunk(rest, b"BIN\0").map_or(&[][..], |(binary, _)| binary);
    let primitives: Vec<&Value> = list(&json, "meshes")
        .flat_map(|mesh| list(mesh, "primitives"))
        .filter(|primitive| !primitive["extensions"][EXTENSION].is_null())
        .collect();
    let [primitive, others @ ..] = primitives.as_slice() else {
        return Err(Unreadable::new(format!(
            "is a binary glTF file without {EXTENSION}: a mesh, not Gaussians; train on photographs of it, or on renderings"
        )));
    };
    let file = File { json: &json, binary };
    let gaussians = file.gaussians(primitive)?;
    let (gaussians, mut warnings) = gaussians.meant()?;
    if !others.is_empty() {
        warnings.push(format!("only the first of its {} clouds is read", primitives.len()));
    }
    let moves = ["matrix", "translation", "rotation", "scale"];
    if list(&json, "nodes").any(|node| moves.iter().any(|name| !node[name].is_null())) {
        warnings.push("its nodes move, turn or scale their meshes, which is left out".to_owned());
    }
    Ok((gaussians, Notes { warnings, ..Notes::default() }))
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
        let row =
            |index: usize| std::array::from_fn(|part| component(kind, &bytes[index * stride + part * size..][..size]));
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

/// Whole numbers are normalised ones: from −1 or 0 to 1.
fn component(kind: usize, bytes: &[u8]) -> f32 {
    match (kind, bytes) {
        (5120, &[a]) => (f32::from(a as i8) / 127.0).max(-1.0),
        (5121, &[a]) => f32::from(a) / 255.0,
        (5122, &[a, b]) => (f32::from(i16::from_le_bytes([a, b])) / 32_767.0).max(-1.0),
        (5123, &[a, b]) => f32::from(u16::from_le_bytes([a, b])) / 65_535.0,
        (_, &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]),
        _ => f32::NAN,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::json;

    use super::{CHUNK_BYTES, read};
    use crate::Degree;

    /// A file of JSON and bytes.
    fn glb(json: &serde_json::Value, binary: &[u8]) -> Vec<u8> {
        let json = json.to_string().into_bytes();
        let mut file = [b"glTF".as_slice(), &2u32.to_le_bytes(), &0u32.to_le_bytes()].concat();
        for (kind, content) in [(b"JSON", json.as_slice()), (b"BIN\0", binary)] {
            file.extend((content.len() as u32).to_le_bytes());
            file.extend(kind);
            file.extend(content);
        }
        file
    }

    /// Two Gaussians of degree 1; rotations are bytes.
    fn example() -> (serde_json::Value, Vec<u8>) {
        let floats: [&[f32]; 7] = [
            &[1.0, 2.0, 3.0, -1.0, 0.0, 4.0],
            &[1.0, 0.5, 0.25, 1.0, 1.0, 1.0],
            &[0.5, 1.0],
            &[0.1, 0.2, 0.3, 0.4, 0.5, 0.6],
            &[1.0; 6],
            &[2.0; 6],
            &[3.0; 6],
        ];
        let mut binary: Vec<u8> = [127u8, 0, 0, 0, 0, 0, 129, 127].to_vec();
        let mut views = vec![json!({"buffer": 0, "byteOffset": 0, "byteLength": 8})];
        let mut accessors =
            vec![json!({"bufferView": 0, "componentType": 5120, "normalized": true, "count": 2, "type": "VEC4"})];
        for values in floats {
            views.push(json!({"buffer": 0, "byteOffset": binary.len(), "byteLength": 4 * values.len()}));
            accessors.push(json!({"bufferView": views.len() - 1, "componentType": 5126, "count": 2}));
            values.iter().for_each(|value| binary.extend(value.to_le_bytes()));
        }
        let of = |name: &str| format!("KHR_gaussian_splatting:{name}");
        let mut attributes = json!({"POSITION": 1});
        for (at, name) in [
            "ROTATION",
            "",
            "SCALE",
            "OPACITY",
            "SH_DEGREE_0_COEF_0",
            "SH_DEGREE_1_COEF_0",
            "SH_DEGREE_1_COEF_1",
            "SH_DEGREE_1_COEF_2",
        ]
        .iter()
        .enumerate()
        .filter(|(_, name)| !name.is_empty())
        {
            attributes[of(name)] = at.into();
        }
        let json = json!({
            "meshes": [{"primitives": [{"attributes": attributes, "extensions": {"KHR_gaussian_splatting": {}}}]}],
            "nodes": [{"mesh": 0}], "bufferViews": views, "accessors": accessors,
        });
        (json, binary)
    }

    #[test]
    fn accessors_are_read() {
        let (json, binary) = example();
        let (gaussians, notes) = read(&glb(&json, &binary)).expect("whole");
        assert_eq!((gaussians.degree, &gaussians.centres), (Degree::One, &vec![[-1.0, -2.0, 3.0], [1.0, 0.0, 4.0]]));
        assert_eq!(gaussians.log_scales[0], [0.0, 0.5f32.ln(), 0.25f32.ln()]);
        // x and z of the rotation turn with the axes: −y·z and −x·y of them are 1.
        assert_eq!(gaussians.rotations, [[0.0, -1.0, -0.0, 0.0], [1.0, -0.0, -0.0, -1.0]]);
        assert_eq!(gaussians.opacity_logits, [0.0, 20.0]);
        assert_eq!(gaussians.harmonics[..4], [[0.1, 0.2, 0.3], [-1.0; 3], [2.0; 3], [-3.0; 3]]);
        assert!(notes.warnings.len() == 1 && notes.warnings[0].starts_with("1 of 2 opacities"), "{notes:?}");
    }

    #[test]
    fn what_is_missing_is_named() {
        let (json, binary) = example();
        let said = |json: &serde_json::Value, binary: &[u8]| read(&glb(json, binary)).expect_err("broken").to_string();
        let mut mesh = json.clone();
        mesh["meshes"][0]["primitives"][0]["extensions"] = json!({});
        assert!(said(&mesh, &binary).contains("a mesh, not Gaussians"));
        let mut packed = json.clone();
        packed["meshes"][0]["primitives"][0]["attributes"] = json!({"POSITION": 1});
        assert!(
            said(&packed, &binary)
                .contains("no attribute `KHR_gaussian_splatting:ROTATION`, as where they are compressed")
        );
        assert!(said(&json, &binary[..binary.len() - 1]).contains("ends outside of the file"));
        let mut many = json.clone();
        many["accessors"][1]["count"] = u64::MAX.into();
        assert!(said(&many, &binary).contains("ends outside of the file"));
        assert!(read(b"glTF\x02\0\0\0").expect_err("cut").to_string().starts_with("is cut off"));
        let mut moved = json;
        moved["nodes"][0]["translation"] = json!([1, 2, 3]);
        assert!(read(&glb(&moved, &binary)).expect("whole").1.warnings[1].contains("move, turn or scale"));
    }

    proptest! {
        #[test]
        fn no_change_of_a_file_panics(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8), cut in any::<prop::sample::Index>()) {
            let (json, binary) = example();
            let mut bytes = glb(&json, &binary);
            for (place, value) in changes {
                let place = place.index(bytes.len() - CHUNK_BYTES) + CHUNK_BYTES;
                bytes[place] = value;
            }
            let _ = read(&bytes);
            let _ = read(&bytes[..cut.index(bytes.len())]);
        }
    }
}
