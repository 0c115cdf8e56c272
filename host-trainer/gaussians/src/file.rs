//! Files on disk: what they are by their bytes, and their Gaussians.

use std::fs;
use std::io::Read as _;
use std::path::Path;

use flate2::read::GzDecoder;
use pocketsplat_files::{FileKind, shell_word};
use serde::Deserialize;

use crate::{Account, FileError, Format, Gaussians, Notes, SpzAxes, Unreadable, glb, ply, sog, splat, spz};

/// What is read, as words.
const KNOWN: &str = ".ply (also compressed), .spz, .sog (also a folder with its meta.json), .splat and .glb are read";

/// Kinds of files that are read.
const READ: [FileKind; 6] =
    [FileKind::Ply, FileKind::Gzip, FileKind::RawSpz, FileKind::Zip, FileKind::Glb, FileKind::Json];

/// Reads the Gaussians of the file or folder at `path`, whatever its name ends in.
///
/// * `spz_axes`: of a .spz, whatever its record says.
///
/// # Errors
/// See [`FileError`].
pub fn read(path: &Path, spz_axes: Option<SpzAxes>) -> Result<(Gaussians, Notes), FileError> {
    let content = |fault| FileError::Content { path: path.to_owned(), fault };
    if path.is_dir() {
        return read_folder(path, &path.join(META)).map_err(content);
    }
    let named = ending(path);
    let is_read = |kind| match kind {
        Some(kind) => READ.contains(&kind),
        None => named == "splat",
    };
    let bytes = FileKind::read(path, is_read).map_err(|source| FileError::Read { path: path.to_owned(), source })?;
    let (found, result) = match FileKind::of(&bytes) {
        Some(FileKind::Ply) => ("ply", ply::read(&bytes)),
        Some(FileKind::Gzip | FileKind::RawSpz) => ("spz", spz::read(&bytes, spz_axes)),
        Some(FileKind::Zip) => ("sog", sog::read(&bytes)),
        Some(FileKind::Glb) => ("glb", glb::read(&bytes)),
        Some(FileKind::Json) => ("json", read_folder(path.parent().unwrap_or(Path::new("")), path)),
        None if named == "splat" => ("splat", splat::read(&bytes)),
        None if named == "ksplat" => ("ksplat", Err(converted(path, "is a .ksplat file of GaussianSplats3D"))),
        None => {
            let first = bytes[..bytes.len().min(8)].escape_ascii();
            let fault = Unreadable::new(format!("is no file of Gaussians: it begins with \"{first}\"; {KNOWN}"));
            (named.as_str(), Err(fault))
        }
        Some(kind) => return Err(FileError::Kind { path: path.to_owned(), kind, remedy: remedy(path, kind) }),
    };
    let (gaussians, mut notes) = result.map_err(content)?;
    if found != named && !is_known_beside(found, &named) {
        notes.remarks.push(format!("it is a .{found} file, whatever its name says"));
    }
    Ok((gaussians, notes))
}

impl Format {
    /// Reads the bytes of a file of this format, as after they were written.
    ///
    /// # Errors
    /// [`Unreadable`] says what was found.
    pub fn read(self, bytes: &[u8], spz_axes: Option<SpzAxes>) -> Result<(Gaussians, Notes), Unreadable> {
        match self {
            Self::Ply => ply::read(bytes),
            Self::Spz => spz::read(bytes, spz_axes),
            Self::Sog => sog::read(bytes),
            Self::Glb => glb::read(bytes),
        }
    }
}

/// Where the bytes of a file or folder went that [`read`] reads.
///
/// # Errors
/// [`FileError`] for every other one.
pub fn account(path: &Path) -> Result<Account, FileError> {
    let content = |fault| FileError::Content { path: path.to_owned(), fault };
    if path.is_dir() {
        return sog::account_of_folder(path).map_err(content);
    }
    let bytes = fs::read(path).map_err(|source| FileError::Read { path: path.to_owned(), source })?;
    match FileKind::of(&bytes) {
        Some(FileKind::Ply) => ply::account(&bytes),
        Some(FileKind::Gzip | FileKind::RawSpz) => spz::account(&bytes),
        Some(FileKind::Zip) => sog::account(&bytes),
        Some(FileKind::Glb) => glb::account(&bytes),
        Some(FileKind::Json) => sog::account_of_folder(path.parent().unwrap_or(Path::new(""))),
        _ => Ok(splat::account(&bytes)),
    }
    .map_err(content)
}

