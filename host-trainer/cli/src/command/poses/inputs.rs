//! What is given: photographs, or films.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use pocketsplat_capture::dataset::PHOTOGRAPH_EXTENSIONS;
use pocketsplat_files::{closed_folder, shell_word, shown};

use super::kinds::{Kind, Treatment, extension, films_in, kind_of, photographs_in, stem, with_photographs_below};
use super::programs::{FFMPEG, FFPROBE, HEIF_CONVERT, HEIF_DEC, Needed};

/// A photograph that is given.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Photograph {
    pub(super) path: PathBuf,
    /// As it is called in `images`.
    pub(super) name: String,
    pub(super) treatment: Treatment,
}

/// What poses are found of.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Given {
    Films(Vec<PathBuf>),
    /// Sorted by name.
    Photographs(Vec<Photograph>),
}

impl Given {
    /// What lies at these paths: photographs or films themselves, or folders of them.
    pub(super) fn at(paths: &[PathBuf]) -> Result<Self> {
        let (mut films, mut photographs, mut left_out) = (Vec::new(), Vec::new(), Vec::new());
        for path in paths {
            let found = fs::metadata(path)
                .with_context(|| format!("`{}` is not there; give a folder of photographs, or a film", shown(path)))?;
            if !found.is_dir() {
                if found.len() == 0 && found.is_file() {
                    bail!("`{}` is empty: 0 bytes; copy it again from where it was taken", shown(path));
                }
                match kind_of(path) {
                    Some(Kind::Film) => films.push(path.clone()),
                    Some(Kind::Photograph(treatment)) => photographs.push((path.clone(), treatment)),
                    Some(Kind::Foreign) => left_out.push(path.clone()),
                    None => bail!(
                        "`{}` is neither a photograph nor a film; give a folder of photographs, or a film",
                        shown(path)
                    ),
                }
                continue;
            }
            let (of_folder, foreign) = photographs_in(path);
            left_out.extend(foreign);
            if of_folder.is_empty() {
                films.extend(films_in(path));
            }
            photographs.extend(of_folder);
        }
        let photographs = named(photographs)?;
        let stems: Vec<&str> = photographs.iter().map(|photograph| stem(&photograph.name)).collect();
        // Raw files beside their photographs are nothing to speak of.
        left_out.retain(|path| !path.file_name().is_some_and(|name| stems.contains(&stem(&name.to_string_lossy()))));
        match (films.is_empty(), photographs.is_empty()) {
            (true, true) => Err(nothing_at(paths, &left_out)),
            (false, false) => bail!(
                "`{}` is a film, and `{}` is a photograph: they are of different cameras; give the films or the photographs",
                shown(&films[0]),
                shown(&photographs[0].path)
            ),
            (false, true) => Ok(Self::Films(films)),
            (true, false) if left_out.is_empty() => Ok(Self::Photographs(photographs)),
            (true, false) => Err(must_be_converted(&left_out)),
        }
    }

    /// The files, as they are given.
    pub(super) fn files(&self) -> Vec<&Path> {
        match self {
            Self::Films(films) => films.iter().map(PathBuf::as_path).collect(),
            Self::Photographs(photographs) => photographs.iter().map(|photograph| photograph.path.as_path()).collect(),
        }
    }

    /// Fails where a program that they need is not installed.
    pub(super) fn check_programs(&self) -> Result<()> {
        match self {
            Self::Films(_) => [FFMPEG, FFPROBE].into_iter().try_for_each(Needed::check),
            Self::Photographs(photographs) => {
                let needs = |treatment| photographs.iter().any(|photograph| photograph.treatment == treatment);
                let has_libheif = || HEIF_CONVERT.is_there() || HEIF_DEC.is_there();
                let has_all = !needs(Treatment::Heif) || has_libheif();
                let has_any = !needs(Treatment::Avif) || has_libheif() || FFMPEG.is_there();
                if has_all && has_any { Ok(()) } else { Err(HEIF_CONVERT.is_missing()) }
            }
        }
    }

    /// Whether these are photographs that lie in `images` of this folder, to be left where they are.
    pub(super) fn lies_in(&self, capture: &Path) -> bool {
        let Self::Photographs(photographs) = self else { return false };
        let Ok(images) = capture.join("images").canonicalize() else { return false };
        let is_there =
            |path: &Path| path.parent().and_then(|folder| folder.canonicalize().ok()).as_ref() == Some(&images);
        photographs.iter().all(|photograph| is_there(&photograph.path))
    }
}

/// With the names that photographs get; of a photograph in two formats the one that needs no conversion.
fn named(found: Vec<(PathBuf, Treatment)>) -> Result<Vec<Photograph>> {
    let mut photographs: Vec<Photograph> = Vec::new();
    let copied_first = |(_, treatment): &(PathBuf, Treatment)| *treatment != Treatment::Copied;
    let mut found = found;
    found.sort_by_key(copied_first);
    for (path, treatment) in found {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let is_converted = treatment != Treatment::Copied;
        let has_own_name = !is_converted && PHOTOGRAPH_EXTENSIONS.contains(&extension(&name).as_str());
        let name = if has_own_name { name } else { format!("{}.jpg", stem(&name)) };
        if name.contains(['\n', '\r', char::REPLACEMENT_CHARACTER]) {
            bail!("the name of `{}` is no text on one line, which COLMAP needs; rename the file", shown(&path));
        }
        let is_twin = |other: &&Photograph| stem(&other.name) == stem(&name) && other.path.parent() == path.parent();
        if is_converted && photographs.iter().any(|other| is_twin(&other)) {
            continue;
        }
        if let Some(other) = photographs.iter().find(|other| other.name == name) {
            bail!(
                "`{}` and `{}` would both be called {name}; rename one, or give one of their folders",
                shown(&other.path),
                shown(&path)
            );
        }
        photographs.push(Photograph { path, name, treatment });
    }
    photographs.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(photographs)
}

