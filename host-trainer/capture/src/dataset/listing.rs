//! What a reader of one layout finds, before any pixel is decoded: the common ground of loading and diagnosing.

use std::collections::{BTreeMap, HashSet};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};

use super::depth_map::DepthMap;
use super::folder_names::folded;
use super::image::ImageHeader;
use super::image_file::stem_of;
use super::image_names::is_image_name;
use super::lens::Lens;
use super::mask_file::{MaskFile, is_dynamic_mask};
use super::points::Points;
use super::{Layout, Severity, Split, ViewFault};

/// A capture as its files list it.
pub(super) struct Listing {
    pub(super) layout: Layout,
    /// The file that lists the views.
    pub(super) source: PathBuf,
    /// The listed views, in the order in which they are handed on.
    pub(super) views: Vec<ListedView>,
    /// Points the capture brings, capture units, and the file they are from.
    pub(super) points: Option<(PathBuf, Points)>,
    /// Images that lie with the others but have no pose, by name.
    pub(super) unposed: Vec<String>,
    /// What a person should know about how the capture was read.
    pub(super) notes: Vec<Note>,
}

/// Something about how a capture was read, with its remedy behind the last semicolon where there is one.
pub(super) struct Note {
    pub(super) severity: Severity,
    /// One of the codes of [`Finding`](super::Finding).
    pub(super) code: &'static str,
    pub(super) text: String,
}

impl Note {
    pub(super) fn new(code: &'static str, text: impl Into<String>) -> Self {
        Self { severity: Severity::Note, code, text: text.into() }
    }

    pub(super) fn warning(code: &'static str, text: impl Into<String>) -> Self {
        Self { severity: Severity::Warning, ..Self::new(code, text) }
    }

    /// What training starts from instead of points of the capture.
    ///
    /// * `why`: what there is instead of points.
    pub(super) fn no_points(why: &str) -> Self {
        let made = "so training makes them: of depth maps where there are any, else matched between the photographs, else random";
        Self::new("no-points", format!("{why}, {made}"))
    }

    /// No view that can be used is held out of a capture that names no split of its own.
    pub(super) fn no_test_views(views: &[ListedView]) -> Self {
        let n_held_out = views.iter().filter(|view| view.split == Split::Test).count();
        let remedy = match n_held_out {
            0 => "hold out every 8th image with `--test-every 8`".to_owned(),
            n => format!(
                "views that are held out and cannot be used: {n}; repair them, or hold out others with another `--test-every`"
            ),
        };
        Self::warning("no-test-views", format!("no test views, so test PSNR cannot be computed; {remedy}"))
    }

    /// The same of a capture of nerfstudio's with a split of its own.
    pub(super) fn no_test_views_in_own_split() -> Self {
        Self::warning(
            "no-test-views",
            "no test views, so test PSNR cannot be computed: the capture has a split of its own, and no frame is in its `test_filenames`; \
             name some there as `file_path` spells them, or remove the three lists to hold out every n-th image with `--test-every`",
        )
    }
}

/// One view of a listing.
pub(super) struct ListedView {
    pub(super) split: Split,
    /// The path of its photograph as the capture gives it.
    pub(super) written: String,
    /// The same for people.
    pub(super) name: String,
    /// The photograph and its pose, or why there is none.
    pub(super) shot: Result<Shot, ViewFault>,
}

/// A photograph whose pose, lens and image header are sound.
#[derive(Clone, Debug)]
pub(super) struct Shot {
    pub(super) path: PathBuf,
    pub(super) header: ImageHeader,
    /// World to camera, OpenCV axes.
    pub(super) rotation: DMat3,
    pub(super) translation: DVec3,
    /// For the image as it is stored.
    pub(super) lens: Lens,
    /// Mask images of the same size or a larger one of the same shape; a pixel counts where it does in all.
    pub(super) masks: Vec<MaskFile>,
    /// How far away things are in it, where the capture says so.
    pub(super) depth: Option<DepthMap>,
}

impl Shot {
    /// The camera's centre, capture units.
    pub(super) fn centre_world(&self) -> DVec3 {
        -(self.rotation.transpose() * self.translation)
    }
}

impl Listing {
    /// The sound views, with their names.
    pub(super) fn sound(&self) -> impl Iterator<Item = (&str, &Shot)> {
        self.views.iter().filter_map(|view| Some((view.name.as_str(), view.shot.as_ref().ok()?)))
    }

    /// The sound views of a split.
    pub(super) fn shots(&self, split: Split) -> impl Iterator<Item = &Shot> {
        self.views.iter().filter(move |view| view.split == split).filter_map(|view| view.shot.as_ref().ok())
    }

    /// Whether a view to test on can be used.
    pub(super) fn has_test_views(&self) -> bool {
        self.shots(Split::Test).next().is_some()
    }

    /// Whether it is `test_every` that splits the views, and not the capture.
    pub(super) fn is_split_by(&self, test_every: u32) -> bool {
        self.views.iter().enumerate().all(|(i, view)| view.split == every_nth(test_every, i))
    }

