//! Blender (Synthetic-NeRF) captures: `transforms_{train,val,test}.json` beside RGBA images of one size.

use std::path::Path;

use rayon::prelude::*;

use super::folder_names::FolderNames;
use super::listing::{ListedView, Listing, Note, commonest, every_nth};
use super::transforms::{Transforms, read_transforms};
use super::{DatasetError, Layout, LoadOptions, Split, ViewFault, found_files, missing_masks, nerfstudio};

/// The file that tells this layout.
pub(super) const TRAIN_FILE: &str = "transforms_train.json";
const TEST_FILE: &str = "transforms_test.json";
const VAL_FILE: &str = "transforms_val.json";

/// Lists the Blender capture in `folder`. Without a test file every n-th training view is held out.
///
/// # Errors
/// As [`super::load`], as far as files but no pixels tell.
pub(super) fn list(folder: &Path, options: &LoadOptions) -> Result<Listing, DatasetError> {
    let source = folder.join(TRAIN_FILE);
    let train = read_transforms(&source)?;
    let test = read_optional(folder, TEST_FILE)?;
    let mut notes = Vec::new();
    if let Some(val) = read_optional(folder, VAL_FILE)? {
        notes.push(Note::new("unused-split", format!("views in `{VAL_FILE}`, not used: {}", val.frames.len())));
    }
    train.check_model(&source)?;
    let names = FolderNames::default();
    let mut views = views(folder, &names, Split::Train, &train);
    let needed_px = commonest(views.iter().flat_map(|view| &view.shot).map(|shot| shot.header.size_px));
    if let Some(test) = &test {
        test.check_model(&folder.join(TEST_FILE))?;
        views.extend(self::views(folder, &names, Split::Test, test));
    } else {
        for (i, view) in views.iter_mut().enumerate() {
            view.split = every_nth(options.test_every, i);
        }
    }
    notes.extend(found_files::check(&mut views, &names));
    notes.extend(missing_masks::in_frames(&views));
    for view in &mut views {
        if let (Ok(shot), Some(needed_px)) = (&view.shot, needed_px)
            && shot.header.size_px != needed_px
        {
            view.shot = Err(ViewFault::Size { path: shot.path.clone(), found_px: shot.header.size_px, needed_px });
        }
    }
    if !views.iter().any(|view| view.split == Split::Test && view.shot.is_ok()) {
        notes.push(match &test {
            Some(_) => Note::warning(
                "no-test-views",
                format!(
                    "no test views, so test PSNR cannot be computed: `{}` has no usable frame; move some frames of \
                     `{TRAIN_FILE}` into it",
                    folder.join(TEST_FILE).display()
                ),
            ),
            None => Note::no_test_views(&views),
        });
    }
    let points = nerfstudio::points(folder, &names, &train, &mut notes)?;
    Ok(Listing { layout: Layout::Blender, source, views, points, unposed: Vec::new(), notes })
}

fn read_optional(folder: &Path, name: &str) -> Result<Option<Transforms>, DatasetError> {
    let path = folder.join(name);
    if path.exists() { read_transforms(&path).map(Some) } else { Ok(None) }
}

fn views(folder: &Path, names: &FolderNames, split: Split, transforms: &Transforms) -> Vec<ListedView> {
    let frames = transforms.frames.par_iter();
    frames.map(|frame| frame.view(split, names, folder, None, &transforms.shared)).collect()
}

#[cfg(test)]
mod tests;
