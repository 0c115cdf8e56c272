//! Which files are photographs and films, by their names: photographs that are read, and those that have to be converted first.

use std::path::Path;

use pocketsplat_files::{FileKind, shell_word};

/// Folders that photographs without poses are kept in, in the order in which they are looked into; `.` is the one that is given.
pub const PHOTOGRAPH_FOLDERS: [&str; 5] = ["images", "input", "rgb", "photos", "."];
/// Extensions of the photographs that are read, in the order in which they are tried.
pub const PHOTOGRAPH_EXTENSIONS: [&str; 4] = ["png", "jpg", "jpeg", "webp"];
/// Extensions of photographs as telephones write them, which `pocketsplat poses` converts.
pub const TELEPHONE_EXTENSIONS: [&str; 3] = ["heic", "heif", "avif"];
/// Extensions of films.
pub const FILM_EXTENSIONS: [&str; 5] = ["mp4", "mov", "mkv", "avi", "webm"];
/// Extensions of the other images that have to be converted, the second line those of cameras' raw files.
const FOREIGN_EXTENSIONS: [&str; 13] = [
    "tif", "tiff", "bmp", "gif", "jxl", //
    "dng", "cr2", "cr3", "nef", "arw", "raf", "orf", "rw2",
];

/// The extension of a name, in lower case.
pub(super) fn extension(name: &str) -> Option<String> {
    name.rsplit_once('.').map(|(_, extension)| extension.to_ascii_lowercase())
}

/// Whether a name has one of these extensions, whatever its case.
pub(super) fn has_extension(name: &str, extensions: &[&str]) -> bool {
    extension(name).is_some_and(|extension| extensions.contains(&extension.as_str()))
}

/// Whether a file of this name can be a photograph.
pub(super) fn is_image_name(name: &str) -> bool {
    has_extension(name, &PHOTOGRAPH_EXTENSIONS)
}

/// Whether a file of this name is an image that has to be converted; a photograph converted from it keeps its name but for the extension.
pub(super) fn has_foreign_name(name: &str) -> bool {
    has_extension(name, &TELEPHONE_EXTENSIONS) || has_extension(name, &FOREIGN_EXTENSIONS)
}

/// Whether a file of this kind is a picture that has to be converted.
pub(super) fn is_foreign(kind: FileKind) -> bool {
    foreign_name(kind).is_some()
}

/// What such a picture is called.
pub(super) fn foreign_name(kind: FileKind) -> Option<&'static str> {
    match kind {
        FileKind::Avif => Some("AVIF"),
        FileKind::Heic => Some("HEIC"),
        FileKind::Raw => Some("raw"),
        FileKind::Tiff => Some("TIFF or raw"),
        FileKind::Gif => Some("GIF"),
        FileKind::Bmp => Some("BMP"),
        FileKind::JpegXl => Some("JPEG XL"),
        _ => None,
    }
}

/// The command that converts all images in `folder` that have the extension of `name`.
pub(super) fn conversion(folder: &Path, name: &str) -> String {
    let extension = name.rsplit_once('.').map_or("*", |(_, extension)| extension);
    // In quotes: ImageMagick takes the star itself, however many files there are.
    format!("magick mogrify -format jpg -quality 95 {}", shell_word(&folder.join(format!("*.{extension}"))))
}
