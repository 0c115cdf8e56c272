//! What to tell someone who gives photographs, a film or a packed capture where a capture is needed.

use std::path::Path;

use pocketsplat_files::{beside, shell_word, shown};

use super::image_names::{
    FILM_EXTENSIONS, PHOTOGRAPH_FOLDERS, TELEPHONE_EXTENSIONS, conversion, has_extension, has_foreign_name,
    is_image_name,
};

/// Extensions of packed captures: Record3D's are archives of that kind, too.
const ARCHIVES: [&str; 2] = ["zip", "r3d"];

fn file_names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let files = entries.filter(|entry| entry.path().is_file());
    let mut names: Vec<String> = files.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort_unstable();
    names
}

/// What the folder holds instead of a capture and how to make one of it, the remedy behind the last semicolon.
pub(super) fn found_instead(folder: &Path) -> Option<String> {
    photographs(folder).or_else(|| {
        let names = file_names(folder);
        let name = names.iter().find(|name| has_extension(name, &FILM_EXTENSIONS) || has_extension(name, &ARCHIVES))?;
        file_instead(&folder.join(name))
    })
}

/// The photographs in a folder and the command that poses them.
fn photographs(folder: &Path) -> Option<String> {
    let with_names = PHOTOGRAPH_FOLDERS.iter().map(|name| {
        let images = if *name == "." { folder.to_owned() } else { folder.join(name) };
        let names = file_names(&images);
        (*name, images, names)
    });
    for (place, images, names) in with_names {
        let n_read = names.iter().filter(|name| is_image_name(name)).count();
        let foreign: Vec<&String> = names.iter().filter(|name| has_foreign_name(name)).collect();
        let n = n_read + foreign.len();
        if n == 0 {
            continue;
        }
        // Those of telephones the command converts itself.
        let by_hand: Vec<&&String> =
            foreign.iter().filter(|name| !has_extension(name, &TELEPHONE_EXTENSIONS)).collect();
        let convert = by_hand.first().filter(|_| foreign.len() > n_read).map_or_else(String::new, |name| {
            format!("convert those of a format that is not read:\n  {}\nthen ", conversion(&images, name))
        });
        // Photographs that have to be converted are not left where they are.
        let stays = place == "images" && foreign.is_empty();
        let capture = if stays { folder.to_owned() } else { beside(folder, "-capture") };
        return Some(format!(
            "`{}` holds {n} photograph{} but no poses; {convert}{}",
            shown(&images),
            if n == 1 { "" } else { "s" },
            poses(folder, &capture)
        ));
    }
    None
}

/// The command that finds poses and leaves them in `capture`.
fn poses(of: &Path, capture: &Path) -> String {
    format!(
        "find them, and give the folder `{}`:\n  pocketsplat poses {} -o {}\n(`pocketsplat train --poses` does so before it trains)",
        shown(capture),
        shell_word(of),
        shell_word(capture)
    )
}

/// What a file is that was given, or found, in place of a capture's folder.
pub(super) fn file_instead(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_string_lossy();
    let stem = path.with_extension("");
    let (file, folder) = (shell_word(path), shell_word(&stem));
    let (film, path) = (path, shown(path));
    if has_extension(&name, &FILM_EXTENSIONS) {
        Some(format!("`{path}` is a film, needed: photographs with poses; {}", poses(film, &stem)))
    } else if has_extension(&name, &ARCHIVES) {
        Some(format!(
            "`{path}` is a packed capture, needed: its files; unpack it and give the folder `{}`:\n  \
             unzip {file} -d {folder}",
            shown(&stem)
        ))
    } else if has_extension(&name, &["json"]) {
        Some(format!("`{path}` is a file, needed: a folder; give the folder that it lies in"))
    } else {
        None
    }
}
