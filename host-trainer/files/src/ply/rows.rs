//! The rows of the element `vertex`.

use super::Fault;
use super::header::{Encoding, Header, Scalar};

/// Calls `each` with the numbers of every vertex, in the order of its properties.
///
/// * `body`: the bytes from the first vertex on, as [`Header::skip_to_vertices`] finds them. A whole number is a float too; `nan` is NaN
///   however it is written. Memory follows the bytes that are there, never the header's count.
///
/// # Errors
/// [`Fault`] for a list among the properties, for no properties, for rows that are cut off or no numbers.
pub fn vertices(header: &Header<'_>, body: &[u8], each: impl FnMut(&[f64])) -> Result<(), Fault> {
    let properties = &header.vertex().properties;
    if let Some(list) = properties.iter().find(|property| property.scalar.is_none()) {
        return Err(Fault::new(format!("has a list, `{}`, among the properties of its vertices", list.name)));
    }
    match header.encoding {
        _ if properties.is_empty() => Err(Fault::new("has vertices without properties")),
        Encoding::Ascii => of_text(header, body, each),
        encoding => of_bytes(header, body, encoding == Encoding::Big, each),
    }
}

fn of_text(header: &Header<'_>, body: &[u8], mut each: impl FnMut(&[f64])) -> Result<(), Fault> {
    let (n_properties, count) = (header.vertex().properties.len(), header.vertex().count);
    let mut row = Vec::with_capacity(n_properties);
    let mut lines = body.split(|&byte| byte == b'\n');
    for index in 0..count {
        let line = lines.next().filter(|line| !line.is_empty()).ok_or_else(|| cut_off(index, count, "vertices"))?;
        let text = std::str::from_utf8(line)
            .map_err(|_| Fault::new(format!("is not text in vertex {index} although its format is `ascii`")))?;
        row.clear();
        for word in text.split_whitespace() {
            row.push(
                number(word).ok_or_else(|| {
                    Fault::new(format!("has `{}` for a number in vertex {index}", word.escape_debug()))
                })?,
            );
        }
        if row.len() != n_properties {
            return Err(Fault::new(format!(
                "has {} numbers in vertex {index}, its header lists {n_properties} properties",
                row.len()
            )));
        }
        each(&row);
    }
    Ok(())
}

fn of_bytes(header: &Header<'_>, body: &[u8], is_big: bool, mut each: impl FnMut(&[f64])) -> Result<(), Fault> {
    let scalars: Vec<Scalar> = header.vertex().properties.iter().filter_map(|property| property.scalar).collect();
    let n_bytes: usize = scalars.iter().map(|scalar| scalar.n_bytes()).sum();
    let (held, count) = (body.len() / n_bytes, header.vertex().count);
    if held < count {
        return Err(cut_off(held, count, "vertices"));
    }
    let mut row = Vec::with_capacity(scalars.len());
    for vertex in body.chunks_exact(n_bytes).take(count) {
        row.clear();
        let mut rest = vertex;
        for &scalar in &scalars {
            let (bytes, after) = rest.split_at(scalar.n_bytes());
            row.push(value(scalar, bytes, is_big));
            rest = after;
        }
        each(&row);
    }
    Ok(())
}

/// A number as programs write it, `-nan(ind)` of Microsoft's library included.
fn number(word: &str) -> Option<f64> {
    let is_nan = || word.trim_start_matches(['+', '-']).get(..3).is_some_and(|start| start.eq_ignore_ascii_case("nan"));
    word.parse().ok().or_else(|| is_nan().then_some(f64::NAN))
}

/// The fault of a file with fewer rows than it promises.
///
/// * `rows`: what they are, as `vertices`.
pub fn cut_off(held: usize, count: usize, rows: &str) -> Fault {
    Fault::new(format!(
        "is cut off: it holds {held} of the {count} {rows} that its header promises; copy it again from where it was made"
    ))
}

fn value(scalar: Scalar, bytes: &[u8], is_big: bool) -> f64 {
    let mut little = [0; 8];
    little[..bytes.len()].copy_from_slice(bytes);
    if is_big {
        little[..bytes.len()].reverse();
    }
    let [a, b, c, d, ..] = little;
    match scalar {
        Scalar::I8 => i8::from_le_bytes([a]).into(),
        Scalar::U8 => a.into(),
        Scalar::I16 => i16::from_le_bytes([a, b]).into(),
        Scalar::U16 => u16::from_le_bytes([a, b]).into(),
        Scalar::I32 => i32::from_le_bytes([a, b, c, d]).into(),
        Scalar::U32 => u32::from_le_bytes([a, b, c, d]).into(),
        Scalar::F32 => f32::from_le_bytes([a, b, c, d]).into(),
        Scalar::F64 => f64::from_le_bytes(little),
    }
}
