//! Paths in messages and in commands that people copy.

use std::path::{Path, PathBuf};

/// A path as one word of a POSIX shell: in quotes where it holds what a shell would take apart or replace, by the numbers of its
/// bytes where it is no UTF-8, and never like an option.
pub fn shell_word(path: &Path) -> String {
    let Some(text) = path.to_str() else { return printed(path).unwrap_or_else(|| shown(path)) };
    let text = if text.starts_with('-') { format!("./{text}") } else { text.to_owned() };
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+,:=@%".contains(c) || cfg!(windows) && c == '\\';
    if !text.is_empty() && text.chars().all(is_plain) { text } else { format!("'{}'", text.replace('\'', "'\\''")) }
}

/// A path for people: as it is written, and the bytes of a name that is no UTF-8 as `\xe9`, so that the file can be found.
pub fn shown(path: &Path) -> String {
    let mut text = String::new();
    for chunk in path.as_os_str().as_encoded_bytes().utf8_chunks() {
        text += chunk.valid();
        text.extend(chunk.invalid().iter().map(|byte| format!("\\x{byte:02x}")));
    }
    text
}

/// A path beside another one, of its whole name and `ending`: what a command makes of a file or folder.
pub fn beside(path: &Path, ending: &str) -> PathBuf {
    // `.` has no name of its own.
    let named = if path.file_name().is_some() { Ok(path.to_owned()) } else { path.canonicalize() };
    let mut named = named.unwrap_or_else(|_| path.to_owned());
    let mut name = named.file_name().unwrap_or_default().to_owned();
    name.push(ending);
    named.set_file_name(name);
    named
}

/// A name for a file that somebody is told to make: `path`, or where it or its run's folder is there, NAME-2, NAME-3 and so on.
pub fn unused(path: &Path) -> PathBuf {
    let is_used = |path: &Path| path.exists() || path.with_extension("run").exists();
    if !is_used(path) {
        return path.to_owned();
    }
    let numbered = |number: u32| {
        let mut name = path.file_stem().unwrap_or_default().to_owned();
        name.push(format!("-{number}"));
        if let Some(extension) = path.extension() {
            name.push(".");
            name.push(extension);
        }
        path.with_file_name(name)
    };
    (2..=u32::MAX).map(numbered).find(|path| !is_used(path)).unwrap_or_else(|| path.to_owned())
}

/// Bytes that no text has, as `printf` of POSIX writes them.
#[cfg(unix)]
fn printed(path: &Path) -> Option<String> {
    use std::os::unix::ffi::OsStrExt as _;
    let bytes = path.as_os_str().as_bytes();
    let byte = |byte: &u8| match byte {
        b'%' => "%%".to_owned(),
        byte if byte.is_ascii_alphanumeric() || b"/._+,:=@ -".contains(byte) => char::from(*byte).to_string(),
        byte => format!("\\{byte:03o}"),
    };
    let start = if bytes.starts_with(b"-") { "./" } else { "" };
    Some(format!("\"$(printf '{start}{}')\"", bytes.iter().map(byte).collect::<String>()))
}

#[cfg(not(unix))]
fn printed(_: &Path) -> Option<String> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_is_told_to_make_what_is_there() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let at = |name: &str| folder.path().join(name);
        assert_eq!(unused(&at("scene.psb")), at("scene.psb"));
        std::fs::write(at("scene.psb"), "").expect("room");
        assert_eq!(unused(&at("scene.psb")), at("scene-2.psb"));
        std::fs::create_dir(at("scene-2.run")).expect("room");
        assert_eq!(unused(&at("scene.psb")), at("scene-3.psb"), "a run that has no bundle yet");
    }

    #[test]
    fn what_is_made_of_a_folder_stands_beside_it() {
        assert_eq!(beside(Path::new("trip.2026.11"), ".psb"), Path::new("trip.2026.11.psb"));
        assert_eq!(beside(Path::new("photos/cup/"), "-capture"), Path::new("photos/cup-capture"));
        assert!(beside(Path::new("."), "-capture").is_absolute());
    }

    #[test]
    fn a_path_is_one_word() {
        for (path, word) in [
            ("out/lamp.psb", "out/lamp.psb"),
            ("Übung-2.psb", "Übung-2.psb"),
            ("desk lamp.psb", "'desk lamp.psb'"),
            ("it's/$HOME", "'it'\\''s/$HOME'"),
            ("back\\slash", if cfg!(windows) { "back\\slash" } else { "'back\\slash'" }),
            ("-w", "./-w"),
            ("", "''"),
        ] {
            assert_eq!(shell_word(Path::new(path)), word);
            assert_eq!(shown(Path::new(path)), path);
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_shell_reads_the_path_that_was_meant() {
        use std::ffi::OsStr;
        use std::os::unix::ffi::OsStrExt as _;
        let names: [&[u8]; 5] = [b"a\xffb 'c' %d\\n.psb", b"-\xfe", b"it's $HOME", b"two\nlines", b"\xc3\x28/\"x\""];
        for name in names {
            let word = shell_word(Path::new(OsStr::from_bytes(name)));
            let echo = std::process::Command::new("sh").arg("-c").arg(format!("printf %s {word}")).output();
            let read = echo.expect("a shell").stdout;
            assert_eq!(read.strip_prefix(b"./").unwrap_or(&read), name, "{word}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_name_that_is_no_utf_8_can_be_found() {
        use std::os::unix::ffi::OsStrExt as _;
        let path = Path::new(std::ffi::OsStr::from_bytes(b"it's caf\xe9/\xfc.jpg"));
        assert_eq!(shown(path), "it's caf\\xe9/\\xfc.jpg");
    }
}
