//! What is there and cannot be reached: a folder without permission, a link that leads nowhere.
//!
//! `Path::exists` and its kin answer no to these as to what is not there, so whoever says "is not there" asks here first.

use std::fs;
use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};

use crate::shown;

/// Why `path` cannot be reached although it, or a link in its place, is there; `None` where it can be, or where nothing is.
pub fn out_of_reach(path: &Path) -> Option<String> {
    match fs::metadata(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            let link = path.ancestors().find(|part| part.is_symlink() && !part.exists())?;
            let target = fs::read_link(link).ok()?;
            Some(format!("the link `{}` leads to `{}`, which is not there", shown(link), shown(&target)))
        }
        // A part of the path is a file.
        Err(error) if error.kind() == ErrorKind::NotADirectory => None,
        Err(error) => Some(without_number(&error)),
        Ok(_) => None,
    }
}

/// What to say of a file that was not found: it does not exist, or cannot be reached.
pub fn why_missing(path: &Path) -> String {
    out_of_reach(path).map_or_else(|| "does not exist".to_owned(), |why| format!("cannot be reached: {why}"))
}

/// The first of `folder` and the folders at most `depth` below it that cannot be looked into, and why.
pub fn closed_folder(folder: &Path, depth: u32) -> Option<(PathBuf, String)> {
    if let Some(why) = out_of_reach(folder) {
        return Some((folder.to_owned(), why));
    }
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == ErrorKind::NotADirectory => return None,
        Err(error) => return Some((folder.to_owned(), without_number(&error))),
    };
    if depth == 0 {
        return None;
    }
    let mut below: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).filter(|path| !path.is_file()).collect();
    below.sort();
    below.iter().find_map(|folder| closed_folder(folder, depth - 1))
}

/// What the system said, without its number.
fn without_number(error: &Error) -> String {
    let said = error.to_string();
    said.split(" (os error").next().unwrap_or(&said).to_owned()
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn links_that_lead_nowhere_are_told_from_nothing() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("photographs")).expect("a folder");
        fs::write(at("photographs/a.jpg"), "").expect("a file");
        symlink("photographs", at("images")).expect("a link");
        symlink("/gone/images", at("elsewhere")).expect("a link");
        symlink("round", at("round")).expect("a link");
        for reached in ["photographs/a.jpg", "images/a.jpg", "images/b.jpg", "images/a.jpg/c.jpg", "nothing"] {
            assert_eq!(out_of_reach(&at(reached)), None, "{reached}");
        }
        let why = out_of_reach(&at("elsewhere/a.jpg")).expect("a link without a target");
        assert!(why.ends_with("elsewhere` leads to `/gone/images`, which is not there"), "{why}");
        let why = out_of_reach(&at("round/a.jpg")).expect("a link to itself");
        assert!(why.to_lowercase().contains("symbolic link"), "{why}");
    }

    #[test]
    fn a_closed_folder_is_found_below() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let at = |name: &str| folder.path().join(name);
        fs::create_dir_all(at("sparse/0")).expect("folders");
        assert_eq!(closed_folder(folder.path(), 2), None);
        symlink("round", at("sparse/round")).expect("a link");
        assert_eq!(closed_folder(folder.path(), 2).expect("one").0, at("sparse/round"));
        assert_eq!(closed_folder(folder.path(), 1), None);
    }
}
