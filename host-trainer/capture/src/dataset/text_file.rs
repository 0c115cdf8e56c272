//! Text files as editors of any system leave them.

use std::io::{Error, ErrorKind, Result};
use std::path::Path;

/// Reads a file of UTF-8, or of UTF-16 where a byte order mark says so, without the mark.
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
        [0xEF, 0xBB, 0xBF, text @ ..] => String::from_utf8(text.to_vec()).ok(),
        [0xFF, 0xFE, ..] => utf16(u16::from_le_bytes),
        [0xFE, 0xFF, ..] => utf16(u16::from_be_bytes),
        _ => String::from_utf8(bytes.clone()).ok(),
    };
    text.ok_or_else(|| Error::new(ErrorKind::InvalidData, "it is no text: neither UTF-8 nor UTF-16 with a mark"))
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
        assert_eq!(read(b"\xE9"), Err(ErrorKind::InvalidData));
        assert_eq!(read(b""), Ok(String::new()));
    }
}
