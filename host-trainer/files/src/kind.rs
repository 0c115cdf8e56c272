//! What a file is, told by its first bytes alone.

use std::fmt;
use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::Path;

/// What the first bytes of a file say that it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FileKind {
    /// No bytes.
    Empty,
    /// What Git leaves where Git LFS keeps the file.
    GitLfsPointer,
    /// A page of the web, as a failed download leaves.
    WebPage,
    /// A bundle of this product, `.psb`.
    Bundle,
    /// A picture: PNG.
    Png,
    /// A picture: JPEG.
    Jpeg,
    /// A picture: WebP.
    WebP,
    /// A picture: HEIC or HEIF, as telephones write.
    Heic,
    /// A picture: AVIF.
    Avif,
    /// A picture: TIFF, or raw pixels of a camera in it.
    Tiff,
    /// A picture: GIF.
    Gif,
    /// A picture: BMP.
    Bmp,
    /// A picture: JPEG XL.
    JpegXl,
    /// A camera's raw pixels, where the file is no TIFF.
    Raw,
    /// A film.
    Film,
    /// Points or Gaussians: PLY.
    Ply,
    /// gzip around something, as `.spz` of versions 1 to 3.
    Gzip,
    /// `.spz` without gzip: version 4, or a raw older one.
    RawSpz,
    /// glTF in binary, `.glb`.
    Glb,
    /// A zip archive, as `.sog`, or a packed capture.
    Zip,
    /// JSON.
    Json,
    /// XML.
    Xml,
}

/// As many bytes as decide; a web page may begin with comments.
const N_FIRST: usize = 1024;

impl FileKind {
    /// What the first bytes of a file say that it is; `None` where they say nothing.
    pub fn of(first: &[u8]) -> Option<Self> {
        let first = &first[..first.len().min(N_FIRST)];
        let is_at = |offset: usize, magic: &[u8]| first.get(offset..).is_some_and(|rest| rest.starts_with(magic));
        let magics: [(usize, &[u8], Self); 23] = [
            (0, b"version https://git-lfs.github.com/spec/", Self::GitLfsPointer),
            (0, b"\x89PSB\r\n\x1a\n", Self::Bundle),
            (0, b"\x89PNG\r\n\x1a\n", Self::Png),
            (0, b"\xff\xd8\xff", Self::Jpeg),
            (8, b"WEBP", Self::WebP),
            (0, b"II*\0", Self::Tiff),
            (0, b"MM\0*", Self::Tiff),
            (0, b"GIF8", Self::Gif),
            (0, b"\xff\x0a", Self::JpegXl),
            (0, b"\0\0\0\x0cJXL ", Self::JpegXl),
            // Fujifilm, Olympus, Panasonic; raw files of others begin as TIFF.
            (0, b"FUJIFILMCCD-", Self::Raw),
            (0, b"IIRO", Self::Raw),
            (0, b"IIRS", Self::Raw),
            (0, b"MMOR", Self::Raw),
            (0, b"IIU\0", Self::Raw),
            (0, b"\x1a\x45\xdf\xa3", Self::Film),
            (0, b"ply\n", Self::Ply),
            (0, b"ply\r", Self::Ply),
            (0, b"ply ", Self::Ply),
            (0, b"\x1f\x8b", Self::Gzip),
            (0, b"NGSP", Self::RawSpz),
            (0, b"glTF", Self::Glb),
            (0, b"PK\x03\x04", Self::Zip),
        ];
        if first.is_empty() {
            return Some(Self::Empty);
        }
        if is_at(4, b"ftyp") {
            return Some(Self::of_brand(first.get(8..12).unwrap_or_default()));
        }
        // Two letters are too few; the reserved bytes behind the length are 0.
        if is_at(0, b"BM") && is_at(6, &[0; 4]) {
            return Some(Self::Bmp);
        }
        let known = magics.iter().find(|(offset, magic, _)| is_at(*offset, magic)).map(|&(_, _, kind)| kind);
        known.or_else(|| Self::of_text(first))
    }

    /// What the file at `path` is, by its first bytes.
    ///
    /// # Errors
    /// What the system said.
    pub fn of_file(path: &Path) -> io::Result<Option<Self>> {
        Ok(Self::of(&first_bytes(path)?))
    }

    /// The bytes of the file at `path`; where the first ones say that nobody wants it, as a film of many gigabytes, these alone. What is
    /// no regular file, as a pipe, can be read once, and is read whole.
    ///
    /// # Errors
    /// What the system said.
    pub fn read(path: &Path, is_wanted: impl Fn(Option<Self>) -> bool) -> io::Result<Vec<u8>> {
        if path.is_file() {
            let first = first_bytes(path)?;
            if !is_wanted(Self::of(&first)) {
                return Ok(first);
            }
        }
        fs::read(path)
    }

    /// Of files whose first box is `ftyp`: ISO 14496-12, by the major brand.
    fn of_brand(brand: &[u8]) -> Self {
        match brand {
            b"heic" | b"heix" | b"hevc" | b"hevx" | b"heim" | b"heis" | b"mif1" | b"msf1" => Self::Heic,
            b"avif" | b"avis" => Self::Avif,
            b"crx " => Self::Raw,
            _ => Self::Film,
        }
    }

