//! Where the bytes of a file went.

/// A share of a file's bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// What it holds.
    pub name: String,
    /// How many.
    pub bytes: usize,
}

/// Where the bytes of a file went.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Account {
    /// The format, with its version or encoding.
    pub format: String,
    /// What packs all parts at once, so that their bytes are those before packing; `None` where they are the file's own.
    pub packed_by: Option<&'static str>,
    /// By attribute.
    pub parts: Vec<Part>,
}

impl Account {
    pub(crate) fn new(format: String, packed_by: Option<&'static str>, parts: &[(&str, usize)]) -> Self {
        let part = |&(name, bytes): &(&str, usize)| Part { name: name.to_owned(), bytes };
        Self { format, packed_by, parts: parts.iter().filter(|(_, bytes)| *bytes > 0).map(part).collect() }
    }
}
