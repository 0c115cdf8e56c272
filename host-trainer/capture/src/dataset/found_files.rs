//! What finding files by other names than they were written under may get wrong: one file for two names, and a choice among several.

use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

use super::ViewFault;
use super::error::first_few;
use super::folder_names::{FolderNames, Likeness, as_text};
use super::image_file::stem_of;
use super::image_names::is_image_name;
use super::listing::{ListedView, Note};
use super::named_path::NamedPath;

/// Takes out the views whose file, or mask, is another name's as well, and says what was chosen among several files.
///
/// A file that is found under less than its whole name (a folder is missing, or the case is another) is the photograph of one name at
/// most; the name that fits wholly keeps it.
pub(super) fn check(views: &mut [ListedView], names: &FolderNames) -> Vec<Note> {
    let of_two_names = shared(views, |view| view.shot.as_ref().ok().map(|shot| shot.path.clone()));
    for (i, path, other) in of_two_names {
        views[i].shot = Err(ViewFault::SharedFile { path, other, written: views[i].written.clone() });
    }
    let mut notes: Vec<Note> = shared_masks(views).into_iter().collect();
    notes.extend(other_endings(views, names));
    notes.extend(other_spellings(views));
    notes
}

/// Views whose file is also another name's and whose own name it does not fit wholly: which, the file, and the other name.
fn shared(views: &[ListedView], file: impl Fn(&ListedView) -> Option<PathBuf>) -> Vec<(usize, PathBuf, String)> {
    let mut by_file: BTreeMap<PathBuf, Vec<usize>> = BTreeMap::new();
    for (i, view) in views.iter().enumerate() {
        if let Some(path) = file(view) {
            // A link and what it leads to are one file.
            by_file.entry(path.canonicalize().unwrap_or(path)).or_default().push(i);
        }
    }
    let mut found = Vec::new();
    for sharing in by_file.into_values().filter(|sharing| sharing.len() > 1) {
        for &i in &sharing {
            let other = sharing.iter().find(|&&j| !are_one_photograph(&views[i].written, &views[j].written));
            if let (Some(&other), Some(path)) = (other, file(&views[i]))
                && !fits_wholly(&path, &views[i].written)
            {
                found.push((i, path, views[other].written.clone()));
            }
        }
    }
    found
}

/// Whether two names mean one photograph: they are the same, but for an ending of another format.
fn are_one_photograph(a: &str, b: &str) -> bool {
    let (a, b) = (NamedPath::new(a).key(), NamedPath::new(b).key());
    a == b || (stem_of(&a) == stem_of(&b) && Likeness::of(&a, &b).is_none())
}

/// Whether a file lies where all parts of a name say, whatever its ending.
fn fits_wholly(path: &Path, written: &str) -> bool {
    let key = NamedPath::new(written).key();
    let mut there = path.components().rev().map(|part| as_text(part.as_os_str()));
    let is_last = |found: &str, part: &str| bare(found) == bare(part);
    key.rsplit('/')
        .enumerate()
        .all(|(i, part)| there.next().is_some_and(|found| if i == 0 { is_last(&found, part) } else { found == part }))
}

/// A file's name without its ending, or both of them, as in `a.jpg.png`.
fn bare(name: &str) -> &str {
    stem_of(stem_of(name))
}

fn shared_masks(views: &mut [ListedView]) -> Option<Note> {
    let mask = |view: &ListedView| Some(view.shot.as_ref().ok()?.masks.first()?.path.clone());
    let is_of_name = |path: &Path, written: &str| {
        let key = NamedPath::new(written).key();
        path.file_name().is_some_and(|name| bare(&as_text(name)) == bare(key.rsplit('/').next().unwrap_or_default()))
    };
    let mut on_purpose: Vec<(PathBuf, String)> = Vec::new();
    for (i, path, other) in shared(views, mask) {
        if is_of_name(&path, &views[i].written) {
            let message = format!("is also that of `{other}`, and one mask is not of two photographs");
            views[i].shot = Err(ViewFault::Mask { path, message });
        } else {
            on_purpose.push((path, views[i].name.clone()));
        }
    }
    let (path, _) = on_purpose.first()?;
    let of_files: HashSet<&PathBuf> = on_purpose.iter().map(|(path, _)| path).collect();
    let views: Vec<&String> = on_purpose.iter().map(|(_, name)| name).collect();
    let text = format!(
        "masks that several photographs name: {}, as `{}`, by {} photographs ({}); give each its own, unless what they hide \
         stands still in the image",
        of_files.len(),
        pocketsplat_files::shown(path),
        views.len(),
        first_few(&views, ", ")
    );
    Some(Note::warning("shared-mask", text))
}