/// Whether what stands at `path` is to be read as Gaussians: by its bytes, and where they say nothing by its name.
pub fn is_one(path: &Path) -> bool {
    if path.is_dir() {
        return manifest(&path.join(META)).is_some_and(|manifest| manifest.is_ours());
    }
    let named = ending(path);
    let is_named = ["ply", "spz", "sog", "splat", "ksplat", "glb"].contains(&named.as_str());
    // The bytes of a pipe can be read once.
    if !path.is_file() {
        return is_named;
    }
    match FileKind::of_file(path) {
        Ok(Some(FileKind::Ply | FileKind::RawSpz | FileKind::Glb)) => true,
        Ok(Some(FileKind::Bundle)) => false,
        Ok(Some(FileKind::Gzip)) => is_named || is_gzip_of_spz(path),
        Ok(Some(FileKind::Json)) => is_named || manifest(path).is_some_and(|manifest| manifest.is_ours()),
        _ => is_named,
    }
}

const META: &str = "meta.json";

/// What is looked at of a JSON file: of a .sog's, and of a scene in levels of detail.
#[derive(Deserialize)]
struct Manifest {
    means: Option<serde_json::Value>,
    quats: Option<serde_json::Value>,
    #[serde(rename = "lodLevels")]
    levels: Option<serde_json::Value>,
}

impl Manifest {
    fn is_sog(&self) -> bool {
        self.means.is_some() && self.quats.is_some()
    }

    fn is_ours(&self) -> bool {
        self.is_sog() || self.levels.is_some()
    }
}

/// `None` for what is no object in JSON.
fn manifest(path: &Path) -> Option<Manifest> {
    serde_json::from_slice(&fs::read(path).ok()?).ok()
}

/// An unbundled .sog.
///
/// * `json`: its `meta.json`.
fn read_folder(folder: &Path, json: &Path) -> Result<(Gaussians, Notes), Unreadable> {
    match manifest(json) {
        Some(manifest) if manifest.is_sog() => sog::read_folder(folder),
        Some(manifest) if manifest.levels.is_some() => Err(converted(json, "is a scene in levels of detail")),
        Some(_) => Err(Unreadable::new(format!("is a JSON file, but no meta.json of an unbundled .sog; {KNOWN}"))),
        None if json.is_file() => Err(Unreadable::new(format!("is a JSON file that cannot be read; {KNOWN}"))),
        None if folder.join("lod-meta.json").is_file() => {
            Err(converted(&folder.join("lod-meta.json"), "is a scene in levels of detail"))
        }
        None => Err(Unreadable::new(format!("is a folder without the {META} of an unbundled .sog; {KNOWN}"))),
    }
}

/// Names the program that makes a .ply of it.
fn converted(path: &Path, what: &str) -> Unreadable {
    let word = shell_word(path);
    let out = shell_word(&path.with_extension("ply"));
    Unreadable::new(format!(
        "{what}, which is not read; make a .ply of it with `splat-transform {word} {out}` (from npm: @playcanvas/splat-transform)"
    ))
}

/// What to do with a file of another kind.
fn remedy(path: &Path, kind: FileKind) -> String {
    match kind {
        FileKind::Bundle => {
            format!("make Gaussians of it with `pocketsplat export {} -o scene.ply`", shell_word(path))
        }
        other => other.remedy().map_or_else(|| KNOWN.to_owned(), str::to_owned),
    }
}

/// Endings that a format has beside its own.
fn is_known_beside(found: &str, named: &str) -> bool {
    matches!((found, named), ("sog", "zip"))
}

/// What a name ends in, in lower case; nothing where there is no ending.
fn ending(path: &Path) -> String {
    path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default()
}

