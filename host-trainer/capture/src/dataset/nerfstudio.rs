//! Captures of nerfstudio and instant-ngp: one `transforms.json` beside photographs.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use pocketsplat_files::{shown, why_missing};
use rayon::prelude::*;

use super::folder_names::FolderNames;
use super::listing::{ListedView, Listing, Note, every_nth, unused_images};
use super::named_path::NamedPath;
use super::points::Points;
use super::transforms::{Frame, Transforms, read_transforms};
use super::{DatasetError, Layout, LoadOptions, Split, found_files, image_folder, missing_masks, ply};

/// The file that tells this layout.
pub(super) const FILE: &str = "transforms.json";

/// Lists the capture in `folder`, views sorted by name.
///
/// # Errors
/// As [`super::load`], as far as files but no pixels tell.
pub(super) fn list(folder: &Path, options: &LoadOptions) -> Result<Listing, DatasetError> {
    let source = folder.join(FILE);
    let mut transforms = read_transforms(&source)?;
    transforms.check_model(&source)?;
    transforms.frames.sort_by(|a, b| a.name().cmp(b.name()));
    let mut notes = Vec::new();
    let named = transforms.image_folder().map(str::to_owned);
    let images = match (&options.images, &named) {
        // The folder that the file names is the one to read unless another is asked for or it is not there.
        (None, Some(named)) if folder.join(named).is_dir() => None,
        (None, None) => None,
        _ => image_folder::choose(folder, options, &mut notes)?,
    };
    let splits = splits(&transforms, options, &mut notes);
    let names = FolderNames::default();
    let view = |(frame, split): (&Frame, Option<Split>)| {
        Some(frame.view(split?, &names, folder, images.as_deref(), &transforms.shared))
    };
    let mut views: Vec<ListedView> = transforms.frames.par_iter().zip(splits).filter_map(view).collect();
    notes.extend(found_files::check(&mut views, &names));
    notes.extend(missing_masks::in_frames(&views));
    let points = points(folder, &names, &transforms, &mut notes)?;
    let unposed = unposed(folder, &names, images.as_deref(), &transforms);
    if transforms.ply_file_path.is_none() || points.as_ref().is_some_and(|(_, points)| points.is_empty()) {
        notes.push(Note::no_points("the capture brings no points"));
    }
    let mut listing = Listing { layout: Layout::Nerfstudio, source, views, points, unposed, notes };
    if !listing.has_test_views() {
        let has_own_split = transforms.splits.iter().any(Option::is_some);
        listing.notes.push(match has_own_split {
            true => Note::no_test_views_in_own_split(),
            false => Note::no_test_views(&listing.views),
        });
    }
    Ok(listing)
}

/// The split of every frame: as the file gives it, or every n-th held out; `None` for frames of no used split.
fn splits(transforms: &Transforms, options: &LoadOptions, notes: &mut Vec<Note>) -> Vec<Option<Split>> {
    let [train, val, test] = &transforms.splits;
    if transforms.splits.iter().all(Option::is_none) {
        return (0..transforms.frames.len()).map(|i| Some(every_nth(options.test_every, i))).collect();
    }
    let test = test.as_ref().filter(|names| !names.is_empty());
    let held_out = test.or(val.as_ref());
    if test.is_some()
        && let Some(val) = val
    {
        notes.push(Note::new("unused-split", format!("views in `val_filenames`, not used: {}", val.len())));
    }
    let mut by_path = HashMap::new();
    // Of paths of another machine the name alone may fit; several of one name say nothing.
    let mut by_name: HashMap<String, Option<Split>> = HashMap::new();
    for (names, split) in [(train.as_ref(), Split::Train), (held_out, Split::Test)] {
        for path in names.into_iter().flatten().map(|name| NamedPath::new(name)) {
            if by_path.insert(path.key(), split).is_none() {
                by_name.entry(path.name()).and_modify(|split| *split = None).or_insert(Some(split));
            }
        }
    }
    let split_of = |frame: &Frame| {
        let by_name = || by_name.get(frame.name()).copied().flatten();
        by_path.get(&frame.path().key()).copied().or_else(by_name)
    };
    let splits: Vec<_> = transforms.frames.iter().map(split_of).collect();
    let n_unused = splits.iter().filter(|split| split.is_none()).count();
    if n_unused > 0 {
        let text = format!("frames that no used split of `{FILE}` names, left out: {n_unused}");
        notes.push(Note::new("unused-split", text));
    }
    let n_named = splits.iter().flatten().count();
    if n_named < by_path.len() {
        let text = format!(
            "names in the splits of `{FILE}` that no frame has: {}; they must be spelt like `file_path`",
            by_path.len() - n_named
        );
        notes.push(Note::new("unknown-names", text));
    }
    splits
}