/// Says which photographs have files of the same name but another ending beside them.
fn other_endings(views: &[ListedView], names: &FolderNames) -> Option<Note> {
    let sound = || views.iter().filter_map(|view| Some((view, view.shot.as_ref().ok()?)));
    let used: HashSet<&PathBuf> =
        sound().flat_map(|(_, shot)| shot.masks.iter().map(|mask| &mask.path).chain([&shot.path])).collect();
    let mut told = Vec::new();
    for (_, shot) in sound() {
        let (Some(folder), Some(name)) = (shot.path.parent(), shot.path.file_name().map(as_text)) else { continue };
        let stem = stem_of(&name);
        let beside = names.with_stem(folder, stem).into_iter().filter(|entry| {
            let is_of_stem = Likeness::of(stem_of(&entry.text), stem).is_some();
            is_of_stem && is_image_name(&entry.text) && !used.contains(&folder.join(&entry.name))
        });
        let beside: Vec<String> = beside.map(|entry| format!("`{}`", entry.text)).collect();
        if !beside.is_empty() {
            told.push(format!("`{name}` is read, not {}", beside.join(" or ")));
        }
    }
    (!told.is_empty()).then(|| {
        let text = format!(
            "photographs beside which another file has their name with another ending: {} ({})",
            told.len(),
            first_few(&told, ", ")
        );
        Note::new("several-endings", text)
    })
}

/// Says which names are spelt otherwise than their files.
fn other_spellings(views: &[ListedView]) -> Option<Note> {
    let spelt = |view: &ListedView| {
        let found = as_text(view.shot.as_ref().ok()?.path.file_name()?);
        let key = NamedPath::new(&view.written).key();
        let written = key.rsplit('/').next()?;
        let differs =
            Likeness::of(stem_of(written), stem_of(&found)).filter(|likeness| *likeness != Likeness::Exact)?;
        Some((differs, written.to_owned()))
    };
    let spelt: Vec<(Likeness, String)> = views.iter().filter_map(spelt).collect();
    let worst = spelt.iter().map(|(likeness, _)| *likeness).max()?;
    let what =
        if worst == Likeness::Form { "the form of Unicode" } else { "upper and lower case or the form of Unicode" };
    let names: Vec<&String> = spelt.iter().map(|(_, name)| name).collect();
    let text = format!(
        "names that differ from those of their files in {what}: {} ({}); they were found all the same",
        names.len(),
        first_few(&names, ", ")
    );
    Some(Note::new("other-spelling", text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_one_photograph_differ_in_the_format_alone() {
        for (a, b, expected) in [
            ("left/000.jpg", "right/000.jpg", false),
            ("images/a.png", "./images/a.png", true),
            ("images/a.png", "images/a.jpg", true),
            ("a.jpg", "a.JPG", false),
            ("A.jpg", "a.jpg", false),
            ("a", "a.png", true),
        ] {
            assert_eq!(are_one_photograph(a, b), expected, "{a} and {b}");
        }
    }

    #[test]
    fn a_file_fits_a_name_of_which_all_parts_agree() {
        for (path, written, expected) in [
            ("/c/images/left/000.jpg", "left/000.jpg", true),
            ("/c/images/000.jpg", "left/000.jpg", false),
            ("/c/images/000.webp", "000.jpg", true),
            ("/c/masks/left/000.jpg.png", "left/000.jpg", true),
            ("/c/images/000.jpg", "/home/ann/left/000.jpg", false),
            ("/c/images/img.jpg", "IMG.jpg", false),
        ] {
            assert_eq!(fits_wholly(Path::new(path), written), expected, "{path} for {written}");
        }
    }
}
