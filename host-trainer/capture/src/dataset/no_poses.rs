//! What to tell someone who gives photographs, a film or a packed capture where a capture is needed.

use std::path::Path;

use pocketsplat_files::{shell_word, shown};

use super::image_names::{conversion, has_foreign_name, is_image_name};

/// Folders that photographs are kept in, the capture's own last.
const FOLDERS: [&str; 5] = ["images", "input", "rgb", "photos", "."];
/// Extensions of films.
const FILMS: [&str; 5] = ["mp4", "mov", "mkv", "avi", "webm"];
/// Extensions of packed captures: Record3D's are archives of that kind, too.
const ARCHIVES: [&str; 2] = ["zip", "r3d"];

fn extension(name: &str) -> String {
    name.rsplit_once('.').map_or_else(String::new, |(_, extension)| extension.to_ascii_lowercase())
}

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
        let name = names.iter().find(|name| FILMS.contains(&extension(name).as_str()) || is_archive(name))?;
        file_instead(&folder.join(name))
    })
}

fn is_archive(name: &str) -> bool {
    ARCHIVES.contains(&extension(name).as_str())
}

/// The photographs in a folder and the commands that pose them.
fn photographs(folder: &Path) -> Option<String> {
    let with_names = FOLDERS.iter().map(|name| {
        let images = if *name == "." { folder.to_owned() } else { folder.join(name) };
        let names = file_names(&images);
        (images, names)
    });
    for (images, names) in with_names {
        let n_read = names.iter().filter(|name| is_image_name(name)).count();
        let foreign: Vec<&String> = names.iter().filter(|name| has_foreign_name(name)).collect();
        let n = n_read + foreign.len();
        if n == 0 {
            continue;
        }
        let convert = foreign.first().filter(|_| foreign.len() > n_read).map_or_else(String::new, |name| {
            format!("convert those of a format that is not read:\n  {}\nthen ", conversion(&images, name))
        });
        return Some(format!(
            "`{}` holds {n} photograph{} but no poses; {convert}{}",
            shown(&images),
            if n == 1 { "" } else { "s" },
            poses_by_colmap(folder, &images)
        ));
    }
    None
}

/// The commands that pose the photographs in `images` and leave the model where it is looked for.
fn poses_by_colmap(folder: &Path, images: &Path) -> String {
    let (database, sparse) = (shell_word(&folder.join("database.db")), shell_word(&folder.join("sparse")));
    let images = shell_word(images);
    format!(
        "make poses with COLMAP and give this folder again:\n  \
         colmap feature_extractor --database_path {database} --image_path {images} \
         --ImageReader.single_camera 1 --ImageReader.camera_model OPENCV\n  \
         colmap exhaustive_matcher --database_path {database}\n  \
         mkdir -p {sparse}\n  \
         colmap mapper --database_path {database} --image_path {images} --output_path {sparse}\n\
         (without a display add --SiftExtraction.use_gpu 0 to the first, --SiftMatching.use_gpu 0 to the second; from COLMAP 3.13 on \
         --FeatureExtraction.use_gpu and --FeatureMatching.use_gpu)"
    )
}

/// What a file is that was given, or found, in place of a capture's folder.
pub(super) fn file_instead(path: &Path) -> Option<String> {
    let name = path.file_name()?.to_string_lossy();
    let stem = path.with_extension("");
    let (file, folder) = (shell_word(path), shell_word(&stem));
    let (path, ending) = (shown(path), extension(&name));
    if FILMS.contains(&ending.as_str()) {
        Some(format!(
            "`{path}` is a film, needed: photographs with poses; take 2 photographs a second out of it and give the folder \
             `{}`:\n  mkdir -p {}\n  ffmpeg -i {file} -vf fps=2 -qscale:v 2 {}",
            shown(&stem),
            shell_word(&stem.join("images")),
            shell_word(&stem.join("images/%04d.jpg"))
        ))
    } else if is_archive(&name) {
        Some(format!(
            "`{path}` is a packed capture, needed: its files; unpack it and give the folder `{}`:\n  \
             unzip {file} -d {folder}",
            shown(&stem)
        ))
    } else if ending == "json" {
        Some(format!("`{path}` is a file, needed: a folder; give the folder that it lies in"))
    } else {
        None
    }
}
