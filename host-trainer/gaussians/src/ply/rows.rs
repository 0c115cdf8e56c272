//! Which property of a vertex is which number of a Gaussian, and all Gaussians read.

use pocketsplat_files::ply::{Header, vertices};

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
        let mut gaussians = Gaussians { degree: self.degree, ..Gaussians::default() };
        // A number takes a byte at least, so that a hostile count costs nothing.
        let count = header.vertex().count.min(body.len() / header.vertex().properties.len().max(1));
        gaussians.centres.reserve_exact(count);
        gaussians.log_scales.reserve_exact(count);
        gaussians.rotations.reserve_exact(count);
        gaussians.opacity_logits.reserve_exact(count);
        gaussians.harmonics.reserve_exact(count * self.degree.n_coefficients());
        vertices(header, body, |row| self.push(&mut gaussians, row))?;
        Ok(gaussians)
    }

    /// Adds one Gaussian from the numbers of its vertex.
    fn push(&self, gaussians: &mut Gaussians, row: &[f64]) {
        let [x, y, z, red, green, blue, opacity, scale_0, scale_1, scale_2, w, i, j, k] =
            self.fixed.map(|column| column.map_or(f32::NEG_INFINITY, |column| row[column] as f32));
        gaussians.centres.push([x, y, z]);
        gaussians.harmonics.push([red, green, blue]);
        let (n_rest, n_held) = (self.degree.n_coefficients() - 1, self.rest.len() / 3);
        let of = |channel: usize, coefficient: usize| row[self.rest[channel * n_held + coefficient]] as f32;
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
