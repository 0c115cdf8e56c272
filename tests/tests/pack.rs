//! The committed conformance pack is what its command writes, and the decoder keeps it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use conformance::pack::coverage::Found;
use conformance::pack::sample::Sample;
use conformance::pack::{self, FOLDERS, expected, refused};
use pocketsplat_codec::verify::{Trial, plan_variants};
use pocketsplat_core::{Budget, MaxSplats, Plan};
use pocketsplat_format::bundle::crc32;
use pocketsplat_instructions::level::Level;

/// Made once for all tests.
static SAMPLES: LazyLock<Vec<Sample>> = LazyLock::new(pack::bundles::samples);

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("pack")
}

/// The committed files but the README.
fn committed() -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    let read = |path: &Path| std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    for part in FOLDERS {
        for entry in std::fs::read_dir(folder().join(part)).expect("the committed pack") {
            let name = entry.expect("a file of the pack").file_name().into_string().expect("a name in ASCII");
            let path = format!("{part}/{name}");
            let bytes = read(&folder().join(&path));
            files.insert(path, bytes);
        }
    }
    files.insert("refused.json".to_owned(), read(&folder().join("refused.json")));
    files
}

#[test]
fn the_committed_pack_is_what_its_command_writes() {
    let (fresh, committed) = (pack::files(&SAMPLES), committed());
    let paths: BTreeSet<&String> = fresh.keys().chain(committed.keys()).collect();
    let different: Vec<&String> = paths.into_iter().filter(|path| fresh.get(*path) != committed.get(*path)).collect();
    assert!(
        different.is_empty(),
        "{different:?} differ; run `cargo run --release -p conformance --bin pack` and read the change"
    );
    let n_bytes: usize = committed.values().map(Vec::len).sum();
    assert!(n_bytes <= 1 << 20, "the pack has {n_bytes} bytes, more than 1 MiB");
}

#[test]
fn anchors_come_back_and_frames_are_the_same_with_every_plan() {
    for sample in &*SAMPLES {
        let name = &sample.name;
        let bundle = sample.bundle();
        assert_eq!(expected::decoded(&bundle).map(|chunks| chunks.concat()).as_ref(), Ok(&sample.anchors), "{name}");
        for (index, frame) in sample.frames().iter().enumerate() {
            let camera = frame.camera;
            let budget = Budget::for_frame(camera.width_px, camera.height_px).with_max_splats(MaxSplats::Worst);
            for variant in plan_variants(&bundle, budget.with_tiers(frame.tiers)) {
                let plan = Plan::new(&bundle, &variant).expect("planned");
                let drawn =
                    Trial::run(&bundle, plan, &camera, 0, 0).unwrap_or_else(|breach| panic!("{name}: {breach}"));
                assert_eq!(crc32(&drawn.rgb), crc32(&frame.rgb), "{name}, frame {index}: {plan:?}");
            }
        }
    }
}

#[test]
fn files_are_refused_for_the_reasons_that_they_were_made_for() {
    let files = refused::files();
    assert!(files.len() >= 40, "{} files to be refused", files.len());
    let mut names: Vec<&str> = files.iter().map(|file| file.name.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), files.len(), "each has a name of its own");
    let wrong: Vec<String> = files
        .iter()
        .filter_map(|file| match file.refusal() {
            Some(refusal) if refusal.error.starts_with(&file.expected) => None,
            other => Some(format!("{}: {}, but {other:?}", file.name, file.expected)),
        })
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_feature_kind_and_limit_of_the_format_occurs() {
    let mut found = Found::default();
    SAMPLES.iter().for_each(|sample| found.join(Found::of(sample)));
    let missing = found.missing();
    assert!(missing.is_empty(), "nothing in the pack has: {missing:#?}");
}

#[test]
fn declared_levels_are_the_least_that_hold() {
    for sample in &*SAMPLES {
        let bundle = sample.bundle();
        for tier in 0..bundle.n_tiers() {
            let declared = bundle.measures(tier).expect("a tier of the file").level;
            assert_eq!(declared, Level::least(&bundle, tier), "{}, tier {tier}", sample.name);
        }
    }
}
