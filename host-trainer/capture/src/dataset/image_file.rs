//! Which file holds the photograph of a name: converted captures have it under another ending, and other things beside it.
//!
//! The file of the name itself, first exactly, then but for the form of Unicode, then but for case. Where it is not there, or is of a
//! format that has to be converted, a picture of the same name with another ending; of several the one in colour, then the one whose
//! ending is nearest to the name's. A picture of one channel of 16 bit is never taken under another ending: depth maps are such.

use std::cmp::Reverse;
use std::path::{Path, PathBuf};

use pocketsplat_files::FileKind;

use super::folder_names::{Entry, FolderNames, Likeness, only_best};
use super::image::read_header;
use super::image_names::{PHOTOGRAPH_EXTENSIONS, extension, has_foreign_name, is_foreign, is_image_name};

/// Endings that photographs get, in the order in which they stand in for each other: a lossless file beside them is rather a map.
const OF_PHOTOGRAPHS: [&str; 4] = ["jpg", "jpeg", "webp", "png"];

/// The name without the ending of an image, where it has one.
pub(super) fn stem_of(name: &str) -> &str {
    let has_ending = is_image_name(name) || has_foreign_name(name);
    name.rsplit_once('.').filter(|_| has_ending).map_or(name, |(stem, _)| stem)
}

/// The photograph of this name in a folder.
pub(super) fn image_at(names: &FolderNames, folder: &Path, name: &str) -> Option<PathBuf> {
    // The usual case, without reading the folder.
    let exact = folder.join(name);
    let can_be_read = |path: &Path| path.is_file() && !needs_conversion(path);
    if can_be_read(&exact) {
        return Some(exact);
    }
    if let Some(path) = names.named(folder, name, can_be_read) {
        return Some(path);
    }
    let of_name = names.named(folder, name, Path::is_file);
    let other = with_other_ending(names, folder, name, worth);
    // The photograph before its conversion only where there is no other, for the message that it must be converted.
    other.or(of_name)
}

/// The mask of this name in a folder, whatever its depth: under another ending as well.
pub(super) fn mask_at(names: &FolderNames, folder: &Path, name: &str) -> Option<PathBuf> {
    names.named(folder, name, Path::is_file).or_else(|| with_other_ending(names, folder, name, |_| Some(0)))
}

/// Whether a picture is of a format that is not read, by its name or its bytes.
fn needs_conversion(path: &Path) -> bool {
    let has_foreign_name = path.file_name().is_some_and(|name| has_foreign_name(&name.to_string_lossy()));
    has_foreign_name || FileKind::of_file(path).ok().flatten().is_some_and(is_foreign)
}

/// A picture of the same name with another ending, of the highest worth.
fn with_other_ending(
    names: &FolderNames,
    folder: &Path,
    name: &str,
    worth: impl Fn(&Path) -> Option<u8>,
) -> Option<PathBuf> {
    let stem = stem_of(name);
    let entries = names.with_stem(folder, stem);
    let is_candidate = |entry: &Entry| is_image_name(&entry.text) && folder.join(&entry.name).is_file();
    let alike = entries.into_iter().filter(is_candidate).filter_map(|entry| {
        let likeness = Likeness::of(stem_of(&entry.text), stem)?;
        Some((likeness, folder.join(&entry.name), entry.text))
    });
    let ranked = alike.filter_map(|(likeness, path, text)| {
        Some(((Reverse(worth(&path)?), likeness, place_of_ending(name, &text)), path))
    });
    let mut ranked: Vec<_> = ranked.collect();
    ranked.sort();
    let best = ranked.first()?.0;
    // Of several that are as good only those of one spelling tell which is meant.
    let best: Vec<_> = ranked.into_iter().filter(|(rank, _)| *rank == best).map(|(_, path)| (best.1, path)).collect();
    only_best(best.into_iter())
}

/// How much a picture looks like a photograph; `None` for a depth map.
fn worth(path: &Path) -> Option<u8> {
    match read_header(path) {
        Ok(header) if header.is_depth_like => None,
        Ok(header) => Some(if header.is_grey { 1 } else { 2 }),
        // For its message.
        Err(_) => Some(0),
    }
}

/// How far an ending is from the one that was named.
fn place_of_ending(named: &str, found: &str) -> usize {
    let (named, found) = (extension(named), extension(found).unwrap_or_default());
    if named.as_ref() == Some(&found) {
        return 0;
    }
    // A name without ending, as Blender's, means a PNG.
    let is_photograph = named.is_some_and(|named| named != "png");
    let order = if is_photograph { OF_PHOTOGRAPHS } else { PHOTOGRAPH_EXTENSIONS };
    1 + order.iter().position(|ending| *ending == found).unwrap_or(order.len())
}

#[cfg(test)]
mod tests {
    use image::{ExtendedColorType, save_buffer};

    use super::*;

    const HEIC: &[u8] = b"\0\0\0\x18ftypheic\0\0\0\0";

    /// What is found of `name` beside files of these names: of `d…` a depth map, of `g…` a grey picture, else one in colour.
    fn found(name: &str, files: &[(&str, &str)]) -> Option<String> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for (file, kind) in files {
            let path = folder.path().join(file);
            match *kind {
                "heic" => std::fs::write(&path, HEIC).expect("a file"),
                "depth" => save_buffer(&path, &[7; 8], 2, 2, ExtendedColorType::L16).expect("an image"),
                "grey" => save_buffer(&path, &[7; 4], 2, 2, ExtendedColorType::L8).expect("an image"),
                _ => save_buffer(&path, &[7; 12], 2, 2, ExtendedColorType::Rgb8).expect("an image"),
            }
        }
        let path = image_at(&FolderNames::default(), folder.path(), name)?;
        Some(path.file_name().expect("a name").to_string_lossy().into_owned())
    }

    #[test]
    fn a_photograph_is_never_taken_for_its_depth_map() {
        let both = [("f.png", "depth"), ("f.webp", "colour")];
        for name in ["f.jpg", "f.JPG", "f.jpeg", "f", "f.heic"] {
            assert_eq!(found(name, &both).as_deref(), Some("f.webp"), "{name}");
            assert_eq!(found(name, &both[..1]), None, "{name}");
        }
        assert_eq!(found("f.png", &both).as_deref(), Some("f.png"), "as it is named");
        assert_eq!(found("f.jpg", &[("f.png", "grey"), ("f.webp", "colour")]).as_deref(), Some("f.webp"));
        assert_eq!(found("f.jpg", &[("f.png", "grey")]).as_deref(), Some("f.png"), "converted");
        assert_eq!(found("f.jpg", &[("f.png", "colour"), ("f.webp", "colour")]).as_deref(), Some("f.webp"));
        assert_eq!(found("f", &[("f.png", "colour"), ("f.webp", "colour")]).as_deref(), Some("f.png"));
    }

    #[test]
    fn the_file_that_can_be_read_is_taken() {
        assert_eq!(found("i.JPG", &[("i.JPG", "heic"), ("i.jpeg", "colour")]).as_deref(), Some("i.jpeg"));
        assert_eq!(found("i.JPG", &[("i.JPG", "heic"), ("i.png", "depth")]).as_deref(), Some("i.JPG"));
        assert_eq!(found("i.heic", &[("i.heic", "heic"), ("I.JPG", "colour")]).as_deref(), Some("I.JPG"));
        assert_eq!(found("i.heic", &[("i.heic", "heic")]).as_deref(), Some("i.heic"));
    }
}
