//! Which files are images: those that are read, by their names, and those that have to be converted first.

use std::path::Path;

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

/// The format of the image file `path` where it is known but not read.
pub(super) fn foreign_format(path: &Path) -> Option<&'static str> {
    let mut head = [0; 12];
    std::io::Read::read_exact(&mut std::fs::File::open(path).ok()?, &mut head).ok()?;
    match &head {
        // ISO 14496-12: the size of the first box, its type, then the brand of the file.
        [_, _, _, _, b'f', b't', b'y', b'p', brand @ ..] => match brand {
            b"avif" | b"avis" => Some("AVIF"),
            b"heic" | b"heix" | b"hevc" | b"mif1" | b"msf1" => Some("HEIC"),
            b"crx " => Some("raw"),
            _ => None,
        },
        // Fujifilm, Olympus, Panasonic; raw files of others begin as TIFF.
        b"FUJIFILMCCD-"
        | [b'I', b'I', b'R', b'O' | b'S', ..]
        | [b'M', b'M', b'O', b'R', ..]
        | [b'I', b'I', b'U', 0, ..] => Some("raw"),
        [b'I', b'I', 42, 0, ..] | [b'M', b'M', 0, 42, ..] => Some("TIFF or raw"),
        [b'G', b'I', b'F', b'8', ..] => Some("GIF"),
        [b'B', b'M', ..] => Some("BMP"),
        [0xFF, 0x0A, ..] | [0, 0, 0, 12, b'J', b'X', b'L', b' ', ..] => Some("JPEG XL"),
        _ => None,
    }
}

/// The command that converts all images in `folder` that have the extension of `name`.
pub(super) fn conversion(folder: &Path, name: &str) -> String {
    let extension = name.rsplit_once('.').map_or("*", |(_, extension)| extension);
    format!("magick mogrify -format jpg -quality 95 '{}/*.{extension}'", folder.display())
}
