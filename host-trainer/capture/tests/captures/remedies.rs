//! Every remedy that reading a capture prints is done here once, and afterwards the capture loads whole and says it no more.
//!
//! What a foreign program does (COLMAP, ImageMagick, FFmpeg, unzip, Git LFS, nerfstudio) is quoted from its documentation and done by
//! hand: the file that it leaves is written where it leaves it.

mod commands;
mod doubts;
mod folders;
mod transforms;
mod views;

use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};
use pocketsplat_capture::dataset::{FrameSize, LoadOptions, diagnose, load};

use crate::exports::{NSVF_MATRIX, write_metashape, write_nsvf, write_polycam, write_record3d};
use crate::fixture::Kind::{Blender, ColmapBinary, ColmapText, Nerfstudio};
use crate::fixture::{FOCAL_PX, Fixture, Kind, SIZE_PX, photo};

/// A capture that lacks something, and what is to be done about it.
struct Trouble {
    name: &'static str,
    kind: Kind,
    break_it: fn(&mut Fixture),
    /// Part of the remedy as it is printed.
    remedy: &'static str,
    /// Does it; gives the folder and the options to load with.
    mend: fn(&mut Fixture, &str) -> (PathBuf, LoadOptions),
}

const N_VIEWS: usize = 12;

/// The same folder, as before.
fn again(fixture: &Fixture) -> (PathBuf, LoadOptions) {
    (fixture.path().to_owned(), LoadOptions::default())
}

fn with(fixture: &Fixture, options: LoadOptions) -> (PathBuf, LoadOptions) {
    (fixture.path().to_owned(), options)
}

/// What a message has in the last pair of backticks before `behind`.
fn named(message: &str, behind: &str) -> PathBuf {
    let (before, _) = message.split_once(behind).expect("the remedy names it");
    PathBuf::from(before.trim_end_matches('`').rsplit('`').next().expect("a name in backticks"))
}

fn trouble(name: &'static str, kind: Kind, break_it: fn(&mut Fixture)) -> Trouble {
    Trouble { name, kind, break_it, remedy: "", mend: |fixture, _| again(fixture) }
}

impl Trouble {
    fn remedy(self, remedy: &'static str, mend: fn(&mut Fixture, &str) -> (PathBuf, LoadOptions)) -> Self {
        Self { remedy, mend, ..self }
    }
}

/// Does what it says: before, the remedy is printed; afterwards all views load and nobody prints it.
fn check(trouble: &Trouble, options: &LoadOptions) {
    let name = trouble.name;
    let mut fixture = Fixture::new(trouble.kind, N_VIEWS);
    fixture.points = (0..120).map(|i| DVec3::new(0.01 * f64::from(i) - 0.6, 0.2, 0.05 * f64::from(i % 7))).collect();
    (trouble.break_it)(&mut fixture);
    let said = |path: &Path, options: &LoadOptions| {
        let loaded = load(path, options).map(|(capture, report)| (capture.train.len() + capture.test.len(), report));
        let diagnosis = diagnose(path, options).to_string();
        match loaded {
            Ok((n, report)) => (n, format!("{report}\n{diagnosis}")),
            Err(error) => (0, format!("{error}\n{diagnosis}")),
        }
    };
    let (_, before) = said(fixture.path(), options);
    assert!(before.contains(trouble.remedy), "{name}: `{}` is not in: {before}", trouble.remedy);
    let (path, options) = (trouble.mend)(&mut fixture, &before);
    let (n, after) = said(&path, &options);
    assert_eq!(n, N_VIEWS, "{name}: after the remedy: {after}");
    assert!(!after.contains(trouble.remedy), "{name}: is still told: {after}");
}

fn check_all(troubles: &[Trouble]) {
    troubles.iter().for_each(|trouble| check(trouble, &LoadOptions::default()));
}

/// Replaces text of a written file.
fn replace(fixture: &Fixture, file: &str, from: &str, to: &str) {
    let text = std::fs::read_to_string(fixture.at(file)).expect("written");
    assert!(text.contains(from), "{from} is not in {file}");
    fixture.write(file, text.replace(from, to));
}
