//! The rows of a .ply file: which property is which number of a Gaussian, and all of them read.

use super::header::{Encoding, Header, Scalar};
use crate::{Degree, Gaussians, Unreadable};

/// The properties every Gaussian has, in the order of [`Columns::fixed`].
const FIXED: [&str; 14] = [
    "x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2",
    "rot_3",
];

/// Missing where all Gaussians are flat disks, as Huang et al. (2024, 2DGS) write them.
const THIRD_SCALE: &str = "scale_2";

/// Where the numbers of a Gaussian stand among the properties of a vertex.
pub(super) struct Columns {
    degree: Degree,
    /// `None` for the third deviation of flat disks, which have two.
    fixed: [Option<usize>; FIXED.len()],
    /// `f_rest_0` and on.
    rest: Vec<usize>,
    /// Names of what is not read.
    pub(super) ignored: Vec<String>,
}

impl Columns {
    pub(super) fn find(header: &Header<'_>) -> Result<Self, Unreadable> {
        let properties = &header.vertex().properties;
        for (index, property) in properties.iter().enumerate() {
            if properties[..index].iter().any(|earlier| earlier.name == property.name) {
                return Err(Unreadable::new(format!("lists the property `{}` of its vertices twice", property.name)));
            }
            if property.scalar.is_none() {
                return Err(Unreadable::new(format!(
                    "has a list, `{}`, among the properties of its vertices",
                    property.name
                )));
            }
        }
        let index_of = |name: &str| properties.iter().position(|property| property.name == name);
        let mut fixed = [None; FIXED.len()];
        for (column, name) in fixed.iter_mut().zip(FIXED) {
            *column = index_of(name);
            if column.is_none() && name != THIRD_SCALE {
                return Err(missing(header, name));
            }
        }
        let n_rest = properties.iter().filter(|property| property.name.starts_with("f_rest_")).count();
        let rest = (0..n_rest)
            .map(|number| {
                let name = format!("f_rest_{number}");
                index_of(&name).ok_or_else(|| {
                    Unreadable::new(format!("has {n_rest} properties `f_rest_…`, and `{name}` is not among them"))
                })
            })
            .collect::<Result<Vec<_>, _>>()?;
        let degree = degree_of(n_rest).ok_or_else(|| {
            Unreadable::new(format!(
                "has {n_rest} properties `f_rest_…`; spherical harmonics of degree 0, 1, 2, 3 and 4 have 0, 9, 24, 45 and 72"
            ))
        })?;
        let known = |index: usize| fixed.contains(&Some(index)) || rest.contains(&index);
        let mut ignored: Vec<String> = properties
            .iter()
            .enumerate()
            .filter(|(index, property)| !known(*index) && !matches!(property.name, "nx" | "ny" | "nz"))
            .map(|(_, property)| format!("property {}", property.name))
            .collect();
        if n_rest > 3 * degree.n_coefficients() {
            ignored.push("spherical harmonics of degree 4".to_owned());
        }
        ignored.extend(header.others().filter(|other| other.count > 0).map(|other| format!("element {}", other.name)));
        Ok(Self { degree, fixed, rest, ignored })
    }

    /// Reads the vertices, which begin `body`.
    pub(super) fn read(&self, header: &Header<'_>, body: &[u8]) -> Result<Gaussians, Unreadable> {
        match header.encoding {
            Encoding::Ascii => self.read_ascii(header, body),
            encoding => self.read_binary(header, body, encoding == Encoding::Big),
        }
    }

    fn read_ascii(&self, header: &Header<'_>, body: &[u8]) -> Result<Gaussians, Unreadable> {
        let n_properties = header.vertex().properties.len();
        let count = header.vertex().count;
        let mut gaussians = Gaussians { degree: self.degree, ..Gaussians::default() };
        let mut row = Vec::with_capacity(n_properties);
        let mut lines = body.split(|&byte| byte == b'\n');
        for index in 0..count {
            let line = lines.next().filter(|line| !line.is_empty()).ok_or_else(|| cut_off(index, count))?;
            let text = std::str::from_utf8(line).map_err(|_| {
                Unreadable::new(format!("is not text in vertex {index} although its format is `ascii`"))
            })?;
            row.clear();
            for word in text.split_whitespace() {
                let number = number(word).ok_or_else(|| {
                    Unreadable::new(format!("has `{}` for a number in vertex {index}", word.escape_debug()))
                })?;
                row.push(number as f32);
            }
            if row.len() != n_properties {
                return Err(Unreadable::new(format!(
                    "has {} numbers in vertex {index}, its header lists {n_properties} properties",
                    row.len()
                )));
            }
            self.push(&mut gaussians, &row);
        }
        Ok(gaussians)
    }

