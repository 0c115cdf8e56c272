//! What is done in the folder of a capture: `poses.json`, by which the same command goes on.

use std::path::Path;

use anyhow::{Context, Result, bail};
use pocketsplat_files::shown;
use serde::{Deserialize, Serialize};

use super::taking::Taken;
use crate::command::outputs::keep;

/// The file in the folder of a capture.
pub(super) const FILE: &str = "poses.json";

/// What a search was asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Settings {
    /// The files that were given.
    pub(super) files: Vec<GivenFile>,
    /// Frames to take of the films.
    pub(super) frames: Option<usize>,
    pub(super) cameras: Cameras,
    pub(super) matching: Option<Matching>,
}

/// A file by what changes when it does; where it lies does not matter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct GivenFile {
    pub(super) name: String,
    pub(super) bytes: u64,
}

/// Whose lens it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Cameras {
    /// One took all photographs of a size.
    #[default]
    One,
    /// Each photograph has a lens of its own.
    Each,
}

/// Which photographs are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Matching {
    /// Each with each other.
    Exhaustive,
    /// Each with the next ones by name, and some of them with each other.
    Sequential,
}

/// What comes after what.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Stage {
    Photographs,
    Features,
    Matches,
    Model,
}

/// All that is known of a search for poses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct State {
    /// What wrote it.
    pub(super) program: String,
    pub(super) settings: Settings,
    /// Whether the photographs lay in `images` before, so that they are not ours.
    pub(super) in_place: bool,
    #[serde(default)]
    pub(super) photographs: Vec<Taken>,
    /// The number in COLMAP's database of the camera of each size, once features are looked for.
    #[serde(default)]
    pub(super) cameras: Vec<usize>,
    #[serde(default)]
    pub(super) finished: Vec<Stage>,
}

impl State {
    pub(super) fn new(settings: Settings, in_place: bool) -> Self {
        let program = format!("pocketsplat {}", crate::program::this());
        Self { program, settings, in_place, photographs: Vec::new(), cameras: Vec::new(), finished: Vec::new() }
    }

    /// That of a folder, if one stands there.
    pub(super) fn read(folder: &Path) -> Result<Option<Self>> {
        let path = folder.join(FILE);
        let text = match std::fs::read(&path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            read => read.with_context(|| format!("could not read {}", path.display()))?,
        };
        let state = serde_json::from_slice(&text);
        state
            .map(Some)
            .with_context(|| format!("`{}` was not written by this command; choose another --output", shown(&path)))
    }

    /// Writes it, as what is found from now on if this process ends.
    pub(super) fn write(&self, folder: &Path) -> Result<()> {
        keep(&folder.join(FILE), &serde_json::to_vec_pretty(self)?)
    }

    pub(super) fn is_done(&self, stage: Stage) -> bool {
        self.finished.contains(&stage)
    }

    /// Fails where this command asks for something else than the one that began.
    pub(super) fn check(&self, asked: &Settings, folder: &Path) -> Result<()> {
        if let Some(difference) = self.settings.difference(asked) {
            bail!(
                "the poses in `{}` were begun with another setting than the command line asks for: {difference}; give the \
                 same as before, choose another --output, or begin anew with `pocketsplat poses … --overwrite`",
                shown(folder)
            );
        }
        Ok(())
    }
}

impl Settings {
    /// What differs, with both values.
    fn difference(&self, asked: &Self) -> Option<String> {
        let options = [
            ("--frames", words(&self.frames), words(&asked.frames)),
            ("--cameras", words(&self.cameras), words(&asked.cameras)),
            ("--matching", words(&self.matching), words(&asked.matching)),
        ];
        if let Some((name, before, now)) = options.into_iter().find(|(_, before, now)| before != now) {
            return Some(format!("{name} was {before}, and is {now}"));
        }
        let missing = |from: &Self, file: &&GivenFile| !from.files.contains(file);
        let gone = self.files.iter().find(|file| missing(asked, file));
        let new = asked.files.iter().find(|file| missing(self, file));
        match (gone, new) {
            (None, None) => None,
            (Some(gone), Some(new)) if gone.name == new.name => Some(format!("{} has changed", gone.name)),
            (Some(gone), _) => Some(format!("{} was given", gone.name)),
            (None, Some(new)) => Some(format!("{} was not given", new.name)),
        }
    }
}

/// An option's value as the command line has it.
fn words(value: &impl Serialize) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(name)) => name,
        Ok(serde_json::Value::Null) | Err(_) => "left out".to_owned(),
        Ok(other) => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(files: &[(&str, u64)], frames: Option<usize>) -> Settings {
        let files = files.iter().map(|&(name, bytes)| GivenFile { name: name.to_owned(), bytes }).collect();
        Settings { files, frames, cameras: Cameras::One, matching: None }
    }

    #[test]
    fn what_is_done_is_found_again() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(State::read(folder.path()).unwrap(), None);
        let mut state = State::new(settings(&[("walk.mp4", 9)], Some(40)), false);
        state.photographs = vec![Taken { name: "frame_0001.jpg".into(), from: "walk.mp4".into(), at_s: Some(0.4) }];
        state.finished.push(Stage::Photographs);
        state.cameras = vec![1];
        state.write(folder.path()).unwrap();
        assert_eq!(State::read(folder.path()).unwrap(), Some(state));
        std::fs::write(folder.path().join(FILE), "[1, 2]").unwrap();
        let said = State::read(folder.path()).unwrap_err().to_string();
        assert!(said.contains("was not written by this command; choose another --output"), "{said}");
    }

    #[test]
    fn another_setting_is_named_with_both_values() {
        let begun = State::new(settings(&[("a.jpg", 1), ("b.jpg", 2)], None), false);
        let said = |asked: Settings| begun.check(&asked, Path::new("cup")).unwrap_err().to_string();
        let files = [("a.jpg", 1), ("b.jpg", 2)];
        begun.check(&settings(&files, None), Path::new("cup")).unwrap();
        assert!(said(settings(&files, Some(4))).contains("--frames was left out, and is 4; give the same as before"));
        let each = Settings { cameras: Cameras::Each, ..settings(&files, None) };
        assert!(said(each).contains("--cameras was one, and is each"));
        assert!(said(settings(&[("a.jpg", 1), ("b.jpg", 3)], None)).contains(": b.jpg has changed;"));
        assert!(said(settings(&[("a.jpg", 1)], None)).contains(": b.jpg was given;"));
        assert!(said(settings(&[("a.jpg", 1), ("b.jpg", 2), ("c.jpg", 3)], None)).contains(": c.jpg was not given;"));
    }
}