fn is_gzip_of_spz(path: &Path) -> bool {
    let mut first = [0; 4];
    fs::File::open(path).is_ok_and(|file| GzDecoder::new(file).read_exact(&mut first).is_ok() && first == *b"NGSP")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Degree;
    use crate::tests::of_degree;

    fn folder() -> tempfile::TempDir {
        tempfile::tempdir().expect("a temporary folder")
    }

    #[test]
    fn a_file_is_what_its_bytes_are() {
        let home = folder();
        for format in Format::ALL {
            let bytes = format.write(&of_degree(Degree::One, 9), &Notes::default()).expect("fits").bytes;
            for name in ["a.ply", "b.SPZ", "c.sog", "d.splat", "e.psb", "f"] {
                let path = home.path().join(name);
                fs::write(&path, &bytes).expect("room");
                assert!(is_one(&path) || format != Format::Ply, "{name}");
                let (gaussians, notes) = read(&path, None).expect("ours");
                assert_eq!((gaussians.len(), gaussians.degree), (9, Degree::One), "{format:?} as {name}");
                let said = format!("it is a .{} file, whatever its name says", format.extension());
                let is_said = notes.remarks.contains(&said);
                assert_eq!(is_said, Format::of_path(&path) != Some(format), "{format:?} as {name}: {notes:?}");
            }
        }
    }

    #[test]
    fn an_unbundled_sog_is_read_by_its_json_or_its_folder() {
        let home = folder();
        let bytes = Format::Sog.write(&of_degree(Degree::Two, 9), &Notes::default()).expect("fits").bytes;
        sog::unpack_for_tests(&bytes, home.path());
        let json = home.path().join(META);
        let whole = sog::read(&bytes).expect("ours").0;
        assert!(is_one(&json) && is_one(home.path()));
        assert_eq!(read(&json, None).expect("a file").0, whole);
        assert_eq!(read(home.path(), None).expect("a folder").0, whole);
        fs::remove_file(home.path().join("quats.webp")).expect("there");
        let said = read(&json, None).expect_err("incomplete").to_string();
        assert!(said.contains("quats.webp beside it cannot be read"), "{said}");
    }

    #[test]
    fn what_is_no_gaussians_is_named_with_a_remedy() {
        let home = folder();
        let refused = |name: &str, bytes: &[u8], expected: &[&str]| {
            let path = home.path().join(name);
            fs::write(&path, bytes).expect("room");
            let said = read(&path, None).expect_err("no Gaussians").to_string();
            for part in expected {
                assert!(said.contains(part), "{name}: {said}");
            }
            is_one(&path)
        };
        assert!(refused("a.spz", b"<!DOCTYPE html><html>", &["a web page", "fetch the file itself again"]));
        assert!(refused(
            "a.ply",
            b"version https://git-lfs.github.com/spec/v1\n",
            &["Git LFS pointer", "`git lfs pull`"]
        ));
        assert!(refused("a.sog", b"", &["an empty file", "download it again"]));
        assert!(!refused("b.ply", b"\x89PSB\r\n\x1a\n....", &["a bundle", "pocketsplat export"]));
        assert!(refused("a b.ksplat", &[0, 1, 0, 0], &[".ksplat file", "splat-transform '", "a b.ply'"]));
        assert!(refused("a.glb", b"glTF\x02\0\0\0", &["is cut off"]));
        assert!(refused("lod-meta.json", b"{\"lodLevels\": 3}", &["levels of detail", "splat-transform"]));
        assert!(!refused("other.json", b"{\"frames\": []}", &["no meta.json of an unbundled .sog"]));
        assert!(!refused("noise.bin", b"12345678", &["begins with \"12345678\"", "are read"]));
        let said = read(&home.path().join("none.ply"), None).expect_err("missing").to_string();
        assert!(said.ends_with("none.ply cannot be read"), "{said}");
    }

    #[test]
    fn names_of_a_meta_json_stay_in_their_folder() {
        let home = folder();
        let bytes = Format::Sog.write(&of_degree(Degree::Zero, 9), &Notes::default()).expect("fits").bytes;
        sog::unpack_for_tests(&bytes, home.path());
        let json = home.path().join(META);
        let text = fs::read_to_string(&json).expect("there").replace("quats.webp", "../quats.webp");
        fs::write(&json, text).expect("room");
        let said = read(&json, None).expect_err("outside").to_string();
        assert!(said.contains("`../quats.webp`, which is not beside it"), "{said}");
    }

    #[test]
    fn the_parts_are_the_whole() {
        let home = folder();
        for format in Format::ALL {
            let bytes = format.write(&of_degree(Degree::One, 40), &Notes::default()).expect("fits").bytes;
            let path = home.path().join("a");
            fs::write(&path, &bytes).expect("room");
            let account = account(&path).expect("ours");
            let sum: usize = account.parts.iter().map(|part| part.bytes).sum();
            let of = |name: &str| account.parts.iter().find(|part| part.name == name).map(|part| part.bytes);
            match format {
                Format::Ply => {
                    assert_eq!(
                        (sum, of("centres"), of("harmonics")),
                        (bytes.len(), Some(480), Some(40 * 36)),
                        "{account:?}"
                    );
                }
                Format::Spz => {
                    assert_eq!(
                        (of("centres"), of("rotations"), account.packed_by),
                        (Some(360), Some(160), Some("gzip"))
                    );
                }
                Format::Sog => assert!(sum <= bytes.len() && of("means_l.webp").is_some(), "{account:?}"),
                Format::Glb => assert_eq!(
                    (sum, of("centres"), of("harmonics"), of("fallback colours")),
                    (bytes.len(), Some(480), Some(40 * 36), Some(320)),
                    "{account:?}"
                ),
            }
        }
    }
}
