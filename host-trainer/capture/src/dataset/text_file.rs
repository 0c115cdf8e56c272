//! Text files as editors of any system leave them.

use std::io::{Error, ErrorKind, Result};
use std::path::Path;

/// Reads a file of UTF-8, or of UTF-16 where a byte order mark says so, without the mark. A line that is no UTF-8 is read a byte a
/// letter (Latin-1), as programs on Windows write `é`.
///
/// # Errors
/// Those of the system, and [`ErrorKind::InvalidData`] where the bytes are no such text.
pub(super) fn read(path: &Path) -> Result<String> {
    let bytes = std::fs::read(path)?;
    let utf16 = |from: fn([u8; 2]) -> u16| {
        let units = bytes[2..].chunks_exact(2).map(|pair| from([pair[0], pair[1]]));
        char::decode_utf16(units).collect::<std::result::Result<String, _>>().ok()
    };
    let text = match bytes.as_slice() {
        [0xEF, 0xBB, 0xBF, text @ ..] => eight_bit(text),
        [0xFF, 0xFE, ..] => utf16(u16::from_le_bytes),
        [0xFE, 0xFF, ..] => utf16(u16::from_be_bytes),
        text => eight_bit(text),
    };
    text.ok_or_else(|| Error::new(ErrorKind::InvalidData, "it is no text: neither UTF-8 nor UTF-16 with a mark"))
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
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("text");
        let read = |bytes: &[u8]| {
            std::fs::write(&path, bytes).expect("a file");
            read(&path).map_err(|error| error.kind())
        };
        assert_eq!(read("{é}".as_bytes()), Ok("{é}".to_owned()));
        assert_eq!(read(b"\xEF\xBB\xBF{}"), Ok("{}".to_owned()));
        assert_eq!(read(b"\xFF\xFE{\0}\0"), Ok("{}".to_owned()));
        assert_eq!(read(b"\xFE\xFF\0{\0}"), Ok("{}".to_owned()));
        assert_eq!(
            read("é\n".as_bytes().iter().chain(b"\xE9").copied().collect::<Vec<_>>().as_slice()),
            Ok("é\né".to_owned())
        );
        assert_eq!(read(b"\xE9\0"), Err(ErrorKind::InvalidData));
        assert_eq!(read(b""), Ok(String::new()));
    }
}
