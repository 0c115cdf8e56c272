//! Lines of offset, bytes and meaning.

use std::fmt::{Display, Write};

use pocketsplat_format::bundle::ALIGNMENT;

/// Bytes on a line of the dump.
const LINE_BYTES: usize = 8;

/// Walks over the file and writes a line for every few bytes.
pub(super) struct Dump<'f> {
    bytes: &'f [u8],
    position: usize,
    array_lines: usize,
    text: String,
}

impl<'f> Dump<'f> {
    /// Starts at the first byte; arrays take `array_lines` lines at most.
    pub(super) fn new(bytes: &'f [u8], array_lines: usize) -> Self {
        Self { bytes, position: 0, array_lines, text: String::new() }
    }

    pub(super) fn into_text(self) -> String {
        self.text
    }

    /// Offset of the next byte.
    pub(super) fn position(&self) -> usize {
        self.position
    }

    /// How many of `n` items that take a line each are shown.
    pub(super) fn n_shown(&self, n: usize) -> usize {
        n.min(self.array_lines)
    }

    pub(super) fn heading(&mut self, title: &str) {
        let rule = if self.position == 0 { "" } else { "\n" };
        // Writing to a string never fails.
        let _ = writeln!(self.text, "{rule}{:06x}  -- {title}", self.position);
    }

    /// A line without bytes.
    pub(super) fn remark(&mut self, text: &str) {
        let _ = writeln!(self.text, "{:33}{text}", "");
    }

    /// The bytes up to where a section or a chunk may begin.
    pub(super) fn padding(&mut self) {
        let n = self.position.next_multiple_of(ALIGNMENT as usize) - self.position;
        self.array("padding", n, u8::from_le_bytes);
    }

    /// Leaves `n_bytes` out and says so.
    pub(super) fn skip(&mut self, n_bytes: usize, what: &str) {
        if n_bytes > 0 {
            let _ = writeln!(self.text, "{:06x}  … {n_bytes} more bytes: {what}", self.position);
            self.position += n_bytes;
        }
    }

    /// The next `N` bytes, one field.
    pub(super) fn field<const N: usize, T: Display>(&mut self, name: &str, meaning: impl Fn([u8; N]) -> T) {
        let bytes: [u8; N] = std::array::from_fn(|i| self.bytes.get(self.position + i).copied().unwrap_or_default());
        self.line(N, &format!("{name}: {}", meaning(bytes)));
    }

    /// The next four bytes, a checksum.
    pub(super) fn crc(&mut self, name: &str) {
        self.field(name, |bytes| format!("{:#010x}", u32::from_le_bytes(bytes)));
    }

    /// The next `n` fields of `N` bytes, several to a line.
    pub(super) fn array<const N: usize, T: Display>(&mut self, name: &str, n: usize, meaning: impl Fn([u8; N]) -> T) {
        let per_line = LINE_BYTES / N;
        for (line, first) in (0..n).step_by(per_line).enumerate() {
            if line == self.array_lines {
                self.skip((n - first) * N, name);
                return;
            }
            let n_here = per_line.min(n - first);
            let items = self.bytes[self.position..self.position + n_here * N].as_chunks::<N>().0;
            let values: Vec<String> = items.iter().map(|&item| meaning(item).to_string()).collect();
            self.line(n_here * N, &format!("{name}[{first}..{}]: {}", first + n_here, values.join(" ")));
        }
    }

    fn line(&mut self, n_bytes: usize, meaning: &str) {
        let end = self.position + n_bytes;
        let mut meaning = Some(meaning);
        for bytes in self.bytes[self.position..end].chunks(LINE_BYTES) {
            let hex: Vec<String> = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
            let line = format!("{:06x}  {:23}  {}", self.position, hex.join(" "), meaning.take().unwrap_or_default());
            let _ = writeln!(self.text, "{}", line.trim_end());
            self.position += bytes.len();
        }
    }
}
