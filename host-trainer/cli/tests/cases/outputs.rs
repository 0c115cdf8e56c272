//! What commands write, and to whom they speak.

use std::fs;

use crate::case::{Case, root, skipped};

const SHORT: [&str; 6] = ["--iterations", "60", "--max-resolution", "48", "-o", "scene.ply"];

#[test]
fn a_bundle_is_not_called_ply() {
    let Some(case) = Case::with_sound_capture("bundle-named-ply") else { return };
    let said = case.run(&[&["train", "capture"], &SHORT[..]].concat());
    said.refuses(&["scene.ply", ".psb"]);
    assert!(!case.folder.join("scene.ply").exists());
}

#[test]
fn a_device_stays_one() {
    let Some(case) = Case::with_sound_capture("output-is-a-device") else { return };
    if case.script("mknod", &["-m", "666", "probe", "c", "1", "3"]).code != Some(0) {
        skipped("a device: only root makes one");
        return;
    }
    case.script("sh", &["reproduce.sh", "capture"]).succeeds(&["character special file"]);
}

#[test]
fn a_photograph_is_not_replaced() {
    let Some(case) = Case::with_sound_capture("output-over-a-photograph") else { return };
    let photograph = case.folder.join("capture/images/img_005.jpg");
    let before = fs::read(&photograph).unwrap();
    for more in [&[][..], &["--overwrite"]] {
        let args = [&["train", "capture", "-o", "capture/images/img_005.jpg", "--iterations", "60"], more].concat();
        case.run(&args).refuses(&["img_005.jpg"]);
        assert_eq!(fs::read(&photograph).unwrap(), before);
    }
}

#[test]
fn nobody_has_to_listen() {
    let Some(case) = Case::with_sound_capture("stderr-closed-by-its-reader") else { return };
    let command = "pocketsplat train capture -o out.psb --iterations 600 --max-resolution 48 2>&1 | head -3";
    case.script("sh", &["-c", command]).succeeds(&[]);
    // `head` is gone long before the run has ended; the shell waits for both.
    assert!(case.folder.join("out.psb").is_file());
}

#[test]
fn a_terminal_may_go_away() {
    let Some(case) = Case::with_sound_capture("terminal-goes-away") else { return };
    case.script("python3", &["reproduce.py", "capture"]).succeeds(&["exit code 0 bundle True"]);
}

#[test]
fn sizes_of_the_web_package_are_checked() {
    let Some(case) = Case::with_sound_capture("web-package-sizes") else { return };
    if case.script("sh", &["-c", "command -v node"]).code != Some(0) {
        skipped("the web package: Node.js is missing");
        return;
    }
    let train = ["train", "capture", "-o", "scene.psb", "--iterations", "60", "--max-resolution", "48"];
    case.run(&train).succeeds(&[]);
    case.run(&["view", "scene.psb", "--package", "pkg"]).succeeds(&[]);
    let said = case.script("node", &["bind.mjs"]);
    said.succeeds(&["65856", "320.9", "-65216", "1000000000", "fast"]);
    said.does_not_say("accepted");
    said.does_not_say("cannot destructure");
}

#[test]
fn every_case_has_a_test() {
    if !root().is_dir() {
        return;
    }
    let sources = [
        include_str!("captures.rs"),
        include_str!("splats.rs"),
        include_str!("formats.rs"),
        include_str!("outputs.rs"),
        include_str!("main.rs"),
    ];
    for entry in fs::read_dir(root()).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        assert!(sources.iter().any(|source| source.contains(&format!("\"{name}\""))), "no test of {name}");
    }
}
