//! Which files are images: those that are read, by their names, and those that have to be converted first.

use std::path::Path;

use pocketsplat_files::{FileKind, shell_word};

/// Extensions of the image files that are read, in the order in which they are tried.
pub(super) const EXTENSIONS: [&str; 4] = ["png", "jpg", "jpeg", "webp"];

/// Whether a file of this name can be a photograph.
pub(super) fn is_image_name(name: &str) -> bool {
    has_extension(name, &EXTENSIONS)
}

fn has_extension(name: &str, extensions: &[&str]) -> bool {
    let extension = name.rsplit_once('.').map(|(_, extension)| extension.to_ascii_lowercase());
    extension.is_some_and(|extension| extensions.contains(&extension.as_str()))
}

/// Extensions of such images, the second line those of cameras' raw files; a photograph converted from one keeps its name but for that.
const FOREIGN_EXTENSIONS: [&str; 16] = [
    "heic", "heif", "avif", "tif", "tiff", "bmp", "gif", "jxl", //
    "dng", "cr2", "cr3", "nef", "arw", "raf", "orf", "rw2",
];

/// Whether a file of this name is an image that has to be converted.
pub(super) fn has_foreign_name(name: &str) -> bool {
    has_extension(name, &FOREIGN_EXTENSIONS)
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
