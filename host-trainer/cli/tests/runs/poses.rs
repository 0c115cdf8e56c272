//! `pocketsplat poses` on the procedural capture, whose true poses are known: on its photographs alone, and on films of them.
//!
//! It needs COLMAP and, for films, ffmpeg. `POCKETSPLAT_NEEDS_COLMAP=1` fails where they are missing; else the tests say so and pass.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use pocketsplat_capture::dataset::{LoadOptions, PointsChoice, load};

use crate::fixture::{capture, fails, folder, pocketsplat, starts, succeeds, text};
use crate::interruption::{is_ignored, signal};
use crate::similarity::{Pose, offsets};

/// Photographs, all around and above.
const PHOTOGRAPHS: u32 = 40;
/// Frames of a film, each of which is compared with its neighbours: with 40, which lie farther apart, some films end in poses that are bent.
const FRAMES: u32 = 60;
/// Frames in a second of the film.
const RATE: f64 = 10.0;

fn has(programs: &[&str]) -> bool {
    let is_missing =
        |name: &&&str| Command::new(name).arg("-h").stdout(Stdio::null()).stderr(Stdio::null()).status().is_err();
    let missing: Vec<_> = programs.iter().filter(is_missing).collect();
    let is_needed = std::env::var_os("POCKETSPLAT_NEEDS_COLMAP").is_some();
    assert!(missing.is_empty() || !is_needed, "POCKETSPLAT_NEEDS_COLMAP is set, and there is no {missing:?}");
    if !missing.is_empty() {
        eprintln!("SKIPPED: there is no {missing:?}; `apt-get install colmap ffmpeg`");
    }
    missing.is_empty()
}

/// A capture of `n` views with their true poses.
fn truth(n: u32) -> PathBuf {
    let path = folder(&format!("poses-truth-{n}"));
    let mut synth = pocketsplat();
    synth.arg("synth").arg(&path).args(["--size", "256", "--train-views", &n.to_string(), "--test-views", "1"]);
    succeeds(&mut synth);
    path
}

/// The poses of a capture by the names of the views, without folder and ending.
fn poses_of(capture: &Path) -> BTreeMap<String, Pose> {
    let options = LoadOptions { points: Some(PointsChoice::Random), test_every: 0, ..LoadOptions::default() };
    let (capture, _) = load(capture, &options).unwrap();
    let stem = |name: &str| Path::new(name).file_stem().unwrap().to_string_lossy().into_owned();
    let views = capture.train.iter();
    views.map(|view| (stem(&view.name), (view.camera.centre_world(), view.camera.rotation))).collect()
}

/// * `name`: of the photograph that a found view is.
fn check(capture: &Path, truth: &Path, least: usize, name: impl Fn(&str) -> String) {
    let truth = poses_of(truth);
    let found = poses_of(capture);
    assert!(found.len() >= least, "{} of {least} views have poses", found.len());
    let (found, truth): (Vec<Pose>, Vec<Pose>) = found.iter().map(|(view, &pose)| (pose, truth[&name(view)])).unzip();
    let left = offsets(&found, &truth);
    eprintln!("{}: {} views, {left:?}", capture.display(), found.len());
    assert!(left.centre < 0.02 && left.degrees < 1.5, "{left:?}");
}

fn poses(of: &Path, capture: &Path) -> Command {
    let mut command = pocketsplat();
    command.arg("poses").arg(of).arg("-o").arg(capture);
    command
}

fn log(capture: &Path) -> String {
    fs::read_to_string(capture.join("poses.log")).unwrap_or_default()
}

