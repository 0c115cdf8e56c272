//! Points of .ply files: coordinates and colours of the element `vertex`.

use std::path::Path;

use glam::DVec3;
use pocketsplat_files::ply::{Encoding, Fault, Header, Scalar, check_line_endings, split, vertices};

use super::DatasetError;
use super::points::{Points, rgb8};

/// Reads coordinates and colours of all vertices.
///
/// # Errors
/// [`DatasetError::Read`], or [`DatasetError::Ply`] with what was found.
pub(super) fn read_points(path: &Path) -> Result<Points, DatasetError> {
    let bytes = std::fs::read(path).map_err(|source| DatasetError::of_reading(path, source))?;
    parse(&bytes).map_err(|found| DatasetError::of_points(path, found))
}

/// Reads coordinates and colours of all vertices of a file; the error says what was found.
pub(super) fn parse(bytes: &[u8]) -> Result<Points, String> {
    let (head, body) = split(bytes).map_err(|fault| fault.to_string())?;
    let text = String::from_utf8_lossy(head);
    let points = Header::parse(&text).and_then(|header| {
        if header.encoding != Encoding::Ascii {
            check_line_endings(&header, head, body)?;
        }
        let (xyz, rgb) = (columns(&header)?, colour_columns(&header));
        let mut points = Vec::new();
        let push = |row: &[f64]| {
            let of = |columns: [usize; 3]| columns.map(|column| row[column]);
            points.push((DVec3::from_array(of(xyz)), rgb.and_then(|rgb| rgb8(&of(rgb)))));
        };
        vertices(&header, header.skip_to_vertices(body)?, push)?;
        Ok(points.into_iter().collect())
    });
    points.map_err(|fault| fault.to_string())
}

/// Which properties are x, y and z.
fn columns(header: &Header<'_>) -> Result<[usize; 3], Fault> {
    let properties = &header.vertex().properties;
    let index = |axis: &str| {
        let is_float = |scalar| matches!(scalar, Some(Scalar::F32 | Scalar::F64));
        let at = properties.iter().position(|property| property.name == axis && is_float(property.scalar));
        at.ok_or_else(|| {
            Fault::new(format!("has no property `{axis}` of its vertices that is float or double, needed: x, y and z"))
        })
    };
    Ok([index("x")?, index("y")?, index("z")?])
}

/// Which properties are the colour, where it is one of bytes.
fn colour_columns(header: &Header<'_>) -> Option<[usize; 3]> {
    let properties = &header.vertex().properties;
    let index = |name: &str| {
        properties.iter().position(|property| property.name == name && matches!(property.scalar, Some(Scalar::U8)))
    };
    Some([index("red")?, index("green")?, index("blue")?])
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
        let at = vec![DVec3::new(1.5, -2.0, 0.25), DVec3::new(3.0, 4.0, -5.0)];
        // A red alone is no colour.
        let expected = Ok(Points { at, rgb: Vec::new() });
        assert_eq!(parse(&file("ascii", b"9 1.5 -2 0.25\n9 3 4 -5e0\n3 0 1 1\n")), expected);
        assert_eq!(parse(&file("binary_little_endian", &little)), expected);
        assert_eq!(parse(&file("binary_big_endian", &big)), expected);
    }

    #[test]
    fn colours_of_bytes_are_read() {
        let file = |scalar: &str, colours: [&str; 2]| {
            let [a, b] = colours;
            format!(
                "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n\
                 property {scalar} blue\nproperty {scalar} red\nproperty {scalar} green\nend_header\n1 2 3 {a}\n4 5 6 {b}\n"
            )
        };
        let rgb = |text: String| parse(text.as_bytes()).expect("points").rgb;
        assert_eq!(rgb(file("uchar", ["3 1 2", "0 255 7"])), [[1, 2, 3], [255, 7, 0]]);
        assert!(rgb(file("float", ["0.5 0.5 0.5", "0 0 1"])).is_empty(), "of unknown range");
    }

    #[test]
    fn broken_files_say_what_is_wrong() {
        let found = |bytes: &[u8]| parse(bytes).expect_err("broken");
        assert!(found(b"solid").contains("does not start with `ply`"));
        assert!(found(b"ply\nformat ascii 1.0\n").contains("has no line `end_header`"));
        assert!(found(&file("ascii", b"9 1 2 3\n")).contains("holds 1 of the 2 vertices"));
        assert!(found(&file("binary_little_endian", &[0; 33])).contains("holds 1 of the 2 vertices"));
        assert!(found(&file("ascii", b"9 1 2\n")).contains("has 3 numbers in vertex 0, its header lists 4 properties"));
        let huge = b"ply\nformat binary_little_endian 1.0\nelement vertex 18446744073709551615\nproperty float x\n\
                     property float y\nproperty float z\nend_header\n";
        assert!(found(huge).contains("holds 0 of the 18446744073709551615 vertices"));
        let flat = b"ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty int y\nend_header\n";
        assert_eq!(found(flat), "has no property `y` of its vertices that is float or double, needed: x, y and z");
        let lists = b"ply\nformat ascii 1.0\nelement vertex 1\nproperty list uchar float y\nproperty float x\nproperty float z\n\
                      property double y\nend_header\n";
        assert!(found(lists).contains("`y`"), "{}", found(lists));
    }
}
