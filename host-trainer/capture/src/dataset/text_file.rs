//! Text files as editors of any system leave them.

use std::path::Path;

use super::DatasetError;

/// Reads a file of UTF-8, or of UTF-16 where a byte order mark says so, without the mark. A line that is no UTF-8 is read a byte a
/// letter (Latin-1), as programs on Windows write `é`.
///
/// # Errors
/// [`DatasetError::Read`], and where the bytes are no such text [`DatasetError::NotText`] or [`DatasetError::OtherKind`].
pub(super) fn read(path: &Path) -> Result<String, DatasetError> {
    let bytes = std::fs::read(path).map_err(|source| DatasetError::of_reading(path, source))?;
    text_of(&bytes).ok_or_else(|| DatasetError::of_no_text(path))
}

/// `None` where the bytes are no text.
fn text_of(bytes: &[u8]) -> Option<String> {
    let utf16 = |from: fn([u8; 2]) -> u16| {
        let units = bytes[2..].chunks_exact(2).map(|pair| from([pair[0], pair[1]]));
        char::decode_utf16(units).collect::<Result<String, _>>().ok()
    };
    match bytes {
        [0xEF, 0xBB, 0xBF, text @ ..] => eight_bit(text),
        [0xFF, 0xFE, ..] => utf16(u16::from_le_bytes),
        [0xFE, 0xFF, ..] => utf16(u16::from_be_bytes),
        text => eight_bit(text),
    }
}

/// Text of a byte or more a letter; `None` where bytes are none.
fn eight_bit(bytes: &[u8]) -> Option<String> {
    if let Ok(text) = std::str::from_utf8(bytes) {
        return Some(text.to_owned());
    }
    // What no text holds, and most binary files do.
    if bytes.iter().any(|byte| byte.is_ascii_control() && !byte.is_ascii_whitespace()) {
        return None;
    }
    let line = |line: &[u8]| match std::str::from_utf8(line) {
        Ok(line) => line.to_owned(),
        Err(_) => line.iter().map(|&byte| char::from(byte)).collect(),
    };
    Some(bytes.split_inclusive(|byte| *byte == b'\n').map(line).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_taken_off_and_decide() {
        assert_eq!(text_of("{é}".as_bytes()).as_deref(), Some("{é}"));
        assert_eq!(text_of(b"\xEF\xBB\xBF{}").as_deref(), Some("{}"));
        assert_eq!(text_of(b"\xFF\xFE{\0}\0").as_deref(), Some("{}"));
        assert_eq!(text_of(b"\xFE\xFF\0{\0}").as_deref(), Some("{}"));
        assert_eq!(text_of(&["é\n".as_bytes(), b"\xE9"].concat()).as_deref(), Some("é\né"));
        assert_eq!(text_of(b"\xE9\0"), None);
        assert_eq!(text_of(b"").as_deref(), Some(""));
    }
}
