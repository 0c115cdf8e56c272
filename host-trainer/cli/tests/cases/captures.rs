//! Captures: names, masks, intrinsics, poses and layouts.

use std::path::PathBuf;

use crate::TRAINED_DB;
use crate::case::{Case, Said, TRAIN};

fn train(name: &str) -> Option<Said> {
    Case::find(name).map(|case| case.run(&TRAIN))
}

fn doctor(name: &str) -> Option<Said> {
    Case::find(name).map(|case| case.run(&["doctor", "capture"]))
}

/// A test for each case that has to train as `sound` does.
macro_rules! trains {
    ($($test:ident: $name:literal),* $(,)?) => {$(
        #[test]
        fn $test() {
            if let Some(said) = train($name) {
                said.trained(TRAINED_DB);
            }
        }
    )*};
}

trains! {
    a_camera_far_away: "colmap-one-camera-far-away",
    coordinates_of_a_map: "colmap-coordinates-of-a-map",
    names_composed_and_files_decomposed: "colmap-names-composed-files-decomposed",
    names_with_two_spaces: "colmap-txt-double-spaces",
    names_in_latin_1: "colmap-txt-names-in-latin-1",
    depth_maps_of_the_same_name: "depth-maps-of-the-same-name",
    photographs_converted_beside_heic: "heic-named-JPG-converted",
    masks_of_16_bits: "masks-of-16-bit-0-and-1",
    focal_y_in_the_frames: "transforms-focal-y-in-frames",
    only_a_width: "transforms-only-w",
}

#[test]
fn names_of_three_words_leave_no_photograph_out() {
    let Some(said) = train("colmap-txt-names-of-three-words") else { return };
    said.trained(TRAINED_DB);
    said.says(&["18 views to train, 3 to test"]);
}

#[test]
fn masks_in_the_alpha_channel_leave_the_bars_out() {
    if let Some(said) = train("masks-in-the-alpha-channel") {
        said.trained(23.0);
    }
}

#[test]
fn a_tiny_skew_is_no_other_format() {
    let Some(case) = Case::find("nsvf-tiny-skew") else { return };
    case.run(&["train", "capture", "-o", "out.psb", "--iterations", "800", "--max-resolution", "48"]).trained(25.0);
}

#[test]
fn two_photographs_are_not_one_file() {
    let Some(said) = train("colmap-two-folders-flattened") else { return };
    said.refuses(&["left/001.jpg", "right/001.jpg"]);
}

#[test]
fn printed_commands_are_taken_by_a_shell() {
    let Some(case) = Case::find("apostrophe-in-the-folder") else { return };
    let said = case.run(&["doctor", "Ann's photographs"]);
    let commands: Vec<&str> =
        said.text.lines().map(str::trim).filter(|line| line.starts_with("pocketsplat poses ")).collect();
    assert!(!commands.is_empty(), "{said}");
    for command in commands {
        // -n reads without running.
        case.script("sh", &["-n", "-c", command]).succeeds(&[]);
        assert!(command.contains(r"'Ann'\''s photographs"), "{command}");
    }
}

#[test]
fn a_fisheye_without_distortion_is_read() {
    let Some(said) = doctor("colmap-binary-simple-fisheye") else { return };
    said.succeeds(&["18 views to train"]);
}

#[test]
fn a_model_beside_the_images_is_read() {
    let Some(said) = doctor("colmap-model-beside-images") else { return };
    said.succeeds(&["18 views to train"]);
}

#[test]
fn corrected_folders_that_are_empty_are_not_read() {
    let Some(said) = doctor("polycam-empty-corrected-folders") else { return };
    said.succeeds(&["Polycam", "to train"]);
}

#[test]
fn one_picture_without_a_pose_is_left_out() {
    let Some(said) = doctor("record3d-nan-in-metadata") else { return };
    said.succeeds(&["Record3D", "to train"]);
}

#[test]
fn cameras_of_metashape_are_read_or_named() {
    let Some(said) = doctor("metashape-cameras-xml") else { return };
    said.says(&["Metashape"]);
    said.does_not_say("no poses");
}

#[test]
fn distortion_beyond_sense_is_no_note() {
    for name in ["colmap-radial-of-a-failed-calibration", "transforms-k1-of-a-failed-calibration"] {
        let Some(said) = doctor(name) else { return };
        said.refuses(&["error", "distortion"]);
    }
}

#[test]
fn pointers_of_git_lfs_are_named() {
    let Some(said) = doctor("git-lfs-pointer-photographs") else { return };
    said.refuses(&["Git LFS pointer", "git lfs pull"]);
}

#[test]
fn dynamic_masks_are_masks() {
    let Some(said) = doctor("instant-ngp-dynamic-masks") else { return };
    said.says(&["mask"]);
    said.does_not_say("without a pose");
}

#[test]
fn three_photographs_are_enough_without_test_views() {
    let Some(case) = Case::find("three-photographs") else { return };
    let with = |more: &[&str]| case.run(&[&["train", "capture", "-o", "out.psb", "--iterations", "60"], more].concat());
    with(&[]).refuses(&["--test-every 0"]);
    with(&["--test-every", "0"]).succeeds(&[]);
}

#[test]
fn photographs_in_the_layout_of_rendered_objects() {
    let Some(case) = Case::find("blender-layout-of-photographs") else { return };
    let fox: PathBuf = crate::case::root().join("../data/fox");
    let make = crate::case::root().join("blender-layout-of-photographs/make.py");
    if !fox.is_dir() {
        crate::case::skipped(&format!("photographs in the layout of objects: none in {}", fox.display()));
        return;
    }
    case.script("python3", &[&make.display().to_string(), "capture"]).succeeds(&[]);
    // A part of what the case's README trains: 1,500 steps at 200 px take a minute, and reach 29.9 dB.
    let said = case.run(&["train", "capture", "-o", "out.psb", "--iterations", "400", "--max-resolution", "100"]);
    said.trained(24.5);
}
