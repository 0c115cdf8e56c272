//! The header of a .ply file: elements and their properties.

use super::Fault;

/// Longest header read; real ones are below 4 kB.
const MAX_HEADER_BYTES: usize = 1 << 16;

/// How the numbers are written.
#[derive(Clone, Copy, PartialEq)]
pub enum Encoding {
    /// Text.
    Ascii,
    /// Binary, least byte first.
    Little,
    /// Binary, greatest byte first.
    Big,
}

/// The type of a number.
#[derive(Clone, Copy, PartialEq)]
pub enum Scalar {
    /// `char`.
    I8,
    /// `uchar`.
    U8,
    /// `short`.
    I16,
    /// `ushort`.
    U16,
    /// `int`.
    I32,
    /// `uint`.
    U32,
    /// `float`.
    F32,
    /// `double`.
    F64,
}

impl Scalar {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of one in a binary file.
    pub const fn n_bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// One property of an element.
pub struct Property<'a> {
    /// As the header has it.
    pub name: &'a str,
    /// `None` for a list, whose length stands in the data.
    pub scalar: Option<Scalar>,
}

/// One element.
pub struct Element<'a> {
    /// As the header has it.
    pub name: &'a str,
    /// Rows.
    pub count: usize,
    /// In the order of a row.
    pub properties: Vec<Property<'a>>,
}

impl Element<'_> {
    /// Bytes of one row in a binary file; `None` where a list makes them differ.
    pub fn n_bytes(&self) -> Option<usize> {
        self.properties.iter().map(|property| property.scalar.map(Scalar::n_bytes)).sum()
    }
}

/// A header.
pub struct Header<'a> {
    /// How the rows are written.
    pub encoding: Encoding,
    /// Lines `comment`, without the word.
    pub comments: Vec<&'a str>,
    /// In the order of their rows.
    pub elements: Vec<Element<'a>>,
    /// Which element is `vertex`.
    vertex: usize,
}

impl<'a> Header<'a> {
    /// * `text`: of the header, as [`split`] finds it.
    ///
    /// # Errors
    /// [`Fault`] with the line that means nothing, or what is missing.
    pub fn parse(text: &'a str) -> Result<Self, Fault> {
        let (mut encoding, mut comments, mut elements) = (None, Vec::new(), Vec::<Element<'a>>::new());
        for line in text.lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            match words.as_slice() {
                ["format", "ascii", ..] => encoding = Some(Encoding::Ascii),
                ["format", "binary_little_endian", ..] => encoding = Some(Encoding::Little),
                ["format", "binary_big_endian", ..] => encoding = Some(Encoding::Big),
                ["comment", ..] => comments.push(line.trim_start().trim_start_matches("comment").trim()),
                ["element", name, count] => {
                    let count = count.parse().map_err(|_| {
                        Fault::new(format!("has a header with `{line}`, whose count is no whole number"))
                    })?;
                    elements.push(Element { name, count, properties: Vec::new() });
                }
                ["property", kind, .., name] => {
                    let scalar = Scalar::named(kind);
                    if scalar.is_none() && *kind != "list" {
                        return Err(Fault::new(format!("has a header with `{line}`, whose type is unknown")));
                    }
                    let element = elements
                        .last_mut()
                        .ok_or_else(|| Fault::new(format!("has a header with `{line}` before the first element")))?;
                    element.properties.push(Property { name, scalar });
                }
                ["ply" | "obj_info", ..] | [] => {}
                _ => return Err(Fault::new(format!("has a header with the unknown line `{line}`"))),
            }
        }
        let encoding = encoding.ok_or_else(|| Fault::new("has a header without a line `format`"))?;
        let vertex = elements.iter().position(|element| element.name == "vertex");
        let vertex = vertex.ok_or_else(|| Fault::new("has a header without an element `vertex`"))?;
        Ok(Self { encoding, comments, elements, vertex })
    }

    /// The element whose rows are vertices.
    pub fn vertex(&self) -> &Element<'a> {
        &self.elements[self.vertex]
    }

    /// The elements that do not.
    pub fn others(&self) -> impl Iterator<Item = &Element<'a>> {
        self.elements.iter().enumerate().filter(|(index, _)| *index != self.vertex).map(|(_, element)| element)
    }

    /// Bytes that a binary file's elements take; `None` where a list leaves that to the rows.
    pub fn n_bytes(&self) -> Option<usize> {
        self.elements
            .iter()
            .try_fold(0usize, |sum, element| sum.checked_add(element.n_bytes()?.checked_mul(element.count)?))
    }

    /// The bytes from the first vertex on.
    ///
    /// # Errors
    /// [`Fault`] where the elements before it are cut off or have lists.
    pub fn skip_to_vertices<'b>(&self, body: &'b [u8]) -> Result<&'b [u8], Fault> {
        self.skip(self.vertex, body)
    }

    /// The element `name` and the bytes from its first row on; `None` where there is no such element.
    ///
    /// # Errors
    /// As [`Self::skip_to_vertices`].
    pub fn element<'b>(&self, name: &str, body: &'b [u8]) -> Result<Option<(&Element<'a>, &'b [u8])>, Fault> {
        match self.elements.iter().position(|element| element.name == name) {
            Some(index) => Ok(Some((&self.elements[index], self.skip(index, body)?))),
            None => Ok(None),
        }
    }

    /// The bytes after the first `n_elements` elements.
    fn skip<'b>(&self, n_elements: usize, body: &'b [u8]) -> Result<&'b [u8], Fault> {
        let mut body = body;
        for element in &self.elements[..n_elements] {
            let cut = || {
                Fault::new(format!(
                    "is cut off within its {} rows of the element `{}`; copy it again from where it was made",
                    element.count, element.name
                ))
            };
            if self.encoding == Encoding::Ascii {
                for _ in 0..element.count {
                    let end = body.iter().position(|&byte| byte == b'\n').ok_or_else(cut)?;
                    body = &body[end + 1..];
                }
            } else {
                let row = element.n_bytes().ok_or_else(|| {
                    Fault::new(format!("has lists in the element `{}`, which comes before its vertices", element.name))
                })?;
                let skipped =
                    row.checked_mul(element.count).filter(|&skipped| skipped <= body.len()).ok_or_else(cut)?;
                body = &body[skipped..];
            }
        }
        Ok(body)
    }
}

/// The bytes of the header's text, and those after the line `end_header`.
///
/// # Errors
/// [`Fault`] for what is no .ply file, or is cut off within its header.
pub fn split(bytes: &[u8]) -> Result<(&[u8], &[u8]), Fault> {
    const END: &[u8] = b"\nend_header";
    if !bytes.starts_with(b"ply") {
        return Err(Fault::new("is no .ply file: it does not start with `ply`"));
    }
    let head = &bytes[..bytes.len().min(MAX_HEADER_BYTES)];
    let end = head.windows(END.len()).position(|window| window == END).ok_or_else(|| {
        Fault::new(format!("has no line `end_header` in its first {MAX_HEADER_BYTES} bytes; it may be cut off"))
    })?;
    let after = end + END.len();
    let line_end = head[after..]
        .iter()
        .position(|&byte| byte == b'\n')
        .ok_or_else(|| Fault::new("is cut off in the line `end_header`"))?;
    Ok((&head[..end], &bytes[after + line_end + 1..]))
}