    fn read_binary(&self, header: &Header<'_>, body: &[u8], is_big: bool) -> Result<Gaussians, Unreadable> {
        let scalars: Vec<Scalar> = header.vertex().properties.iter().filter_map(|property| property.scalar).collect();
        // At least that of the fixed columns, so never 0.
        let n_bytes: usize = scalars.iter().map(|scalar| scalar.n_bytes()).sum();
        let (held, count) = (body.len() / n_bytes, header.vertex().count);
        // Before anything is reserved, so that a hostile count costs nothing.
        if held < count {
            return Err(cut_off(held, count));
        }
        let mut gaussians = Gaussians { degree: self.degree, ..Gaussians::default() };
        gaussians.centres.reserve_exact(count);
        gaussians.log_scales.reserve_exact(count);
        gaussians.rotations.reserve_exact(count);
        gaussians.opacity_logits.reserve_exact(count);
        gaussians.harmonics.reserve_exact(count * self.degree.n_coefficients());
        let mut row = Vec::with_capacity(scalars.len());
        for vertex in body.chunks_exact(n_bytes).take(count) {
            row.clear();
            let mut rest = vertex;
            for &scalar in &scalars {
                let (number, after) = rest.split_at(scalar.n_bytes());
                row.push(to_f32(scalar, number, is_big));
                rest = after;
            }
            self.push(&mut gaussians, &row);
        }
        Ok(gaussians)
    }

    /// Adds one Gaussian from the numbers of its vertex.
    fn push(&self, gaussians: &mut Gaussians, row: &[f32]) {
        let [x, y, z, red, green, blue, opacity, scale_0, scale_1, scale_2, w, i, j, k] =
            self.fixed.map(|column| column.map_or(f32::NEG_INFINITY, |column| row[column]));
        gaussians.centres.push([x, y, z]);
        gaussians.harmonics.push([red, green, blue]);
        let (n_rest, n_held) = (self.degree.n_coefficients() - 1, self.rest.len() / 3);
        let of = |channel: usize, coefficient: usize| row[self.rest[channel * n_held + coefficient]];
        gaussians.harmonics.extend((0..n_rest).map(|coefficient| [0, 1, 2].map(|channel| of(channel, coefficient))));
        gaussians.opacity_logits.push(opacity);
        gaussians.log_scales.push([scale_0, scale_1, scale_2]);
        gaussians.rotations.push([w, i, j, k]);
    }
}

/// The degree whose coefficients beyond the first make `n_rest` numbers; 3 for those of degree 4.
pub(super) fn degree_of(n_rest: usize) -> Option<Degree> {
    const OF_DEGREE_4: usize = 72;
    let n_rest = if n_rest == OF_DEGREE_4 { 45 } else { n_rest };
    n_rest.is_multiple_of(3).then(|| Degree::with_coefficients(n_rest / 3 + 1)).flatten()
}

/// A number as programs write it, `-nan(ind)` of Microsoft's library included.
fn number(word: &str) -> Option<f64> {
    let is_nan = || word.trim_start_matches(['+', '-']).get(..3).is_some_and(|start| start.eq_ignore_ascii_case("nan"));
    word.parse().ok().or_else(|| is_nan().then_some(f64::NAN))
}

pub(super) fn cut_off(held: usize, count: usize) -> Unreadable {
    Unreadable::new(format!(
        "is cut off: it holds {held} of the {count} Gaussians that its header promises; copy it again from where it was made"
    ))
}

/// Says what a file without the property `name` is.
fn missing(header: &Header<'_>, name: &str) -> Unreadable {
    let has = |wanted: &str| header.vertex().properties.iter().any(|property| property.name == wanted);
    let needed = format!("its vertices have no property `{name}`");
    Unreadable::new(if has("opacity") || has("scale_0") || has("f_dc_0") {
        format!("is no complete file of Gaussians: {needed}")
    } else if header.others().any(|other| matches!(other.name, "face" | "tristrips") && other.count > 0) {
        format!("is a mesh, not Gaussians: {needed}; train on photographs of it, or on renderings")
    } else {
        format!(
            "is a bare point cloud, not Gaussians: {needed}; points can only start a training, beside its photographs"
        )
    })
}

fn to_f32(scalar: Scalar, bytes: &[u8], is_big: bool) -> f32 {
    let mut little = [0; 8];
    little[..bytes.len()].copy_from_slice(bytes);
    if is_big {
        little[..bytes.len()].reverse();
    }
    let [a, b, c, d, ..] = little;
    match scalar {
        Scalar::I8 => f32::from(i8::from_le_bytes([a])),
        Scalar::U8 => f32::from(a),
        Scalar::I16 => f32::from(i16::from_le_bytes([a, b])),
        Scalar::U16 => f32::from(u16::from_le_bytes([a, b])),
        Scalar::I32 => i32::from_le_bytes([a, b, c, d]) as f32,
        Scalar::U32 => u32::from_le_bytes([a, b, c, d]) as f32,
        Scalar::F32 => f32::from_le_bytes([a, b, c, d]),
        Scalar::F64 => f64::from_le_bytes(little) as f32,
    }
}
