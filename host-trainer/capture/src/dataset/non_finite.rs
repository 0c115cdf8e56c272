//! JSON with the bare words `NaN` and `Infinity`, which Python writes and JSON lacks.

use std::path::Path;

use serde::de::DeserializeOwned;

use super::{DatasetError, text_file};

/// Reads a file of another program's export.
///
/// * `what`: what the file should be; `needs`: what it has to hold.
///
/// # Errors
/// Those of [`text_file::read`], and [`DatasetError::Json`].
pub(super) fn read_export<T: DeserializeOwned>(
    path: &Path,
    what: &'static str,
    needs: &'static str,
) -> Result<T, DatasetError> {
    let text = text_file::read(path)?;
    read(&text, |text| serde_json::from_str(text)).map_err(|source| DatasetError::of_json(path, what, needs, source))
}

/// Reads JSON; where that fails, the same with `null` in place of such words, so that they cost one view, not all.
///
/// # Errors
/// The first one, whose column is right.
pub(super) fn read<T>(text: &str, parse: impl Fn(&str) -> serde_json::Result<T>) -> serde_json::Result<T> {
    parse(text).or_else(|error| parse(&null_non_finite(text)).map_err(|_| error))
}

/// Replaces the bare words `NaN`, `Infinity` and `-Infinity` outside strings by `null`.
fn null_non_finite(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut inside_string = false;
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let word = ["NaN", "-Infinity", "Infinity"].into_iter().find(|word| !inside_string && rest.starts_with(word));
        let taken = match word {
            Some(word) => {
                out.push_str("null");
                word.len()
            }
            None => {
                // A backslash takes the next character with it, so that \" does not end the string.
                let escaped = if c == '\\' { rest[1..].chars().next().map_or(0, char::len_utf8) } else { 0 };
                inside_string ^= c == '"';
                out.push_str(&rest[..c.len_utf8() + escaped]);
                c.len_utf8() + escaped
            }
        };
        rest = &rest[taken..];
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_bare_words_become_null() {
        let text = r#"{"a \" NaN": [NaN, -Infinity, Infinity], "é\\": NaN}"#;
        assert_eq!(null_non_finite(text), r#"{"a \" NaN": [null, null, null], "é\\": null}"#);
    }
}
