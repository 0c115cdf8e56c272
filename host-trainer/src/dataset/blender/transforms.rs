//! The transforms files of Blender captures.

use std::path::Path;

use serde::Deserialize;

use crate::dataset::DatasetError;

/// What a transforms file holds, as far as it is used.
#[derive(Deserialize)]
pub(super) struct Transforms {
    /// Horizontal field of view of all frames, radians.
    pub(super) camera_angle_x: f64,
    pub(super) frames: Vec<Frame>,
}

/// One photograph.
#[derive(Deserialize)]
pub(super) struct Frame {
    /// Relative to the capture, usually without extension.
    file_path: String,
    /// Camera to world, OpenGL axes; `null` stands for a number that is none.
    transform_matrix: Vec<Vec<Option<f64>>>,
}

impl Frame {
    /// The path as people write it.
    pub(super) fn name(&self) -> &str {
        self.file_path.trim_start_matches("./")
    }
    /// The matrix by rows; numbers that are none are NaN.
    pub(super) fn rows(&self) -> Vec<Vec<f64>> {
        self.transform_matrix.iter().map(|row| row.iter().map(|x| x.unwrap_or(f64::NAN)).collect()).collect()
    }
}

/// Reads a transforms file that need not be there.
///
/// # Errors
/// As [`read_transforms`].
pub(super) fn read_optional(folder: &Path, name: &str) -> Result<Option<Transforms>, DatasetError> {
    let path = folder.join(name);
    if path.exists() { read_transforms(&path).map(Some) } else { Ok(None) }
}

/// Reads and checks a transforms file.
///
/// # Errors
/// [`DatasetError::Read`], [`DatasetError::Transforms`] or [`DatasetError::FieldOfView`], naming the file.
pub(super) fn read_transforms(path: &Path) -> Result<Transforms, DatasetError> {
    let text = std::fs::read_to_string(path).map_err(|source| DatasetError::Read { path: path.to_owned(), source })?;
    let parsed = serde_json::from_str::<Transforms>(&text).or_else(|error| {
        // Python writes the bare words NaN and Infinity, which JSON lacks; read as null they cost one view, not all.
        // The first error is the one to tell: its column is right.
        serde_json::from_str(&null_non_finite(&text)).map_err(|_| error)
    });
    let transforms = parsed.map_err(|source| DatasetError::Transforms { path: path.to_owned(), source })?;
    let angle = transforms.camera_angle_x;
    if angle > 0.0 && angle < std::f64::consts::PI {
        Ok(transforms)
    } else {
        Err(DatasetError::FieldOfView { path: path.to_owned(), found: angle })
    }
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