    /// How many views to test on can be used, if it is `test_every` that holds them out.
    pub(super) fn n_held_out_by(&self, test_every: u32) -> usize {
        if self.is_split_by(test_every) { self.shots(Split::Test).count() } else { 0 }
    }

    /// How many views the capture lists for a split, sound or not.
    pub(super) fn n_listed(&self, split: Split) -> usize {
        self.views.iter().filter(|view| view.split == split).count()
    }
}

/// The value most of an iterator's items have, the first of equals; `None` without items.
pub(super) fn commonest<T: Copy + Ord>(items: impl Iterator<Item = T>) -> Option<T> {
    // Count and, to break ties, how early the value was first seen.
    let mut counts = BTreeMap::new();
    for (i, item) in items.enumerate() {
        counts.entry(item).or_insert((0_usize, std::cmp::Reverse(i))).0 += 1;
    }
    counts.into_iter().max_by_key(|&(_, rank)| rank).map(|(item, _)| item)
}

/// Whether a file is hidden, as those that macOS leaves beside others on foreign disks (`._a.txt`).
pub(super) fn is_hidden(name: &OsStr) -> bool {
    name.as_encoded_bytes().starts_with(b".")
}

/// The files of a folder that have this extension and are not hidden, sorted.
pub(super) fn files_with(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let is_shown = |path: &PathBuf| path.file_name().is_some_and(|name| !is_hidden(name));
    let is_of_extension = |path: &PathBuf| path.extension().is_some_and(|own| own == extension);
    let mut files: Vec<PathBuf> = entries.filter(|path| is_of_extension(path) && is_shown(path)).collect();
    files.sort();
    files
}

/// Gives every `test_every`-th of `n` views, counted from the first, to the test split; none where it is 0.
pub(super) fn every_nth(test_every: u32, i: usize) -> Split {
    if test_every > 0 && i.is_multiple_of(test_every as usize) { Split::Test } else { Split::Train }
}

/// The names of the image files below `folder` that are not among `used`, in the form of [`image_names_below`].
///
/// Files are compared, not names, because captures name files in many ways. What has the name of a used image but another ending is a
/// map or a conversion of it, and what has instant-ngp's name of a mask is one; neither is a photograph without a pose.
pub(super) fn unused_images<'a>(folder: &Path, used: impl Iterator<Item = &'a Path>) -> Vec<String> {
    let without_ending = |path: &Path| {
        let name = path.file_name()?.to_string_lossy().into_owned();
        Some((path.parent()?.to_owned(), folded(stem_of(&name))))
    };
    let used: HashSet<PathBuf> = used.filter_map(|path| path.canonicalize().ok()).collect();
    let stems: HashSet<_> = used.iter().filter_map(|path| without_ending(path)).collect();
    let is_used = |name: &String| {
        let path = folder.join(name).canonicalize();
        path.is_ok_and(|path| used.contains(&path) || without_ending(&path).is_some_and(|stem| stems.contains(&stem)))
    };
    image_names_below(folder).into_iter().filter(|name| !is_dynamic_mask(name) && !is_used(name)).collect()
}

/// The names of image files below `folder`, relative to it with `/` between their parts, sorted.
///
/// Links to folders are not followed, so that the walk ends.
fn image_names_below(folder: &Path) -> Vec<String> {
    let mut names = Vec::new();
    let mut waiting = vec![(folder.to_owned(), String::new())];
    while let Some((folder, prefix)) = waiting.pop() {
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let name = format!("{prefix}{}", pocketsplat_files::shown(Path::new(&entry.file_name())));
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                waiting.push((entry.path(), name + "/"));
            } else if !is_hidden(&entry.file_name()) && is_image_name(&name) && entry.path().is_file() {
                names.push(name);
            }
        }
    }
    names.sort_unstable();
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_of_equally_common_values_wins() {
        assert_eq!(commonest([3, 1, 1, 3, 2].into_iter()), Some(3));
        assert_eq!(commonest(std::iter::empty::<u8>()), None);
    }

    #[test]
    fn every_nth_view_counts_from_the_first() {
        let held_out = |n| (0..10).filter(|&i| every_nth(n, i) == Split::Test).collect::<Vec<_>>();
        assert_eq!(held_out(8), [0, 8]);
        assert_eq!(held_out(3), [0, 3, 6, 9]);
        assert_eq!(held_out(0), Vec::<usize>::new());
    }

    #[test]
    fn images_are_found_in_folders_below_by_their_extension() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        std::fs::create_dir_all(folder.path().join("left/b.jpg")).expect("folders");
        for name in ["z.PNG", "left/a.jpeg", "left/b.jpg/c.jpg", "notes.txt", "jpg"] {
            std::fs::write(folder.path().join(name), "").expect("a file");
        }
        assert_eq!(image_names_below(folder.path()), ["left/a.jpeg", "left/b.jpg/c.jpg", "z.PNG"]);
    }
}
