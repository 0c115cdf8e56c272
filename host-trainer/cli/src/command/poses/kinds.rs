//! Which files are photographs and films, and what becomes of each.

use std::fs;
use std::path::{Path, PathBuf};

use pocketsplat_capture::dataset::{FILM_EXTENSIONS, PHOTOGRAPH_EXTENSIONS, PHOTOGRAPH_FOLDERS, TELEPHONE_EXTENSIONS};
use pocketsplat_files::{FileKind, shown};

use crate::say::say;

/// What becomes of a photograph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Treatment {
    /// It is copied, and turned upright where its metadata ask for it.
    Copied,
    /// It is converted by a program of libheif.
    Heif,
    /// It is converted by that, or by `ffmpeg`.
    Avif,
}

/// What a file is, of those that can be given.
pub(super) enum Kind {
    Film,
    Photograph(Treatment),
    /// A picture that has to be converted by hand.
    Foreign,
}

/// In lower case.
pub(super) fn extension(name: &str) -> String {
    name.rsplit_once('.').map_or_else(String::new, |(_, extension)| extension.to_ascii_lowercase())
}

/// A name without its extension.
pub(super) fn stem(name: &str) -> &str {
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}

fn is_called_photograph(path: &Path) -> bool {
    let extension = extension(&path.to_string_lossy());
    PHOTOGRAPH_EXTENSIONS.into_iter().chain(TELEPHONE_EXTENSIONS).any(|name| name == extension)
}

/// By its first bytes; by its name where these say nothing.
pub(super) fn kind_of(path: &Path) -> Option<Kind> {
    let is_film = FILM_EXTENSIONS.contains(&extension(&path.file_name()?.to_string_lossy()).as_str());
    match FileKind::of_file(path).ok().flatten() {
        Some(FileKind::Png | FileKind::Jpeg | FileKind::WebP) => Some(Kind::Photograph(Treatment::Copied)),
        Some(FileKind::Heic) => Some(Kind::Photograph(Treatment::Heif)),
        Some(FileKind::Avif) => Some(Kind::Photograph(Treatment::Avif)),
        Some(FileKind::Tiff | FileKind::Gif | FileKind::Bmp | FileKind::JpegXl | FileKind::Raw) => Some(Kind::Foreign),
        Some(FileKind::Film) => Some(Kind::Film),
        None if is_film => Some(Kind::Film),
        _ => None,
    }
}

/// Whether it is a link to nothing.
fn is_broken(path: &Path) -> bool {
    path.is_symlink() && !path.exists()
}

/// The files of a folder that are not hidden, sorted.
fn files_of(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let is_shown = |path: &PathBuf| path.file_name().is_some_and(|name| !name.as_encoded_bytes().starts_with(b"."));
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.path())
        .filter(|path| is_shown(path) && (path.is_file() || is_broken(path)))
        .collect();
    files.sort_unstable();
    files
}

/// The folders in a folder that hold photographs, and how many.
pub(super) fn with_photographs_below(folder: &Path) -> Vec<(PathBuf, usize)> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut folders: Vec<PathBuf> = entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
    folders.sort_unstable();
    let is_photograph = |path: &PathBuf| matches!(kind_of(path), Some(Kind::Photograph(_)));
    let n_of = |folder: &Path| files_of(folder).iter().filter(|path| is_photograph(path)).count();
    let counted = folders.into_iter().map(|folder| {
        let n = n_of(&folder);
        (folder, n)
    });
    counted.filter(|(_, n)| *n > 0).collect()
}

/// The films of a folder.
pub(super) fn films_in(folder: &Path) -> Vec<PathBuf> {
    files_of(folder).into_iter().filter(|file| matches!(kind_of(file), Some(Kind::Film))).collect()
}

/// The photographs of a folder, or of the first folder in it that has some; and the pictures there that are of other formats. Says which
/// files are called photographs and are none.
pub(super) fn photographs_in(folder: &Path) -> (Vec<(PathBuf, Treatment)>, Vec<PathBuf>) {
    for name in PHOTOGRAPH_FOLDERS {
        let folder = if name == "." { folder.to_owned() } else { folder.join(name) };
        let (mut photographs, mut foreign, mut damaged) = (Vec::new(), Vec::new(), Vec::new());
        for path in files_of(&folder) {
            match kind_of(&path) {
                Some(Kind::Photograph(treatment)) => photographs.push((path, treatment)),
                Some(Kind::Foreign) => foreign.push(path),
                None if is_called_photograph(&path) => damaged.push(shown(&path)),
                _ => {}
            }
        }
        if let Some(first) = damaged.first() {
            say!(
                "warning: {} of the files called photographs cannot be read as such, the first `{first}`: left out; copy them anew, or run \
                 `git lfs pull` where they are pointers of Git LFS",
                damaged.len()
            );
        }
        if !(photographs.is_empty() && foreign.is_empty()) {
            for (below, n) in with_photographs_below(&folder) {
                say!(
                    "note: {n} photographs in `{}` are not taken; give that folder too, if they are of this scene",
                    shown(&below)
                );
            }
            return (photographs, foreign);
        }
    }
    (Vec::new(), Vec::new())
}
