//! The folder that a search for poses works in: a new one, one that it began before, or that of the photographs themselves.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use pocketsplat_capture::dataset::layout_of;
use pocketsplat_files::{Outputs, beside, shell_word, shown};

use super::inputs::Given;
use super::log::Log;
use super::state::{FILE, Settings, Stage, State};

/// What other programs said.
const LOG: &str = "poses.log";
/// Where models lie until the largest is known: those of each attempt.
const MODELS: [&str; 3] = ["models", "models-2", "models-3"];

/// Lists of photographs and of pairs, while COLMAP reads them.
pub(super) const LIST: &str = "poses-list.txt";
pub(super) const PAIRS: &str = "poses-pairs.txt";

/// A folder that a search works in, and no other.
pub(super) struct Place {
    pub(super) folder: PathBuf,
    pub(super) log: Log,
    pub(super) state: State,
}

impl Place {
    /// Takes the folder; makes it where there is none.
    ///
    /// * `overwrite`: whether what an earlier search with other settings left is removed.
    pub(super) fn open(folder: &Path, given: &Given, asked: Settings, overwrite: bool) -> Result<Self> {
        let lies_here = given.lies_in(folder);
        let begun = if folder.is_dir() { State::read(folder)? } else { None };
        // Where no stage is finished nothing is lost by a new beginning, and what an error asked for may have changed what is given.
        let begins_anew = begun.as_ref().filter(|state| overwrite || state.finished.is_empty());
        match (&begun, begins_anew) {
            (None, _) => refuse_foreign(folder, lies_here)?,
            (Some(_), Some(former)) if former.in_place && !lies_here => bail!(
                "the photographs in `{}` are your own, and now others are given; choose another --output, as {}",
                shown(&folder.join("images")),
                shell_word(&beside(folder, "-capture"))
            ),
            (Some(former), None) => former.check(&asked, folder)?,
            (Some(_), Some(_)) => {}
        }
        Outputs::folder(folder)?;
        let log = Log::open(&folder.join(LOG))?;
        let of_others = lies_here || begun.as_ref().is_some_and(|state| state.in_place);
        let clears = begins_anew.is_some();
        let state = begun.filter(|_| !clears).unwrap_or_else(|| State::new(asked, lies_here));
        let place = Self { folder: folder.to_owned(), log, state };
        if clears {
            place.clear(!of_others)?;
        }
        place.state.write(folder)?;
        Ok(place)
    }

    pub(super) fn images(&self) -> PathBuf {
        self.folder.join("images")
    }

    pub(super) fn database(&self) -> PathBuf {
        self.folder.join("database.db")
    }

    pub(super) fn sparse(&self) -> PathBuf {
        self.folder.join("sparse")
    }

    pub(super) fn models(&self) -> [PathBuf; 3] {
        MODELS.map(|name| self.folder.join(name))
    }

    /// A list that COLMAP reads.
    pub(super) fn list(&self, name: &str, lines: impl IntoIterator<Item = String>) -> Result<PathBuf> {
        let path = self.folder.join(name);
        let text: String = lines.into_iter().map(|line| line + "\n").collect();
        crate::command::outputs::keep(&path, text.as_bytes())?;
        Ok(path)
    }

    /// Notes that a stage is finished.
    pub(super) fn finish(&mut self, stage: Stage) -> Result<()> {
        self.state.finished.push(stage);
        self.state.write(&self.folder)
    }

    /// Removes what an earlier search made.
    ///
    /// * `images_too`: not where photographs lie here that it did not make.
    fn clear(&self, images_too: bool) -> Result<()> {
        if images_too {
            remove(&self.images())?;
        }
        for path in self.models().into_iter().chain([self.sparse(), self.database()]) {
            remove(&path)?;
        }
        // What SQLite leaves beside a database whose program was killed.
        for more in ["database.db-wal", "database.db-shm", "database.db-journal"] {
            remove(&self.folder.join(more))?;
        }
        Ok(())
    }
}

/// Removes a file or a folder of ours, if it is there.
pub(super) fn remove(path: &Path) -> Result<()> {
    let removed = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
    match removed {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(()),
        removed => removed.with_context(|| format!("could not remove {}", path.display())),
    }
}