fn nothing_at(paths: &[PathBuf], left_out: &[PathBuf]) -> anyhow::Error {
    if !left_out.is_empty() {
        return must_be_converted(left_out);
    }
    if let Some((path, why)) = paths.iter().find_map(|path| closed_folder(path, 1)) {
        return anyhow::anyhow!("cannot reach `{}`: {why}; mend the link or the permissions", shown(&path));
    }
    let below: Vec<PathBuf> =
        paths.iter().flat_map(|path| with_photographs_below(path)).map(|(folder, _)| folder).collect();
    if !below.is_empty() {
        let folders: Vec<String> = below.iter().map(|folder| shell_word(folder).to_string()).collect();
        return anyhow::anyhow!(
            "the photographs lie one folder further in; give these in its place: {}",
            folders.join(" ")
        );
    }
    let names: Vec<String> = paths.iter().map(|path| format!("`{}`", shown(path))).collect();
    anyhow::anyhow!(
        "there are neither photographs nor films in {}; give a folder of JPEG, PNG, WebP, HEIC or AVIF photographs, or a film",
        names.join(", ")
    )
}

fn must_be_converted(left_out: &[PathBuf]) -> anyhow::Error {
    let first = &left_out[0];
    let all = first.with_file_name(format!("*.{}", first.extension().unwrap_or_default().to_string_lossy()));
    anyhow::anyhow!(
        "{} photographs are of formats that are not read, as `{}`; convert them, or take them out of the folder: \
         `magick mogrify -format jpg -quality 95 {}`",
        left_out.len(),
        shown(first),
        shell_word(&all)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const JPEG: &[u8] = b"\xff\xd8\xff\xe0";
    const HEIC: &[u8] = b"\0\0\0\x18ftypheic\0\0";
    const FILM: &[u8] = b"\0\0\0\x18ftypisom\0\0";

    fn folder(files: &[(&str, &[u8])]) -> tempfile::TempDir {
        let home = tempfile::tempdir().unwrap();
        for (name, bytes) in files {
            let path = home.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, bytes).unwrap();
        }
        home
    }

    fn given(home: &tempfile::TempDir) -> Result<Given> {
        Given::at(&[home.path().to_owned()])
    }

    #[test]
    fn photographs_are_known_by_their_bytes_and_renamed_where_their_names_say_otherwise() {
        let home =
            folder(&[("b.HEIC", HEIC), ("c.HEIC", JPEG), ("a.JPG", JPEG), ("a.heic", HEIC), ("a.cr2", b"II*\0")]);
        let Given::Photographs(found) = given(&home).unwrap() else { panic!("photographs") };
        let found: Vec<_> = found.iter().map(|p| (p.name.as_str(), p.treatment)).collect();
        use Treatment::{Copied, Heif};
        assert_eq!(found, [("a.JPG", Copied), ("b.jpg", Heif), ("c.jpg", Copied)]);
    }

    #[test]
    fn a_folder_of_images_goes_before_what_lies_beside_it_and_films_last() {
        let home = folder(&[("images/a.jpg", JPEG), ("b.jpg", JPEG), ("walk.mp4", FILM)]);
        let Given::Photographs(found) = given(&home).unwrap() else { panic!("photographs") };
        assert_eq!(found.len(), 1);
        assert!(given(&home).unwrap().lies_in(home.path()));
        let home = folder(&[("walk.mp4", FILM), ("old.avi", b"RIFF\0\0\0\0AVI "), ("notes.txt", b"hello")]);
        let Given::Films(found) = given(&home).unwrap() else { panic!("films") };
        assert_eq!(found, [home.path().join("old.avi"), home.path().join("walk.mp4")]);
    }

    #[test]
    fn what_cannot_be_used_is_named_with_a_remedy() {
        let said = |home: &tempfile::TempDir| given(home).unwrap_err().to_string();
        assert!(said(&folder(&[("notes.txt", b"hello")])).starts_with("there are neither photographs nor films in `"));
        let raw = said(&folder(&[("a.jpg", JPEG), ("b.CR2", b"II*\0")]));
        assert!(raw.starts_with("1 photographs are of formats") && raw.contains("/*.CR2'`"), "{raw}");
        let home = folder(&[("a.jpg", JPEG), ("walk.mp4", FILM)]);
        let both = Given::at(&[home.path().join("a.jpg"), home.path().join("walk.mp4")]).unwrap_err().to_string();
        assert!(both.contains("give the films or the photographs"), "{both}");
        let home = folder(&[("x/a.jpg", JPEG), ("y/a.jpg", JPEG)]);
        let twice = Given::at(&[home.path().join("x"), home.path().join("y")]).unwrap_err().to_string();
        assert!(twice.contains("would both be called a.jpg"), "{twice}");
        let rolls = folder(&[("roll 1/a.jpg", JPEG), ("roll 2/b.jpg", JPEG), ("empty/c.txt", b"hello")]);
        let further = said(&rolls);
        assert!(further.contains("one folder further in") && further.contains("/roll 1' '"), "{further}");
        let both = Given::at(&["roll 1", "roll 2"].map(|name| rolls.path().join(name))).unwrap();
        assert_eq!(both.files().len(), 2);
        let gone = Given::at(&[home.path().join("z")]).unwrap_err().to_string();
        assert!(gone.contains("is not there; give a folder of photographs, or a film"), "{gone}");
    }
}
