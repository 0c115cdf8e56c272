//! Views without a mask in a capture whose others have one.

use std::path::Path;

use pocketsplat_files::shown;

use super::error::first_few;
use super::listing::{ListedView, Note};

/// A warning where frames of a transforms file lack a mask although others name one.
pub(super) fn in_frames(views: &[ListedView]) -> Option<Note> {
    let has_masks = views.iter().flat_map(|view| &view.shot).any(|shot| !shot.masks.is_empty());
    let missing = missing(views, "images without a mask", "name the mask of each in its frame as `mask_path`");
    missing.filter(|_| has_masks)
}

/// A warning where images lack a mask in COLMAP's folder of masks.
pub(super) fn in_folder(masks: &Path, views: &[ListedView]) -> Option<Note> {
    let remedy = "name masks like their images, with `.png` behind the name or in place of its extension";
    missing(views, &format!("images without a mask in `{}`", shown(masks)), remedy)
}

fn missing(views: &[ListedView], what: &str, remedy: &str) -> Option<Note> {
    let sound = || views.iter().filter_map(|view| Some((&view.name, view.shot.as_ref().ok()?)));
    let without: Vec<&String> = sound().filter(|(_, shot)| shot.masks.is_empty()).map(|(name, _)| name).collect();
    let text = format!(
        "{what}: {} of {} ({}), so all their pixels count; {remedy}",
        without.len(),
        sound().count(),
        first_few(&without, ", ")
    );
    (!without.is_empty()).then(|| Note::warning("missing-masks", text))
}
