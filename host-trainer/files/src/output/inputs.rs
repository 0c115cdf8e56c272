//! What a command reads, which none of its outputs may replace.

use std::fs;
use std::path::{Path, PathBuf};

use super::place::is_same_file;

/// Names that are looked at in the folders of a command: a capture has thousands, a home that is called one has millions.
const MOST_NAMES: usize = 200_000;

/// Files, and folders with all that is in them.
#[derive(Clone, Debug, Default)]
pub(super) struct Inputs {
    pub(super) files: Vec<PathBuf>,
    pub(super) folders: Vec<PathBuf>,
}

impl Inputs {
    /// The input that `file` is, by whatever name or link.
    ///
    /// * `is_ours`: whether it is no part of a folder of photographs by its content.
    pub(super) fn find(&self, file: &Path, is_ours: bool) -> Option<PathBuf> {
        let named = self.files.iter().find(|input| is_same_file(file, input)).cloned();
        named.or_else(|| if is_ours { None } else { self.in_folders(file) })
    }

    fn in_folders(&self, file: &Path) -> Option<PathBuf> {
        let mut folders = self.folders.clone();
        let mut seen = Vec::new();
        let mut n_names = 0;
        while let Some(folder) = folders.pop() {
            // Links may lead in a circle.
            let Ok(own) = fs::canonicalize(&folder) else { continue };
            if seen.contains(&own) {
                continue;
            }
            seen.push(own);
            for entry in fs::read_dir(&folder).into_iter().flatten().flatten() {
                n_names += 1;
                if n_names > MOST_NAMES {
                    return None;
                }
                let path = entry.path();
                if path.is_dir() {
                    folders.push(path);
                } else if is_same_file(&path, file) {
                    return Some(path);
                }
            }
        }
        None
    }
}
