//! Points of PLY files: the coordinates of the element `vertex`, ASCII or binary.

use std::path::Path;

use glam::DVec3;

use super::DatasetError;

/// Longest header read; real ones are below 2 kB.
const MAX_HEADER_BYTES: usize = 1 << 16;

/// How the numbers are written.
#[derive(Clone, Copy, PartialEq)]
enum PlyEncoding {
    Ascii,
    Little,
    Big,
}

/// A scalar type.
#[derive(Clone, Copy)]
struct Scalar {
    n_bytes: usize,
    /// Floating point, or a whole number that is skipped.
    is_float: bool,
}

/// The vertices as the header describes them.
struct PlyLayout {
    encoding: PlyEncoding,
    n_vertices: usize,
    properties: Vec<Scalar>,
    /// Which properties are x, y and z.
    xyz: [usize; 3],
}

/// Reads the coordinates of all vertices.
///
/// # Errors
/// [`DatasetError::Read`], or [`DatasetError::Ply`] with what was found.
pub(super) fn read_points(path: &Path) -> Result<Vec<DVec3>, DatasetError> {
    let bytes = std::fs::read(path).map_err(|source| DatasetError::Read { path: path.to_owned(), source })?;
    parse(&bytes).map_err(|found| DatasetError::of_points(path, found))
}

/// Reads the coordinates of all vertices of a file; the error says what was found.
pub(super) fn parse(bytes: &[u8]) -> Result<Vec<DVec3>, String> {
    let (header, body) = split_header(bytes)?;
    let layout = read_layout(header)?;
    match layout.encoding {
        PlyEncoding::Ascii => ascii_points(&layout, body),
        _ => binary_points(&layout, body),
    }
}

/// The header's text, and the bytes after the line `end_header`.
fn split_header(bytes: &[u8]) -> Result<(&str, &[u8]), String> {
    const END: &[u8] = b"end_header";
    if !bytes.starts_with(b"ply") {
        return Err("does not start with `ply`".to_owned());
    }
    let head = &bytes[..bytes.len().min(MAX_HEADER_BYTES)];
    let end = head.windows(END.len()).position(|window| window == END).ok_or("its header has no `end_header`")?;
    let line_end =
        head[end..].iter().position(|&byte| byte == b'\n').ok_or("its header does not end in a line break")?;
    let header = std::str::from_utf8(&head[..end]).map_err(|_| "its header is not text")?;
    Ok((header, &bytes[end + line_end + 1..]))
}

fn read_layout(header: &str) -> Result<PlyLayout, String> {
    let mut encoding = None;
    let mut n_vertices = None;
    let (mut names, mut properties) = (Vec::new(), Vec::new());
    for line in header.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            ["format", "ascii", _] => encoding = Some(PlyEncoding::Ascii),
            ["format", "binary_little_endian", _] => encoding = Some(PlyEncoding::Little),
            ["format", "binary_big_endian", _] => encoding = Some(PlyEncoding::Big),
            ["format", other, ..] => return Err(format!("has the unknown format `{other}`")),
            ["element", "vertex", count] => {
                n_vertices = Some(count.parse::<usize>().map_err(|_| format!("has `{count}` vertices"))?);
            }
            // What follows the vertices is not read.
            ["element", ..] if n_vertices.is_some() => break,
            ["element", other, ..] => return Err(format!("lists the element `{other}` before `vertex`")),
            ["property", "list", ..] => return Err("has a list among the properties of its vertices".to_owned()),
            ["property", kind, name] => {
                let n_bytes = match *kind {
                    "char" | "uchar" | "int8" | "uint8" => 1,
                    "short" | "ushort" | "int16" | "uint16" => 2,
                    "int" | "uint" | "int32" | "uint32" | "float" | "float32" => 4,
                    "double" | "float64" => 8,
                    _ => return Err(format!("has the property `{name}` of the unknown type `{kind}`")),
                };
                names.push(*name);
                properties
                    .push(Scalar { n_bytes, is_float: matches!(*kind, "float" | "float32" | "double" | "float64") });
            }
            _ => {}
        }
    }
    let encoding = encoding.ok_or("names no format")?;
    let n_vertices = n_vertices.ok_or("has no element `vertex`")?;
    let index = |axis: &str| {
        let at = names.iter().position(|name| *name == axis).filter(|&at| properties[at].is_float);
        at.ok_or_else(|| format!("has no floating-point property `{axis}`"))
    };
    let xyz = [index("x")?, index("y")?, index("z")?];
    Ok(PlyLayout { encoding, n_vertices, properties, xyz })
}

