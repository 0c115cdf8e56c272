//! Paths in messages and in commands that people copy.

use std::path::Path;

/// A path as one word of a shell: in quotes where it holds what a shell would take apart or replace.
///
/// A name that is no UTF-8 becomes `$'caf\xe9'`, which bash, zsh and ksh turn back into its bytes.
pub fn shell_word(path: &Path) -> String {
    let Some(text) = path.to_str() else {
        return format!("$'{}'", escaped(path, |c| matches!(c, '\'' | '\\')));
    };
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+,:=@%".contains(c) || cfg!(windows) && c == '\\';
    if !text.is_empty() && text.chars().all(is_plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

/// A path for people: as it is written, and the bytes of a name that is no UTF-8 as `\xe9`, so that the file can be found.
pub fn shown(path: &Path) -> String {
    path.to_str().map_or_else(|| escaped(path, |_| false), str::to_owned)
}

/// The path with `\` before some characters, and what is no UTF-8 in hexadecimal.
fn escaped(path: &Path, needs_escape: impl Fn(char) -> bool) -> String {
    let mut text = String::new();
    for chunk in path.as_os_str().as_encoded_bytes().utf8_chunks() {
        for c in chunk.valid().chars() {
            if needs_escape(c) {
                text.push('\\');
            }
            text.push(c);
        }
        text.extend(chunk.invalid().iter().map(|byte| format!("\\x{byte:02x}")));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_one_word() {
        for (path, word) in [
            ("out/lamp.psb", "out/lamp.psb"),
            ("Übung-2.psb", "Übung-2.psb"),
            ("desk lamp.psb", "'desk lamp.psb'"),
            ("it's/$HOME", "'it'\\''s/$HOME'"),
            ("back\\slash", if cfg!(windows) { "back\\slash" } else { "'back\\slash'" }),
            ("", "''"),
        ] {
            assert_eq!(shell_word(Path::new(path)), word);
            assert_eq!(shown(Path::new(path)), path);
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_name_that_is_no_utf_8_can_be_found() {
        use std::os::unix::ffi::OsStrExt as _;
        let path = Path::new(std::ffi::OsStr::from_bytes(b"it's caf\xe9/\xfc.jpg"));
        assert_eq!(shell_word(path), "$'it\\'s caf\\xe9/\\xfc.jpg'");
        assert_eq!(shown(path), "it's caf\\xe9/\\xfc.jpg");
    }
}
