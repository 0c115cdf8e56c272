//! Gaussians as a `.glb`.

use serde_json::{Value, json};

use super::{ANTIALIAS, CHUNK_BYTES, EXTENSION, FRAME, HEADER_BYTES, SIGNS};
use crate::opacity::colour_of_constant;
use crate::{Degree, Gaussians, Notes, Unreadable};

/// glTF's numbers for 32-bit floats, 16-bit shares, and vertices.
const FLOAT: u32 = 5126;
const SHARE: u32 = 5123;
const VERTICES: u32 = 34_962;

/// Writes all numbers in 32 bits, and the constant colours again for programs that draw points alone.
///
/// # Errors
/// [`Unreadable`] for no Gaussian at all, and for more than a file of 4 GiB holds.
pub fn write(gaussians: &Gaussians, notes: &Notes) -> Result<Vec<u8>, Unreadable> {
    if gaussians.is_empty() {
        return Err(Unreadable::new("would hold no Gaussian; an accessor of a .glb has one element at least"));
    }
    let mut parts = Parts::default();
    let centres = gaussians.centres.iter().map(|&centre| SIGNS.centre(centre));
    parts.add_floats("POSITION", "VEC3", centres.clone());
    let bounds = |choose: fn(f32, f32) -> f32| {
        let bound = centres.clone().reduce(|a, b| std::array::from_fn(|axis| choose(a[axis], b[axis])));
        json!(bound.map(|bound| bound.map(f64::from)))
    };
    (parts.accessors[0]["min"], parts.accessors[0]["max"]) = (bounds(f32::min), bounds(f32::max));
    // None that was drawn is lost.
    let opacity = |logit: f32| (1.0 / (1.0 + (-logit).exp())).max(f32::MIN_POSITIVE);
    let points = (0..gaussians.len()).flat_map(|index| {
        let [red, green, blue] = gaussians.harmonics_of(index)[0].map(|channel| light(colour_of_constant(channel)));
        let point = [red, green, blue, opacity(gaussians.opacity_logits[index])];
        point.into_iter().flat_map(|share| ((65_535.0 * share).round() as u16).to_le_bytes())
    });
    parts.add("COLOR_0", "VEC4", SHARE, gaussians.len(), points);
    let of = |name: &str| format!("{EXTENSION}:{name}");
    parts.add_floats(
        &of("ROTATION"),
        "VEC4",
        gaussians.rotations.iter().map(|&rotation| unit(SIGNS.rotation(rotation))),
    );
    parts.add_floats(&of("SCALE"), "VEC3", gaussians.log_scales.iter().map(|scales| scales.map(f32::exp)));
    parts.add_floats(&of("OPACITY"), "SCALAR", gaussians.opacity_logits.iter().map(|&logit| [opacity(logit)]));
    let mut coefficient = 0;
    for degree in Degree::ALL.into_iter().filter(|degree| *degree <= gaussians.degree) {
        for number in 0..2 * degree.number() + 1 {
            let rows = (0..gaussians.len())
                .map(|index| SIGNS.harmonic(coefficient, gaussians.harmonics_of(index)[coefficient]));
            parts.add_floats(&of(&format!("SH_DEGREE_{}_COEF_{number}", degree.number())), "VEC3", rows);
            coefficient += 1;
        }
    }
    parts.into_file(notes)
}

/// Light of a value of sRGB (IEC 61966-2-1): colours of vertices are linear in glTF, those of Gaussians here are not.
fn light(value: f32) -> f32 {
    if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

/// (x, y, z, w) of length 1 of a rotation (w, x, y, z); of one of length 0 none.
fn unit([w, x, y, z]: [f32; 4]) -> [f32; 4] {
    let length = [w, x, y, z].iter().map(|part| f64::from(*part).powi(2)).sum::<f64>().sqrt();
    if length > 0.0 { [x, y, z, w].map(|part| (f64::from(part) / length) as f32) } else { [0.0, 0.0, 0.0, 1.0] }
}

/// The attributes so far.
#[derive(Default)]
struct Parts {
    attributes: serde_json::Map<String, Value>,
    accessors: Vec<Value>,
    views: Vec<Value>,
    binary: Vec<u8>,
}

impl Parts {
    fn add_floats<const N: usize>(&mut self, name: &str, kind: &str, rows: impl Iterator<Item = [f32; N]> + Clone) {
        let n = rows.clone().count();
        self.add(name, kind, FLOAT, n, rows.flatten().flat_map(f32::to_le_bytes));
    }

    /// * `kind`: glTF's name of a row's shape.
    fn add(&mut self, name: &str, kind: &str, component: u32, n: usize, bytes: impl Iterator<Item = u8>) {
        let start = self.binary.len();
        self.binary.extend(bytes);
        self.attributes.insert(name.to_owned(), self.accessors.len().into());
        self.accessors.push(json!({
            "bufferView": self.views.len(), "componentType": component, "normalized": component == SHARE, "count": n, "type": kind,
        }));
        let length = self.binary.len() - start;
        self.views.push(json!({"buffer": 0, "byteOffset": start, "byteLength": length, "target": VERTICES}));
    }

    fn into_file(self, notes: &Notes) -> Result<Vec<u8>, Unreadable> {
        let mut asset = json!({"version": "2.0", "generator": "pocketsplat"});
        if !notes.frame.is_identity() {
            asset["extras"][FRAME] = json!(notes.frame.numbers());
        }
        if notes.compensation {
            asset["extras"][ANTIALIAS] = true.into();
        }
        let extension = json!({
            "kernel": "ellipse", "colorSpace": "srgb_rec709_display", "projection": "perspective", "sortingMethod": "cameraDistance",
        });
        let primitive = json!({"attributes": self.attributes, "mode": 0, "extensions": {EXTENSION: extension}});
        let json = json!({
            "asset": asset, "extensionsUsed": [EXTENSION], "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [primitive]}], "accessors": self.accessors, "bufferViews": self.views,
            "buffers": [{"byteLength": self.binary.len()}],
        });
        let mut json = json.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let n_bytes = HEADER_BYTES + 2 * CHUNK_BYTES + json.len() + self.binary.len();
        let too_long =
            |_| Unreadable::new("would be longer than the 4 GiB that a .glb can say; write a .sog or a .spz");
        let length = |n: usize| u32::try_from(n).map(u32::to_le_bytes).map_err(too_long);
        let mut file = Vec::with_capacity(n_bytes);
        for part in [b"glTF", &2u32.to_le_bytes(), &length(n_bytes)?, &length(json.len())?, b"JSON"] {
            file.extend_from_slice(part);
        }
        file.extend(json);
        file.extend_from_slice(&length(self.binary.len())?);
        file.extend_from_slice(b"BIN\0");
        file.extend(self.binary);
        Ok(file)
    }
}