/// The points that a transforms file names, where they are there.
pub(super) fn points(
    folder: &Path,
    names: &FolderNames,
    transforms: &Transforms,
    notes: &mut Vec<Note>,
) -> Result<Option<(PathBuf, Points)>, DatasetError> {
    let Some(named) = transforms.ply_file_path.as_deref().map(NamedPath::new) else { return Ok(None) };
    let Some(path) = named.file(names, folder, None) else {
        let expected = named.expected(folder, None);
        let text = format!(
            "`ply_file_path` names `{}`, which {}, so training makes points; restore the point cloud for a better start, or take \
             `ply_file_path` out",
            shown(&expected),
            why_missing(&expected)
        );
        notes.push(Note::warning("missing-points", text));
        return Ok(None);
    };
    let points = ply::read_points(&path)?;
    Ok(Some((path, points)))
}

/// Images beside the listed ones that no frame names, if all of them lie in one folder of the capture.
fn unposed(folder: &Path, names: &FolderNames, images: Option<&str>, transforms: &Transforms) -> Vec<String> {
    let found: Vec<PathBuf> = transforms.frames.iter().filter_map(|frame| frame.image(names, folder, images)).collect();
    let mut folders = found.iter().map(|path| {
        let mut parts = path.strip_prefix(folder).ok()?.components();
        // A file that lies in the capture's own folder has no second part.
        parts.next().filter(|_| parts.next().is_some())
    });
    let Some(Some(first)) = folders.next() else { return Vec::new() };
    if !folders.all(|folder| folder == Some(first)) {
        return Vec::new();
    }
    let masks: Vec<PathBuf> = transforms.frames.iter().filter_map(|frame| frame.mask(names, folder)).collect();
    unused_images(&folder.join(first), found.iter().chain(&masks).map(PathBuf::as_path))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The splits of frames with these paths, `|` between those to train on and those held out.
    fn splits_of(frames: &[&str], train: &[&str], test: &[&str]) -> (String, usize) {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let list = |paths: &[&str]| serde_json::to_string(paths).expect("text");
        let frames: Vec<String> =
            frames.iter().map(|path| format!("{{\"file_path\": \"{path}\", \"transform_matrix\": []}}")).collect();
        let text = format!(
            "{{\"fl_x\": 20, \"train_filenames\": {}, \"test_filenames\": {}, \"frames\": [{}]}}",
            list(train),
            list(test),
            frames.join(", ")
        );
        let path = folder.path().join(FILE);
        std::fs::write(&path, text).expect("a file");
        let transforms = read_transforms(&path).expect("transforms");
        let mut notes = Vec::new();
        let letter = |split: Option<Split>| match split {
            Some(Split::Train) => 't',
            Some(Split::Test) => 'h',
            None => '-',
        };
        let found = splits(&transforms, &LoadOptions::default(), &mut notes);
        (found.into_iter().map(letter).collect(), notes.len())
    }

    #[test]
    fn a_split_names_frames_by_their_paths_or_by_a_name_that_is_one_alone() {
        let cameras = ["/home/ann/cam1/0.png", "/home/ann/cam1/1.png", "/home/ann/cam2/0.png"];
        assert_eq!(splits_of(&cameras, &cameras[..2], &cameras[2..]), ("tth".to_owned(), 0));
        let moved = ["images/0.png", "images/1.png"];
        assert_eq!(splits_of(&moved, &["./images/0.png"], &["images\\1.png"]), ("th".to_owned(), 0));
        assert_eq!(splits_of(&["/a/0.png", "/a/1.png"], &["/b/0.png"], &["/b/1.png"]), ("th".to_owned(), 0));
        assert_eq!(splits_of(&["/a/0.png"], &["/b/0.png"], &["/c/0.png"]).0, "-", "two of one name");
    }
}