    fn of_text(first: &[u8]) -> Option<Self> {
        let text = first.strip_prefix(b"\xef\xbb\xbf").unwrap_or(first).trim_ascii_start();
        let begins = |word: &[u8]| text.len() >= word.len() && text[..word.len()].eq_ignore_ascii_case(word);
        let holds = |word: &[u8]| text.windows(word.len()).any(|part| part.eq_ignore_ascii_case(word));
        if begins(b"<!doctype html") || begins(b"<html") || begins(b"<head") || begins(b"<") && holds(b"<html") {
            Some(Self::WebPage)
        } else if begins(b"<") {
            Some(Self::Xml)
        } else if begins(b"{") || begins(b"[") {
            Some(Self::Json)
        } else {
            None
        }
    }

    /// Whether it is a picture, as photographs are.
    pub const fn is_picture(self) -> bool {
        matches!(self, Self::Png | Self::Jpeg | Self::WebP | Self::Heic | Self::Avif | Self::Tiff | Self::Gif)
    }

    /// What to do where another kind was needed, without the file's name; `None` where the caller knows best.
    pub const fn remedy(self) -> Option<&'static str> {
        match self {
            Self::Empty => Some("copy or download it again"),
            Self::GitLfsPointer => Some("run `git lfs pull` in its repository"),
            Self::WebPage => Some("the download failed: fetch the file itself again"),
            _ => None,
        }
    }
}

/// As many bytes as tell what a file is.
pub(crate) fn first_bytes(path: &Path) -> io::Result<Vec<u8>> {
    let mut first = Vec::with_capacity(N_FIRST);
    File::open(path)?.take(N_FIRST as u64).read_to_end(&mut first)?;
    Ok(first)
}

impl fmt::Display for FileKind {
    /// With its article: `a web page`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Empty => "an empty file",
            Self::GitLfsPointer => "a Git LFS pointer, not the file itself",
            Self::WebPage => "a web page",
            Self::Bundle => "a bundle (.psb)",
            Self::Png => "a PNG picture",
            Self::Jpeg => "a JPEG picture",
            Self::WebP => "a WebP picture",
            Self::Heic => "an HEIC picture",
            Self::Avif => "an AVIF picture",
            Self::Tiff => "a TIFF picture",
            Self::Gif => "a GIF picture",
            Self::Bmp => "a BMP picture",
            Self::JpegXl => "a JPEG XL picture",
            Self::Raw => "a raw photograph",
            Self::Film => "a film",
            Self::Ply => "a .ply file",
            Self::Gzip => "a gzip file, as .spz of versions 1 to 3 are",
            Self::RawSpz => "an .spz file without gzip",
            Self::Glb => "a binary glTF file (.glb)",
            Self::Zip => "a zip archive, as .sog is",
            Self::Json => "a JSON file",
            Self::Xml => "an XML file",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_bytes_say_what_a_file_is() {
        let cases: [(&[u8], Option<FileKind>); 22] = [
            (b"", Some(FileKind::Empty)),
            (b"version https://git-lfs.github.com/spec/v1\noid sha256:0", Some(FileKind::GitLfsPointer)),
            (b"\x89PSB\r\n\x1a\n\x04", Some(FileKind::Bundle)),
            (b"\x89PNG\r\n\x1a\n\0", Some(FileKind::Png)),
            (b"\xff\xd8\xff\xe0", Some(FileKind::Jpeg)),
            (b"RIFF\0\0\0\0WEBPVP8L", Some(FileKind::WebP)),
            (b"\0\0\0\x18ftypheic\0\0", Some(FileKind::Heic)),
            (b"\0\0\0\x18ftypisom\0\0", Some(FileKind::Film)),
            (b"ply\r\nformat", Some(FileKind::Ply)),
            (b"NGSP\x04\0\0\0", Some(FileKind::RawSpz)),
            (b" \n<!DOCTYPE html><title>", Some(FileKind::WebPage)),
            (b"<?xml version=\"1.0\"?>\n<html xmlns=", Some(FileKind::WebPage)),
            (b"<?xml version=\"1.0\"?>\n<document>", Some(FileKind::Xml)),
            (b"\xef\xbb\xbf{ \"frames\"", Some(FileKind::Json)),
            (b"\0\0\0\x18ftypcrx \0\0", Some(FileKind::Raw)),
            (b"IIRO\x08\0", Some(FileKind::Raw)),
            (b"\xff\x0a\0\0", Some(FileKind::JpegXl)),
            (b"BM\x36\x10\0\0\0\0\0\0\x36", Some(FileKind::Bmp)),
            (b"BM is no picture", None),
            (b"# Camera list", None),
            (b"plyometric", None),
            (b"\x89PNG", None),
        ];
        for (first, kind) in cases {
            assert_eq!(FileKind::of(first), kind, "{:?}", first.escape_ascii().to_string());
        }
    }

    #[test]
    fn long_files_are_told_by_their_beginning() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("a.spz");
        std::fs::write(&path, format!("<html>{}", " ".repeat(100_000))).expect("a file");
        assert_eq!(FileKind::of_file(&path).expect("a file"), Some(FileKind::WebPage));
        assert!(FileKind::of_file(folder.path()).is_err(), "a folder has no bytes");
    }
}
