//! The committed conformance pack is what its command writes, and the decoder keeps it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use conformance::pack::{self, FOLDERS, expected, refused};
use pocketsplat_core::bundle::crc32;
use pocketsplat_core::{Budget, MaxSplats};
use pocketsplat_trainer::verify::{Trial, plan_variants};

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
    let (fresh, committed) = (pack::files(), committed());
    let paths = |files: &BTreeMap<String, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
    let what_to_do = "run `cargo run --release -p conformance --bin pack` and read the change";
    assert_eq!(paths(&fresh), paths(&committed), "the names of the files differ; {what_to_do}");
    let different: Vec<&String> = fresh.keys().filter(|path| fresh[*path] != committed[*path]).collect();
    assert!(different.is_empty(), "{different:?} differ; {what_to_do}");
    let n_bytes: usize = committed.values().map(Vec::len).sum();
    assert!(n_bytes <= 1 << 20, "the pack has {n_bytes} bytes, more than 1 MiB");
}

#[test]
fn anchors_come_back_and_frames_are_the_same_with_every_plan() {
    for sample in pack::bundles::samples() {
        let name = &sample.name;
        let bundle = sample.bundle();
        assert_eq!(expected::decoded(&bundle).map(|chunks| chunks.concat()).as_ref(), Ok(&sample.anchors), "{name}");
        for (index, frame) in sample.frames().iter().enumerate() {
            let camera = frame.camera;
            let budget = Budget::for_frame(camera.width_px, camera.height_px).with_max_splats(MaxSplats::Worst);
            for variant in plan_variants(&bundle, budget.with_tiers(frame.tiers)) {
                let plan = bundle.plan(&variant).expect("planned");
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