fn ascii_points(layout: &PlyLayout, body: &[u8]) -> Result<Vec<DVec3>, String> {
    let text = std::str::from_utf8(body).map_err(|_| "is not text although its format is `ascii`")?;
    let mut points = Vec::new();
    for line in text.lines().take(layout.n_vertices) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let number = |axis: usize| words.get(layout.xyz[axis]).and_then(|word| word.parse::<f64>().ok());
        let (Some(x), Some(y), Some(z)) = (number(0), number(1), number(2)) else {
            return Err(format!("has no three coordinates in vertex {}: `{line}`", points.len()));
        };
        points.push(DVec3::new(x, y, z));
    }
    if points.len() < layout.n_vertices {
        return Err(format!("holds {} vertices, its header promises {}", points.len(), layout.n_vertices));
    }
    Ok(points)
}

fn binary_points(layout: &PlyLayout, body: &[u8]) -> Result<Vec<DVec3>, String> {
    let n_bytes: usize = layout.properties.iter().map(|scalar| scalar.n_bytes).sum();
    let held = body.len() / n_bytes;
    // Before anything is reserved, so that a hostile count costs nothing.
    if held < layout.n_vertices {
        return Err(format!("holds {held} vertices, its header promises {}", layout.n_vertices));
    }
    let start = |property: usize| layout.properties[..property].iter().map(|scalar| scalar.n_bytes).sum::<usize>();
    let number = |vertex: &[u8], property: usize| {
        let bytes = &vertex[start(property)..][..layout.properties[property].n_bytes];
        let mut little = [0; 8];
        little[..bytes.len()].copy_from_slice(bytes);
        if layout.encoding == PlyEncoding::Big {
            little[..bytes.len()].reverse();
        }
        let [a, b, c, d, ..] = little;
        if bytes.len() == 4 { f64::from(f32::from_le_bytes([a, b, c, d])) } else { f64::from_le_bytes(little) }
    };
    let vertices = body.chunks_exact(n_bytes).take(layout.n_vertices);
    Ok(vertices.map(|vertex| DVec3::from_array(layout.xyz.map(|property| number(vertex, property)))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "element vertex 2\nproperty uchar red\nproperty float x\nproperty double y\nproperty float z\n\
                          element face 1\nproperty list uchar int vertex_index\nend_header\n";

    fn file(format: &str, body: &[u8]) -> Vec<u8> {
        [format!("ply\nformat {format} 1.0\ncomment of no interest\n{HEADER}").as_bytes(), body].concat()
    }

    fn binary(number: fn(f64, usize) -> Vec<u8>) -> Vec<u8> {
        let vertex = |x, y, z| [vec![9], number(x, 4), number(y, 8), number(z, 4)].concat();
        [vertex(1.5, -2.0, 0.25), vertex(3.0, 4.0, -5.0)].concat()
    }

    #[test]
    fn all_encodings_give_the_same_points() {
        let little = binary(|v, n| if n == 4 { (v as f32).to_le_bytes().to_vec() } else { v.to_le_bytes().to_vec() });
        let big = binary(|v, n| if n == 4 { (v as f32).to_be_bytes().to_vec() } else { v.to_be_bytes().to_vec() });
        let expected = Ok(vec![DVec3::new(1.5, -2.0, 0.25), DVec3::new(3.0, 4.0, -5.0)]);
        assert_eq!(parse(&file("ascii", b"9 1.5 -2 0.25\n9 3 4 -5e0\n3 0 1 1\n")), expected);
        assert_eq!(parse(&file("binary_little_endian", &little)), expected);
        assert_eq!(parse(&file("binary_big_endian", &big)), expected);
    }

    #[test]
    fn broken_files_say_what_is_wrong() {
        let found = |bytes: &[u8]| parse(bytes).expect_err("broken");
        assert_eq!(found(b"solid"), "does not start with `ply`");
        assert_eq!(found(b"ply\nformat ascii 1.0\n"), "its header has no `end_header`");
        assert_eq!(found(&file("ascii", b"9 1 2 3\n")), "holds 1 vertices, its header promises 2");
        assert_eq!(found(&file("binary_little_endian", &[0; 33])), "holds 1 vertices, its header promises 2");
        assert_eq!(found(&file("ascii", b"9 1 2\n")), "has no three coordinates in vertex 0: `9 1 2`");
        let huge = b"ply\nformat binary_little_endian 1.0\nelement vertex 18446744073709551615\nproperty float x\n\
                     property float y\nproperty float z\nend_header\n";
        assert_eq!(found(huge), "holds 0 vertices, its header promises 18446744073709551615");
        let flat = b"ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty int y\nend_header\n";
        assert_eq!(found(flat), "has no floating-point property `y`");
    }
}
