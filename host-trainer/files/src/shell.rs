//! Paths in commands that people copy.

use std::path::Path;

/// A path as one word of a shell: in quotes where it holds what a shell would take apart or replace.
pub fn shell_word(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+,:=@%".contains(c) || cfg!(windows) && c == '\\';
    if !text.is_empty() && text.chars().all(is_plain) { text } else { format!("'{}'", text.replace('\'', "'\\''")) }
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
        }
    }
}
