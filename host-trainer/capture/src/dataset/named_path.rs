//! Finding the files that a capture names: captures are moved, converted and renamed after their paths were written.

use std::path::{Path, PathBuf};

use super::folder_names::FolderNames;
use super::image_file::{image_at, mask_at};

/// Where photographs lie in captures that name them by paths of another machine.
const IMAGE_FOLDERS: [&str; 2] = ["images", "input"];

/// A path as a capture's file writes it, taken apart.
pub(super) struct NamedPath<'a> {
    written: &'a str,
    /// Whether it starts at a root, of this machine or of another: `/home/…` or `C:\…`.
    is_absolute: bool,
    /// Its parts without `.` and with `a/..` folded.
    parts: Vec<&'a str>,
}

impl<'a> NamedPath<'a> {
    pub(super) fn new(written: &'a str) -> Self {
        let has_drive = written.as_bytes().get(1) == Some(&b':') && written.as_bytes()[0].is_ascii_alphabetic();
        let mut parts = Vec::new();
        for part in written.split(['/', '\\']) {
            match part {
                "" | "." => {}
                ".." if parts.last().is_some_and(|last| *last != "..") => drop(parts.pop()),
                part => parts.push(part),
            }
        }
        Self { written, is_absolute: has_drive || written.starts_with(['/', '\\']), parts }
    }

    /// The path as it was written.
    pub(super) fn written(&self) -> &'a str {
        self.written
    }

    /// The path for people: its parts, of an absolute path the last one only.
    pub(super) fn name(&self) -> String {
        let skipped = if self.is_absolute { self.parts.len().saturating_sub(1) } else { 0 };
        self.parts[skipped..].join("/")
    }

    /// All parts of the path, which tell it from others of the same name.
    pub(super) fn key(&self) -> String {
        self.parts.join("/")
    }

    /// The first part of a relative path of several, such as `images`.
    pub(super) fn first_folder(&self) -> Option<&'a str> {
        (!self.is_absolute && self.parts.len() > 1).then(|| self.parts[0])
    }

    /// Where the file is if nothing was moved.
    ///
    /// * `images`: a folder of `folder` that stands in for the first part of the path.
    pub(super) fn expected(&self, folder: &Path, images: Option<&str>) -> PathBuf {
        match images {
            Some(images) => folder.join(images).join(self.name_below_first()),
            None if self.is_absolute => PathBuf::from(self.written),
            None => folder.join(self.parts.join("/")),
        }
    }

    fn name_below_first(&self) -> String {
        match self.first_folder() {
            Some(_) => self.parts[1..].join("/"),
            None => self.name(),
        }
    }

    /// The file that is there: as written, by the last parts of the path, the most first, or by its name in a folder of
    /// images. The first folder of the path that is there decides: what is missing in it is not looked for elsewhere.
    ///
    /// Names are compared exactly first, then but for the form of Unicode, then but for case.
    pub(super) fn file(&self, names: &FolderNames, folder: &Path, images: Option<&str>) -> Option<PathBuf> {
        self.find(names, folder, images, |folder, name| names.named(folder, name, Path::is_file))
    }

    /// The image that is there: as [`Self::file`], and as [`image_at`] where it has another ending than the path.
    pub(super) fn image(&self, names: &FolderNames, folder: &Path, images: Option<&str>) -> Option<PathBuf> {
        self.find(names, folder, images, |folder, name| image_at(names, folder, name))
    }

    /// The mask of the image of this path in a folder of masks: as [`Self::image`], but as [`mask_at`].
    pub(super) fn mask_in(&self, names: &FolderNames, masks: &Path) -> Option<PathBuf> {
        self.find(names, masks, None, |folder, name| mask_at(names, folder, name))
    }

    /// The mask that is there: as [`Self::mask_in`], but never by its bare name, for a photograph may have the same.
    pub(super) fn mask(&self, names: &FolderNames, folder: &Path) -> Option<PathBuf> {
        let with_folders = (0..self.parts.len().saturating_sub(1)).map(|n| folder.join(self.parts[n..].join("/")));
        std::iter::once(self.expected(folder, None))
            .chain(with_folders)
            .find_map(|path| in_its_folder(names, &path, |folder, name| mask_at(names, folder, name)))
    }

    fn find(
        &self,
        names: &FolderNames,
        folder: &Path,
        images: Option<&str>,
        look: impl Fn(&Path, &str) -> Option<PathBuf>,
    ) -> Option<PathBuf> {
        if let Some(found) = in_its_folder(names, &self.expected(folder, images), &look) {
            return Some(found);
        }
        let base = images.map_or_else(|| folder.to_owned(), |images| folder.join(images));
        for skipped in 0..self.parts.len() {
            let path = base.join(self.parts[skipped..].join("/"));
            let found = in_its_folder(names, &path, &look);
            let has_folder = skipped + 1 < self.parts.len();
            if found.is_some() || (has_folder && path.parent().is_some_and(|folder| names.folder(folder).is_some())) {
                return found;
            }
        }
        let name = self.parts.last().filter(|_| images.is_none())?;
        IMAGE_FOLDERS.iter().find_map(|images| look(&folder.join(images), name))
    }
}

