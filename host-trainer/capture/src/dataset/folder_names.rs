//! The names of the files in a folder, as they can be compared: exactly, in Unicode's form NFC, and without case.
//!
//! A model and the disk may spell one name in two ways: macOS leaves names decomposed (`a` and `¨` for `ä`), Windows and macOS know
//! no case, and old archives have a byte a letter.

use std::collections::HashMap;
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use unicode_normalization::UnicodeNormalization;

/// How the name of a file agrees with the one that was looked for; the best compares smallest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Likeness {
    /// Byte by byte.
    Exact,
    /// As text, in whichever form of Unicode.
    Form,
    /// But for upper and lower case.
    Case,
}

impl Likeness {
    /// How two names agree; `None` where they are two names.
    pub(super) fn of(a: &str, b: &str) -> Option<Self> {
        if a == b {
            Some(Self::Exact)
        } else if a.nfc().eq(b.nfc()) {
            Some(Self::Form)
        } else {
            (folded(a) == folded(b)).then_some(Self::Case)
        }
    }
}

/// A name as it is compared without case: in form NFC and lower case.
pub(super) fn folded(name: &str) -> String {
    name.nfc().flat_map(char::to_lowercase).nfc().collect()
}

/// A name as text: UTF-8, or where it is not, a byte a letter as old systems write `é`.
pub(super) fn as_text(name: &OsStr) -> String {
    match name.to_str() {
        Some(name) => name.to_owned(),
        None => name.as_encoded_bytes().iter().map(|&byte| char::from(byte)).collect(),
    }
}

/// An entry of a folder.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    /// As [`as_text`] gives it.
    pub(super) text: String,
    /// As the system has it.
    pub(super) name: OsString,
}

/// The entries of a folder by [`stem`]: a name and the same with another ending stand together.
type ByStem = HashMap<String, Vec<Entry>>;

/// The names in folders that were asked for, each read once.
#[derive(Default)]
pub(super) struct FolderNames {
    read: Mutex<HashMap<PathBuf, Arc<ByStem>>>,
}

/// A name without its ending, folded.
fn stem(name: &str) -> String {
    folded(name.rsplit_once('.').map_or(name, |(stem, _)| if stem.is_empty() { name } else { stem }))
}

impl FolderNames {
    /// The entries of a folder whose names are `stem` and an ending, but for form and case, sorted; none where it cannot be read.
    pub(super) fn with_stem(&self, folder: &Path, stem: &str) -> Vec<Entry> {
        let known = self.read.lock().unwrap_or_else(PoisonError::into_inner).get(folder).cloned();
        let by_stem = known.unwrap_or_else(|| {
            let by_stem = Arc::new(read(folder));
            self.read.lock().unwrap_or_else(PoisonError::into_inner).insert(folder.to_owned(), by_stem.clone());
            by_stem
        });
        by_stem.get(&folded(stem)).cloned().unwrap_or_default()
    }

    /// The folder at `path`, or the one that it is but for form and case.
    pub(super) fn folder(&self, path: &Path) -> Option<PathBuf> {
        if path.is_dir() {
            return Some(path.to_owned());
        }
        let (name, above) = (as_text(path.file_name()?), self.folder(path.parent()?)?);
        self.named(&above, &name, Path::is_dir)
    }

    /// The one entry of a folder of this name, exactly, else but for form, else but for case; it must be as asked for.
    pub(super) fn named(&self, folder: &Path, name: &str, is_wanted: impl Fn(&Path) -> bool) -> Option<PathBuf> {
        let alike = self.with_stem(folder, &stem(name)).into_iter().filter_map(|entry| {
            let path = folder.join(&entry.name);
            Likeness::of(&entry.text, name).filter(|_| is_wanted(&path)).map(|likeness| (likeness, path))
        });
        only_best(alike)
    }
}

fn read(folder: &Path) -> ByStem {
    let mut by_stem = ByStem::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let text = as_text(&name);
        by_stem.entry(stem(&text)).or_default().push(Entry { text, name });
    }
    by_stem.values_mut().for_each(|entries| entries.sort_by(|a, b| a.name.cmp(&b.name)));
    by_stem
}

/// The item of the best likeness; `None` where several are as good and it is not exact.
pub(super) fn only_best<T>(alike: impl Iterator<Item = (Likeness, T)>) -> Option<T> {
    let mut alike: Vec<(Likeness, T)> = alike.collect();
    alike.sort_by_key(|(likeness, _)| *likeness);
    let is_only = alike.len() < 2 || alike[0].0 < alike[1].0;
    alike.into_iter().next().filter(|_| is_only).map(|(_, item)| item)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_alike_exactly_then_in_form_then_without_case() {
        for (a, b, likeness) in [
            ("a.jpg", "a.jpg", Some(Likeness::Exact)),
            ("Ba\u{308}r.jpg", "Bär.jpg", Some(Likeness::Form)),
            ("BÄR.JPG", "ba\u{308}r.jpg", Some(Likeness::Case)),
            ("\u{212B}.jpg", "å.jpg", Some(Likeness::Case)),
            ("a.jpg", "a.jpeg", None),
            ("", "a", None),
        ] {
            assert_eq!(Likeness::of(a, b), likeness, "{a} and {b}");
        }
    }

    #[test]
    fn two_names_that_are_alike_are_none() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for name in ["One.txt", "two.txt", "TWO.txt"] {
            std::fs::write(folder.path().join(name), "").expect("a file");
        }
        std::fs::create_dir(folder.path().join("Left")).expect("a folder");
        let names = FolderNames::default();
        let found = |name: &str| names.named(folder.path(), name, Path::is_file);
        assert_eq!(found("one.txt"), Some(folder.path().join("One.txt")));
        assert_eq!(found("two.txt"), Some(folder.path().join("two.txt")), "exactly");
        if folder.path().join("tWo.txt").exists() {
            eprintln!("skipped: this disk knows no case");
        } else {
            assert_eq!(found("Two.txt"), None, "two.txt or TWO.txt");
        }
        assert_eq!(found("left"), None, "a folder is no file");
        assert_eq!(names.folder(&folder.path().join("left")), Some(folder.path().join("Left")));
    }

    #[cfg(unix)]
    #[test]
    fn a_name_of_one_byte_a_letter_is_text() {
        use std::os::unix::ffi::OsStrExt as _;
        assert_eq!(as_text(OsStr::from_bytes(b"caf\xe9.jpg")), "café.jpg");
        assert_eq!(as_text(OsStr::new("café.jpg")), "café.jpg");
    }
}