fn wait_until(what: &str, is_so: impl Fn() -> bool) {
    let started = Instant::now();
    while !is_so() {
        assert!(started.elapsed() < Duration::from_secs(300), "{what} does not come");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn photographs_alone_give_the_true_poses_through_kills_and_signals() {
    if !has(&["colmap"]) {
        return;
    }
    let capture = folder("poses-photographs").join("it's a capture");
    let truth = truth(PHOTOGRAPHS);
    let photographs = truth.join("train");
    // Killed while it compares photographs; what it started ends with it.
    let mut child = starts(&mut poses(&photographs, &capture));
    wait_until("matching", || log(&capture).contains("Matching block [1/"));
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!capture.join("sparse").exists());
    let is_free = || fs::File::open(capture.join("poses.log")).is_ok_and(|file| file.try_lock().is_ok());
    wait_until("the end of what was killed", is_free);
    if is_ignored(15) {
        eprintln!("skipped: SIGTERM is ignored here");
    } else {
        let child = starts(&mut poses(&photographs, &capture));
        wait_until("the mapper", || log(&capture).contains("$ colmap mapper"));
        signal(&child, "TERM");
        let ended = child.wait_with_output().unwrap();
        let said = text(&ended.stderr);
        assert_eq!(ended.status.code(), Some(130), "{said}");
        assert!(said.contains("stopped; the same command goes on"), "{said}");
    }
    let done = poses(&photographs, &capture).arg("--json").output().unwrap();
    assert!(done.status.success(), "{}", text(&done.stderr));
    let report: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(report["photographs"], PHOTOGRAPHS, "{report}");
    assert_eq!(report["diagnosis"]["layout"], "colmap", "{report}");
    check(&capture, &truth, 36, str::to_owned);
    // No stage was done twice, but for the one that was killed.
    let said = log(&capture);
    assert_eq!(said.matches("$ colmap feature_extractor").count(), 1);
    assert_eq!(said.matches("$ colmap exhaustive_matcher").count(), 2);
    // All is done: the same again, at once, and another setting is no mixture.
    succeeds(&mut poses(&photographs, &capture));
    assert_eq!(log(&capture).matches("$ colmap").count(), said.matches("$ colmap").count());
    let refused = fails(poses(&photographs, &capture).args(["--cameras", "each"]));
    assert!(refused.contains("--cameras was one, and is each"), "{refused}");
    check(&capture, &truth, 36, str::to_owned);
}

/// The photographs as a person would pass them: each followed by the nearest that is left.
fn walk(truth: &Path) -> Vec<String> {
    let mut left = poses_of(truth);
    let mut order = vec![left.pop_first().unwrap()];
    while !left.is_empty() {
        let at = order.last().unwrap().1.0;
        let nearest = left.iter().min_by(|a, b| a.1.0.distance(at).total_cmp(&b.1.0.distance(at)));
        let name = nearest.unwrap().0.clone();
        order.extend(left.remove_entry(&name));
    }
    order.into_iter().map(|(name, _)| name).collect()
}

fn ffmpeg(arguments: &[&str], to: &Path) {
    let mut command = Command::new("ffmpeg");
    command.args(["-nostdin", "-v", "error", "-y"]).args(arguments).arg(to).stdout(Stdio::null());
    succeeds(&mut command);
}

#[test]
fn a_film_gives_the_true_poses_whichever_way_it_was_held() {
    if !has(&["colmap", "ffmpeg", "ffprobe"]) {
        return;
    }
    let home = folder("poses-film");
    let truth = truth(FRAMES);
    let walk = walk(&truth);
    for (i, name) in walk.iter().enumerate() {
        fs::copy(truth.join("train").join(format!("{name}.png")), home.join(format!("{i:03}.png"))).unwrap();
    }
    let frames = home.join("%03d.png");
    let (plain, turned) = (home.join("plain.mp4"), home.join("turned.mp4"));
    let rate = RATE.to_string();
    // Held on its side: the pixels lie, and the metadata say by how much.
    let lying = [
        "-framerate",
        &rate,
        "-i",
        frames.to_str().unwrap(),
        "-vf",
        "transpose=cclock",
        "-pix_fmt",
        "yuv420p",
        "-crf",
        "12",
    ];
    ffmpeg(&lying, &plain);
    // Versions of ffmpeg differ in how it is said, and in which way it counts.
    let plain = plain.to_str().unwrap();
    let tags: [(&[&str], &[&str]); 4] = [
        (&[], &["-metadata:s:v:0", "rotate=90"]),
        (&[], &["-metadata:s:v:0", "rotate=270"]),
        (&["-display_rotation", "-90"], &[]),
        (&["-display_rotation", "90"], &[]),
    ];
    let is_turned = tags.iter().any(|(before, behind)| {
        let input: Vec<&str> =
            [*before, &["-nostdin", "-v", "error", "-y", "-i", plain, "-c", "copy"], *behind].concat();
        let made = Command::new("ffmpeg").args(input).arg(&turned).output().unwrap();
        let probed = Command::new("ffprobe").args(["-v", "error", "-show_streams"]).arg(&turned).output().unwrap();
        made.status.success() && text(&probed.stdout).contains("rotation=-90")
    });
    assert!(is_turned, "ffmpeg turns no film");
    let capture = home.join("capture");
    // All of them: the steps are wide for a film.
    let said = succeeds(poses(&turned, &capture).args(["--frames", &FRAMES.to_string()]));
    assert!(said.contains("frames taken, the sharpest at an even overlap"), "{said}");
    let state: serde_json::Value = serde_json::from_slice(&fs::read(capture.join("poses.json")).unwrap()).unwrap();
    let photograph = |view: &str| {
        let frames = state["photographs"].as_array().unwrap();
        let frame = frames.iter().find(|frame| frame["name"] == format!("{view}.jpg")).unwrap();
        walk[(frame["at_s"].as_f64().unwrap() * RATE).round() as usize].clone()
    };
    // Upright, as it was filmed: no roll is left.
    check(&capture, &truth, 40, photograph);
}

#[test]
fn what_is_missing_is_named_before_anything_is_written() {
    let home = folder("poses-missing");
    let photographs = home.join("photographs");
    fs::create_dir(&photographs).unwrap();
    for name in ["r_0.png", "r_1.png", "r_2.png"] {
        fs::copy(capture().join("train").join(name), photographs.join(name)).unwrap();
    }
    let refused = fails(poses(&photographs, &home.join("a")).env("PATH", &home));
    assert!(refused.contains("`colmap` is not installed") && refused.contains("apt-get install colmap"), "{refused}");
    assert!(!home.join("a").exists());
    let mut train = pocketsplat();
    train.arg("train").arg(&photographs).arg("-o").arg(home.join("a.psb"));
    let refused = train.output().unwrap();
    let said = text(&refused.stderr);
    let command = format!("pocketsplat poses {} -o {}-capture", photographs.display(), photographs.display());
    assert!(!refused.status.success() && said.contains(&command) && said.contains("train --poses"), "{said}");
}
