//! Masks that lie in a capture but are not read, because nothing names them.

use std::path::Path;

use pocketsplat_files::shown;

use super::Layout;
use super::image_folder::is_there;
use super::listing::{Listing, Note};

/// Folders that masks are kept in.
const FOLDERS: [&str; 2] = ["masks", "mask"];

/// A warning where a folder of masks lies in the capture, but no photograph has one.
pub(super) fn unread(folder: &Path, listing: &Listing) -> Option<Note> {
    let has_masks = listing.sound().any(|(_, shot)| !shot.masks.is_empty());
    let masks = FOLDERS.iter().map(|name| folder.join(name)).find(|masks| is_there(masks))?;
    // Photographs are no masks, whatever their folder is called.
    let are_read = listing.sound().any(|(_, shot)| shot.path.starts_with(&masks));
    let remedy = if matches!(listing.layout, Layout::Blender | Layout::Nerfstudio) {
        "name the mask of each photograph in its frame as `mask_path`"
    } else if listing.layout == Layout::Colmap {
        "name masks like their photographs, with `.png` behind the name or in place of its ending, in `masks`"
    } else {
        "captures of this layout have no masks; convert the capture to a `transforms.json` with `mask_path`"
    };
    let text = format!("`{}` holds images, but no photograph has a mask, so all pixels count; {remedy}", shown(&masks));
    (!has_masks && !are_read && listing.sound().next().is_some()).then(|| Note::warning("unread-masks", text))
}
