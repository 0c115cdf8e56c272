//! .ply as Kerbl et al. (2023) publish theirs: one element `vertex` with
//! `x y z nx ny nz f_dc_0‥2 f_rest_0‥44 opacity scale_0‥2 rot_0‥3`.
//!
//! Opacities are logits, scales natural logarithms, rotations quaternions with w first. `f_rest` keeps all coefficients of red first,
//! then of green, then of blue. The axes are the scene's own: x right, y down, z forward in what this project writes. Comments of the
//! header say how opacities are meant (`SplatRenderMode: mip` with compensation, else `default`) and the degree.

mod compressed;
mod rows;
#[cfg(test)]
mod tests;

use std::fmt::Write as _;

use pocketsplat_files::ply::{self, Encoding, Header};

use crate::account::Account;
use crate::{Frame, Gaussians, Notes, Unreadable};
use rows::Columns;

/// Begins the comment that says how opacities are meant.
const RENDER_MODE: &str = "SplatRenderMode:";

/// Begins the comment that says where the file's numbers lie in the scene.
const FRAME: &str = "Frame:";

/// Numbers of a Gaussian besides those of `f_rest`: centre, normal, colour, opacity, scales, rotation.
const N_FIXED: usize = 17;

/// Writes a binary, little-endian file; normals are 0.
pub fn write(gaussians: &Gaussians, notes: &Notes) -> Vec<u8> {
    let n_rest = 3 * (gaussians.degree.n_coefficients() - 1);
    let mut bytes = header_text(gaussians, notes, n_rest).into_bytes();
    bytes.reserve_exact(gaussians.len() * 4 * (N_FIXED + n_rest));
    let mut put = |values: &[f32]| bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    for index in 0..gaussians.len() {
        put(&gaussians.centres[index]);
        put(&[0.0; 3]);
        let (constant, rest) = gaussians.harmonics_of(index).split_first().expect("a degree has a coefficient");
        put(constant);
        for channel in 0..3 {
            for coefficient in rest {
                put(&[coefficient[channel]]);
            }
        }
        put(&[gaussians.opacity_logits[index]]);
        put(&gaussians.log_scales[index]);
        put(&gaussians.rotations[index]);
    }
    bytes
}

fn header_text(gaussians: &Gaussians, notes: &Notes, n_rest: usize) -> String {
    let mode = if notes.compensation { "mip" } else { "default" };
    let mut text = String::from("ply\nformat binary_little_endian 1.0\n");
    let own = [format!("{RENDER_MODE} {mode}"), format!("SH degree: {}", gaussians.degree.number())];
    // A line break in a comment would end it.
    let given = notes.comments.iter().flat_map(|comment| comment.lines()).map(str::to_owned);
    let frame = (!notes.frame.is_identity()).then(|| format!("{FRAME} {}", notes.frame));
    for comment in own.into_iter().chain(frame).chain(given) {
        let _ = writeln!(text, "comment {comment}");
    }
    let _ = writeln!(text, "element vertex {}", gaussians.len());
    for name in ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"] {
        let _ = writeln!(text, "property float {name}");
    }
    for index in 0..n_rest {
        let _ = writeln!(text, "property float f_rest_{index}");
    }
    for name in ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"] {
        let _ = writeln!(text, "property float {name}");
    }
    text.push_str("end_header\n");
    text
}

/// Reads a file of any of the three encodings, with its properties in any order and of any type; also the compressed ones of SuperSplat.
///
/// Normals and comments that only repeat the header are dropped; every other property and element that no Gaussian has is named in
/// [`Notes::ignored`]. Comments need not be UTF-8.
///
/// # Errors
/// [`Unreadable`] for what is no file of Gaussians, is cut off or damaged, or holds mostly numbers that cannot be drawn. Memory follows
/// the bytes that are there, never the header's count.
pub fn read(bytes: &[u8]) -> Result<(Gaussians, Notes), Unreadable> {
    let (head, body) = ply::split(bytes)?;
    let text = String::from_utf8_lossy(head);
    let header = Header::parse(&text)?;
    let mut notes = notes_of(&header)?;
    if header.encoding != Encoding::Ascii {
        ply::check_line_endings(&header, head, body)?;
    }
    let gaussians = if compressed::is_one(&header) {
        compressed::read(&header, body)?
    } else {
        let columns = Columns::find(&header)?;
        notes.ignored.clone_from(&columns.ignored);
        columns.read(&header, header.skip_to_vertices(body)?)?
    };
    let (gaussians, warnings) = gaussians.meant()?;
    Ok((gaussians, Notes { warnings, ..notes }))
}

/// Where the bytes of a file went.
pub(crate) fn account(bytes: &[u8]) -> Result<Account, Unreadable> {
    let (head, body) = ply::split(bytes)?;
    let text = String::from_utf8_lossy(head);
    let header = Header::parse(&text)?;
    let mut parts = vec![("header", bytes.len() - body.len())];
    let mut add = |name: &'static str, bytes: usize| match parts.iter_mut().find(|(other, _)| *other == name) {
        Some((_, sum)) => *sum += bytes,
        None => parts.push((name, bytes)),
    };
    let is_text = header.encoding == Encoding::Ascii;
    for element in header.others().chain([header.vertex()]).filter(|_| !is_text) {
        for property in &element.properties {
            let name = match (element.name, property.name) {
                ("chunk", _) => "bounds of chunks",
                ("vertex", "x" | "y" | "z" | "packed_position") => "centres",
                ("vertex", "opacity") => "opacities",
                ("vertex", "packed_color") => "constant colours and opacities",
                ("vertex", name) if name.starts_with("f_dc_") => "constant colours",
                ("vertex" | "sh", name) if name.starts_with("f_rest_") => "harmonics",
                ("vertex", name) if name.starts_with("scale_") || name == "packed_scale" => "deviations",
                ("vertex", name) if name.starts_with("rot_") || name == "packed_rotation" => "rotations",
                _ => "others",
            };
            add(name, element.count.saturating_mul(property.scalar.map_or(0, ply::Scalar::n_bytes)));
        }
    }
    if is_text {
        add("text", body.len());
    }
    let encoding = match header.encoding {
        Encoding::Ascii => "text",
        Encoding::Little => "little-endian",
        Encoding::Big => "big-endian",
    };
    let kind = if compressed::is_one(&header) { "compressed .ply" } else { ".ply" };
    Ok(Account::new(format!("{kind}, {encoding}"), None, &parts))
}

/// What the comments say.
fn notes_of(header: &Header<'_>) -> Result<Notes, Unreadable> {
    let mut notes = Notes::default();
    for comment in &header.comments {
        if let Some(mode) = comment.strip_prefix(RENDER_MODE) {
            notes.compensation = match mode.trim() {
                "default" => false,
                "mip" => true,
                other => {
                    return Err(Unreadable::new(format!(
                        "says `{RENDER_MODE} {other}`: its Gaussians are not drawn as those that are known, which are `default` and `mip`"
                    )));
                }
            };
        } else if let Some(frame) = comment.strip_prefix(FRAME).and_then(Frame::of_text) {
            notes.frame = frame;
        } else if !comment.starts_with("SH degree:") {
            notes.comments.push((*comment).to_owned());
        }
    }
    Ok(notes)
}