/// Looks for the name of a path in its folder.
fn in_its_folder(names: &FolderNames, path: &Path, look: impl Fn(&Path, &str) -> Option<PathBuf>) -> Option<PathBuf> {
    look(&names.folder(path.parent()?)?, path.file_name()?.to_str()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(files: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for file in files {
            let path = folder.path().join(file);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            std::fs::write(path, "").expect("a file");
        }
        folder
    }

    #[test]
    fn names_are_plain_whatever_was_written() {
        for (written, name) in [
            ("./images/a.png", "images/a.png"),
            ("images//a/../b.png", "images/b.png"),
            ("../images/a.png", "../images/a.png"),
            (".\\images\\a.png", "images/a.png"),
            ("/home/ann/fox/images/a.png", "a.png"),
            ("C:\\Users\\ann\\a.png", "a.png"),
            ("", ""),
        ] {
            assert_eq!(NamedPath::new(written).name(), name, "{written}");
        }
    }

    #[test]
    fn images_are_found_where_they_can_be_meant() {
        let capture = folder(&[
            "images/a.jpg",
            "images/a.heic",
            "images/b.PNG",
            "images/e.heic",
            "images/frame.001.png",
            "images_2/a.jpg",
            "left/b.jpg",
            "c.webp",
        ]);
        let names = FolderNames::default();
        let found = |written: &str, images: Option<&str>| {
            let path = NamedPath::new(written).image(&names, capture.path(), images)?;
            Some(path.strip_prefix(capture.path()).expect("inside").to_str().expect("text").to_owned())
        };
        for (written, images, expected) in [
            ("images/a.jpg", None, Some("images/a.jpg")),
            ("images/a.png", None, Some("images/a.jpg")),
            ("images/a", None, Some("images/a.jpg")),
            ("images/b.png", None, Some("images/b.PNG")),
            ("images/frame.001", None, Some("images/frame.001.png")),
            ("images\\x\\..\\a.jpg", None, Some("images/a.jpg")),
            ("fox/images/a.jpg", None, Some("images/a.jpg")),
            ("a.jpg", None, Some("images/a.jpg")),
            ("/home/ann/fox/images_2/a.jpg", None, Some("images_2/a.jpg")),
            ("/home/ann/photographs/a.jpg", None, Some("images/a.jpg")),
            ("D:\\photographs\\c.png", None, Some("c.webp")),
            ("images/a.heic", None, Some("images/a.jpg")),
            ("images/e.heic", None, Some("images/e.heic")),
            ("images/a.jpg", Some("images_2"), Some("images_2/a.jpg")),
            ("/home/ann/photographs/a.jpg", Some("images_2"), Some("images_2/a.jpg")),
            ("images/b.png", Some("images_2"), None),
            ("images/d.png", None, None),
            ("left/a.jpg", None, None),
            ("/home/ann/left/a.jpg", None, None),
            ("", None, None),
        ] {
            assert_eq!(found(written, images).as_deref(), expected, "{written} in {images:?}");
        }
        let mask = |written: &str| NamedPath::new(written).mask(&names, capture.path());
        assert_eq!(mask("/home/ann/fox/left/b.png"), Some(capture.path().join("left/b.jpg")));
        for missing in ["masks/a.jpg", "/home/ann/fox/masks/c.png", "a.jpg"] {
            assert_eq!(mask(missing), None, "{missing} is not the photograph of that name");
        }
        let file = |written: &str| NamedPath::new(written).file(&names, capture.path(), None);
        assert_eq!(file("images/a.png"), None, "a file has its own extension");
        assert_eq!(file("Images/A.JPG"), Some(capture.path().join("images/a.jpg")), "whatever the case");
    }
}