/// Fails where the folder holds something that is not ours to work in.
fn refuse_foreign(folder: &Path, lies_here: bool) -> Result<()> {
    let path = shown(folder);
    if let Some(layout) = layout_of(folder) {
        bail!(
            "`{path}` is a {layout} capture and has poses; train on it: `pocketsplat train {} -o scene.psb`, or choose another \
             --output",
            shell_word(folder)
        );
    }
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    // A log is what is left of a search that was killed before it wrote anything else.
    let names: Vec<String> = names.filter(|name| name != LOG).collect();
    let ours = ["database.db", "sparse", LIST, PAIRS];
    let in_the_way = |name: &&String| !lies_here || ours.into_iter().chain(MODELS).any(|ours| ours == *name);
    if let Some(name) = names.iter().find(in_the_way) {
        bail!(
            "`{path}` holds {name} and no {FILE}, so it is no capture that this command began; choose another --output, as {}",
            shell_word(&beside(folder, "-capture"))
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::poses::state::Cameras;

    fn settings(frames: Option<usize>) -> Settings {
        Settings { files: Vec::new(), frames, cameras: Cameras::One, matching: None }
    }

    fn photographs(folder: &Path) -> Given {
        fs::create_dir_all(folder).unwrap();
        for name in ["a.jpg", "b.jpg", "c.jpg"] {
            fs::write(folder.join(name), b"\xff\xd8\xff\xe0").unwrap();
        }
        Given::at(&[folder.to_owned()]).unwrap()
    }

    #[test]
    fn a_folder_of_others_is_refused_and_left_as_it_is() {
        let home = tempfile::tempdir().unwrap();
        let given = photographs(&home.path().join("photos"));
        let opened = |folder: &Path| Place::open(folder, &given, settings(None), true).map(|_| ());
        let said = opened(home.path()).unwrap_err().to_string();
        assert!(said.contains("holds photos and no poses.json") && said.contains("--output"), "{said}");
        // Photographs without a folder `images` around them.
        let said = opened(&home.path().join("photos")).unwrap_err().to_string();
        assert!(said.contains("no poses.json"), "{said}");
        assert_eq!(fs::read_dir(home.path()).unwrap().count(), 1);
        let capture = home.path().join("capture");
        fs::create_dir_all(capture.join("sparse/0")).unwrap();
        fs::write(capture.join("sparse/0/images.bin"), "").unwrap();
        let said = opened(&capture).unwrap_err().to_string();
        assert!(said.contains("is a COLMAP capture and has poses; train on it: `pocketsplat train "), "{said}");
        opened(&home.path().join("new")).unwrap();
    }

    #[test]
    fn photographs_that_lie_in_the_capture_survive_a_new_beginning() {
        let home = tempfile::tempdir().unwrap();
        let capture = home.path().join("cup");
        let given = photographs(&capture.join("images"));
        // Before any stage is finished anything may be asked for.
        drop(Place::open(&capture, &given, settings(Some(7)), false).unwrap());
        let mut place = Place::open(&capture, &given, settings(None), false).unwrap();
        place.finish(Stage::Photographs).unwrap();
        drop(place);
        fs::write(capture.join("database.db"), "features").unwrap();
        let error = Place::open(&capture, &given, settings(Some(9)), false).err().unwrap().to_string();
        assert!(error.contains("--frames was left out, and is 9"), "{error}");
        assert!(capture.join("database.db").is_file(), "nothing is lost by an error");
        let place = Place::open(&capture, &given, settings(Some(9)), true).unwrap();
        assert!(place.state.in_place && !capture.join("database.db").exists());
        assert!(capture.join("images/a.jpg").is_file());
        let second = Place::open(&capture, &given, settings(Some(9)), false).err().unwrap().to_string();
        assert!(second.starts_with("another process looks for poses in"), "{second}");
    }

    #[test]
    fn what_is_given_is_never_removed() {
        let home = tempfile::tempdir().unwrap();
        let capture = home.path().join("cup");
        let given = photographs(&home.path().join("photos"));
        let mut place = Place::open(&capture, &given, settings(None), false).unwrap();
        place.finish(Stage::Photographs).unwrap();
        drop(place);
        // The copies of an earlier search, as photographs to begin with.
        let copies = photographs(&capture.join("images"));
        drop(Place::open(&capture, &copies, settings(None), true).unwrap());
        assert!(capture.join("images/a.jpg").is_file());
        // And others, where those lie that are now their owner's.
        let said = Place::open(&capture, &given, settings(None), true).err().unwrap().to_string();
        assert!(said.contains("are your own") && said.contains("cup-capture"), "{said}");
        assert!(capture.join("images/a.jpg").is_file());
    }

    #[test]
    fn a_log_alone_keeps_nobody_out_and_files_of_others_do() {
        let home = tempfile::tempdir().unwrap();
        let capture = home.path().join("cup");
        let given = photographs(&capture.join("images"));
        fs::write(capture.join(LOG), "killed").unwrap();
        drop(Place::open(&capture, &given, settings(None), false).unwrap());
        fs::remove_file(capture.join(FILE)).unwrap();
        fs::write(capture.join(LIST), "mine").unwrap();
        let said = Place::open(&capture, &given, settings(None), false).err().unwrap().to_string();
        assert!(said.contains("holds poses-list.txt"), "{said}");
    }
}
