//! Captures damaged at random: loading and diagnosing end with an answer or an error, whatever the bytes.

use std::path::{Path, PathBuf};

use pocketsplat_capture::dataset::{LoadOptions, diagnose};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use crate::exports::{
    NSVF_MATRIX, write_bundler, write_llff, write_metashape, write_nsvf, write_opensfm, write_polycam,
    write_realitycapture, write_record3d,
};
use crate::fixture::{Fixture, Kind};

/// How many damaged captures of each layout are tried.
const N_TRIES: usize = 120;

/// All files of a capture but its images.
fn files_with_poses(folder: &Path) -> Vec<PathBuf> {
    let (mut files, mut waiting) = (Vec::new(), vec![folder.to_owned()]);
    while let Some(folder) = waiting.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder").flatten().map(|entry| entry.path()) {
            match entry.extension() {
                _ if entry.is_dir() => waiting.push(entry),
                Some(extension) if extension == "png" => {}
                _ => files.push(entry),
            }
        }
    }
    files.sort();
    files
}

/// Overwrites, removes or repeats a few bytes.
fn damage(bytes: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    for _ in 0..=rng.next_u32() % 4 {
        if bytes.is_empty() {
            return;
        }
        let at = rng.next_u64() as usize % bytes.len();
        let end = (at + 1 + rng.next_u32() as usize % 12).min(bytes.len());
        match rng.next_u32() % 4 {
            0 => bytes[at] = rng.next_u32() as u8,
            1 => bytes[at..end].fill([0, 0xFF, b'9', b'-'][rng.next_u32() as usize % 4]),
            2 => drop(bytes.drain(at..end)),
            _ => {
                let again = bytes[at..end].to_vec();
                bytes.splice(at..at, again);
            }
        }
    }
}

/// A layout and what writes it.
type Layout = (Kind, fn(&Fixture));

#[test]
fn no_damage_to_the_files_of_poses_makes_loading_panic() {
    fn as_it_is(fixture: &Fixture) {
        fixture.write_files();
    }
    let layouts: [Layout; 12] = [
        (Kind::Blender, as_it_is),
        (Kind::ColmapBinary, as_it_is),
        (Kind::ColmapText, as_it_is),
        (Kind::Nerfstudio, as_it_is),
        (Kind::Nerfstudio, |fixture| write_polycam(fixture, "cameras", "images")),
        (Kind::Nerfstudio, |fixture| write_record3d(fixture, "metadata", "rgbd", 0)),
        (Kind::Nerfstudio, |fixture| write_nsvf(fixture, NSVF_MATRIX, |_| "")),
        (Kind::Nerfstudio, |fixture| write_metashape(fixture, "frame")),
        (Kind::Nerfstudio, write_realitycapture),
        (Kind::Nerfstudio, |fixture| write_llff(fixture, "<f8", |number| number.to_le_bytes().to_vec())),
        (Kind::Nerfstudio, write_bundler),
        (Kind::Nerfstudio, write_opensfm),
    ];
    let mut rng = ChaCha8Rng::seed_from_u64(19);
    let options = LoadOptions { n_random_points: 10, ..LoadOptions::default() };
    for (kind, write) in layouts {
        let fixture = Fixture::new(kind, 4);
        write(&fixture);
        let files = files_with_poses(fixture.path());
        let mut n_refused = 0;
        for _ in 0..N_TRIES {
            let path = &files[rng.next_u64() as usize % files.len()];
            let sound = std::fs::read(path).expect("a file");
            let mut bytes = sound.clone();
            damage(&mut bytes, &mut rng);
            std::fs::write(path, bytes).expect("a file");
            n_refused += usize::from(fixture.load_with(&options).is_err());
            diagnose(fixture.path(), &options);
            std::fs::write(path, sound).expect("a file");
        }
        assert!(fixture.load_with(&options).is_ok(), "{kind:?}: sound again");
        assert!(n_refused > 0, "{kind:?}: damage was done");
    }
}
