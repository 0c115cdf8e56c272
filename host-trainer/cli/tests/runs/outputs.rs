//! What outputs replace and what they leave: photographs, inputs, links, devices, files of other kinds.

use std::fs;
use std::os::unix::fs::{FileTypeExt as _, symlink};
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::fixture::{capture, fails, folder, pocketsplat, starts, succeeds, text, undisturbed, undisturbed_run};

fn golden() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden/static.psb")
}

fn copied_capture(home: &Path) -> PathBuf {
    let copy = home.join("capture");
    assert!(Command::new("cp").arg("-r").arg(capture()).arg(&copy).status().unwrap().success());
    copy
}

/// A file of Gaussians of the golden bundle.
fn splats(home: &Path) -> PathBuf {
    let splats = home.join("splats.ply");
    succeeds(pocketsplat().arg("export").arg(golden()).arg("-o").arg(&splats).args(["--iterations", "0"]));
    splats
}

/// `pocketsplat` with words, one of which is `{}`, the output.
fn command(words: &[&str], output: &Path) -> Command {
    let mut command = pocketsplat();
    for word in words {
        if *word == "{}" {
            command.arg(output)
        } else {
            command.arg(word)
        };
    }
    command
}

#[test]
fn what_a_command_reads_is_not_replaced_even_when_asked() {
    let home = folder("outputs-inputs");
    let capture = copied_capture(&home);
    let (photograph, other) = (capture.join("train/r_0.png"), home.join("other-name.png"));
    fs::hard_link(&photograph, &other).unwrap();
    let (link, unnamed) = (home.join("link.png"), home.join("unnamed"));
    symlink(&photograph, &link).unwrap();
    symlink(&photograph, &unnamed).unwrap();
    let bundle = home.join("a.psb");
    fs::copy(golden(), &bundle).unwrap();
    let page = home.join("a.html");
    fs::hard_link(&bundle, &page).unwrap();
    let log = home.join("progress.svg");
    fs::copy(undisturbed_run().join("progress.csv"), &log).unwrap();
    let splats = splats(&home);
    let [c, b, l, s] = [&capture, &bundle, &log, &splats].map(|path| path.to_str().unwrap());
    let model = capture.join("transforms_train.json");
    let config = home.join("config");
    fs::copy(undisturbed_run().join("config.toml"), &config).unwrap();
    let f = config.to_str().unwrap();
    let cases: [(&[&str], &Path); 12] = [
        (&["train", c, "-w", "-o", "{}"], &unnamed),
        (&["train", c, "--config", f, "-w", "-o", "{}"], &config),
        (&["render", b, c, "--view", "0", "-w", "-o", "{}"], &photograph),
        (&["render", b, c, "--view", "0", "-w", "-o", "{}"], &other),
        (&["render", b, c, "--all", "--contact-sheet", "-w", "-o", "{}"], &link),
        (&["view", b, "-w", "-o", "{}"], &page),
        (&["plot", l, "-w", "-o", "{}"], &log),
        (&["export", s, "-w", "-o", "{}"], &splats),
        (&["train", c, "--backbone", "3dgs", "-w", "-o", "{}"], &capture.join("points.ply")),
        (&["train", c, "-w", "-o", "{}"], &capture),
        (&["train", c, "-w", "-o", "{}"], &model),
        (&["train", c, "-w", "-o", "{}"], &photograph),
    ];
    fs::write(capture.join("points.ply"), "ply\nformat ascii 1.0\nelement vertex 0\nend_header\n").unwrap();
    for (words, output) in cases {
        let before = fs::read(output).ok();
        let said = fails(&mut command(words, output));
        let reasons = ["is what this command reads", "is a folder, and needs to be a file", "end the name in .psb"];
        assert!(reasons.iter().any(|reason| said.contains(reason)), "{words:?}: {said}");
        assert_eq!(fs::read(output).ok(), before, "{words:?}");
    }
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert!(!home.join("unnamed.run").exists(), "nothing was begun");
}

#[test]
fn photographs_that_lie_elsewhere_are_the_captures_too() {
    let home = folder("outputs-elsewhere");
    let capture = copied_capture(&home);
    fs::rename(capture.join("train"), home.join("train")).unwrap();
    for split in ["train", "test"] {
        let list = capture.join(format!("transforms_{split}.json"));
        let text = fs::read_to_string(&list).unwrap().replace("./train/", "../train/");
        fs::write(list, text).unwrap();
    }
    let photograph = home.join("train/r_0.png");
    let before = fs::read(&photograph).unwrap();
    let (b, c) = (golden(), capture);
    let words = ["render", b.to_str().unwrap(), c.to_str().unwrap(), "--view", "0", "-w", "-o", "{}"];
    let said = fails(&mut command(&words, &photograph));
    assert!(said.contains("is what this command reads"), "{said}");
    assert_eq!(fs::read(&photograph).unwrap(), before);
}

#[test]
fn a_file_of_another_kind_needs_overwrite() {
    let home = folder("outputs-kinds");
    let bundle = golden();
    let b = bundle.to_str().unwrap();
    let log = undisturbed_run().join("progress.csv");
    let l = log.to_str().unwrap();
    let splats = splats(&home);
    let s = splats.to_str().unwrap();
    let run = undisturbed_run().to_str().unwrap();
    let photograph: &[u8] = &fs::read(capture().join("train/r_1.png")).unwrap();
    let cases: [(&[&str], &str, &[u8]); 7] = [
        (&["render", b, "--preview", "-o", "{}"], "holiday.png", photograph),
        (&["render", b, "--preview", "-o", "{}"], "holiday.jpg", b"\xff\xd8\xff\xe1 Exif"),
        (&["render", b, "--orbit", "2", "-o", "{}"], "turn.gif", b"Dear diary"),
        (&["view", b, "-o", "{}"], "page.html", b"% not a page"),
        (&["plot", l, "-o", "{}"], "figure.svg", b"<?xml version=\"1.0\"?>\n<svg xmlns=\"drawn by hand\">"),
        (&["export", s, "-o", "{}"], "other.spz", b"PK\x03\x04"),
        (&["report", run, "-o", "{}"], "run.html", b"\x89PSB\r\n\x1a\n"),
    ];
    for (words, name, old) in cases {
        let path = home.join(name);
        fs::write(&path, old).unwrap();
        let said = fails(&mut command(words, &path));
        assert!(said.contains(name) && said.contains("--overwrite"), "{words:?}: {said}");
        assert_eq!(fs::read(&path).unwrap(), old, "{words:?}");
        succeeds(command(words, &path).arg("--overwrite"));
        // What is there now is ours.
        succeeds(&mut command(words, &path));
        assert_ne!(fs::read(&path).unwrap(), old);
    }
    // Numbered pictures in a folder of photographs.
    let photographs = home.join("photographs");
    fs::create_dir(&photographs).unwrap();
    fs::write(photographs.join("0001.png"), photograph).unwrap();
    let said = fails(&mut command(&["render", b, "--orbit", "3", "-o", "{}"], &photographs));
    assert!(said.contains("0001.png is a PNG picture that pocketsplat did not draw"), "{said}");
    assert_eq!(fs::read_dir(&photographs).unwrap().count(), 1, "none is written where one cannot be");
    for file in ["runs.csv", "runs.svg"] {
        let mine = home.join("compared");
        fs::create_dir_all(&mine).unwrap();
        fs::write(mine.join(file), "my own").unwrap();
        let said = fails(&mut command(&["compare", run, "-o", "{}"], &mine));
        assert!(said.contains(file), "{said}");
        assert_eq!(fs::read(mine.join(file)).unwrap(), b"my own");
        fs::remove_file(mine.join(file)).unwrap();
    }
}

#[test]
fn links_fifos_and_devices_stay_what_they_are() {
    let home = folder("outputs-special");
    let bundle = golden();
    let b = bundle.to_str().unwrap();
    fs::create_dir(home.join("elsewhere")).unwrap();
    symlink("elsewhere/page.html", home.join("link.html")).unwrap();
    for _ in 0..2 {
        succeeds(&mut command(&["view", b, "-o", "{}"], &home.join("link.html")));
        assert!(fs::symlink_metadata(home.join("link.html")).unwrap().is_symlink());
        assert!(fs::read(home.join("elsewhere/page.html")).unwrap().starts_with(b"<!doctype html>"));
    }
    let fifo = home.join("fifo.png");
    assert!(Command::new("mkfifo").arg(&fifo).status().unwrap().success());
    let child = starts(&mut command(&["render", b, "--preview", "-o", "{}"], &fifo));
    assert!(fs::read(&fifo).unwrap().starts_with(b"\x89PNG"));
    assert!(child.wait_with_output().unwrap().status.success());
    assert!(fs::metadata(&fifo).unwrap().file_type().is_fifo());
    // A node of our own.
    let node = home.join("null");
    if !Command::new("mknod").arg(&node).args(["c", "1", "3"]).status().is_ok_and(|status| status.success()) {
        eprintln!("skipped: no device can be made here");
        return;
    }
    let mut train = command(&["train", capture().to_str().unwrap(), "--iterations", "10", "-o", "{}"], &node);
    let said = succeeds(&mut train);
    assert!(fs::metadata(&node).unwrap().file_type().is_char_device());
    assert!(!said.contains("see it:") && !said.contains("warning: there is no report"), "nothing to see: {said}");
}

#[test]
fn a_name_of_another_format_is_refused_by_every_command() {
    let home = folder("outputs-names");
    let bundle = golden();
    let b = bundle.to_str().unwrap();
    let c = capture().to_str().unwrap();
    let splats = splats(&home);
    let s = splats.to_str().unwrap();
    let run = undisturbed_run().to_str().unwrap();
    let cases: [(&[&str], &str, &str); 11] = [
        (&["train", c, "-o", "{}"], "scene.ply", "export"),
        (&["train", c, "-o", "{}"], "scene.html", "view"),
        (&["train", c, "-o", "{}"], "scene.txt", "end the name in .psb"),
        (&["train", c, "--backbone", "3dgs", "-o", "{}"], "scene.psb", "without it, `train` writes a bundle"),
        (&["import", s, "-o", "{}"], "scene.spz", "export"),
        (&["export", b, "-o", "{}"], "scene.html", "view"),
        (&["export", s, "-o", "{}"], "scene.psb", "import"),
        (&["render", b, "--preview", "-o", "{}"], "scene.ply", "export"),
        (&["view", b, "-o", "{}"], "scene.png", "render"),
        (&["report", run, "-o", "{}"], "scene.psb", "end the name in .html"),
        (&["plot", "none.csv", "-o", "{}"], "scene.psb", "end the name in .svg"),
    ];
    for (words, name, expected) in cases {
        let said = fails(&mut command(words, &home.join(name)));
        assert!(said.contains(name) && said.contains(expected), "{words:?}: {said}");
        assert!(!home.join(name).exists());
    }
    let said = fails(&mut command(&["train", c, "--run", home.to_str().unwrap(), "-o", "{}"], &home.join("lock")));
    assert!(said.contains("is a file of the run itself"), "{said}");
}

#[test]
fn a_run_folder_that_is_not_ours_is_left_alone() {
    let home = folder("outputs-run");
    let output = home.join("a.psb");
    fs::write(home.join("a.run"), "mine").unwrap();
    let mut train = command(&["train", capture().to_str().unwrap(), "-w", "-o", "{}"], &output);
    let said = fails(&mut train);
    assert!(said.contains("a.run is a file") && said.contains("--run"), "{said}");
    assert_eq!(fs::read(home.join("a.run")).unwrap(), b"mine");
    fs::remove_file(home.join("a.run")).unwrap();
    fs::create_dir(home.join("a.run")).unwrap();
    fs::write(home.join("a.run/film.mp4.partial"), "mine").unwrap();
    let said = fails(&mut train);
    assert!(said.contains("holds files but no run"), "{said}");
    assert_eq!(fs::read_dir(home.join("a.run")).unwrap().count(), 1, "not even photographs are kept there");
}

#[test]
fn what_lies_beside_the_photographs_may_be_written_again() {
    let home = folder("outputs-beside");
    let capture = copied_capture(&home);
    let c = capture.to_str().unwrap();
    let (bundle, picture) = (capture.join("scene.psb"), capture.join("view.png"));
    fs::write(&bundle, undisturbed()).unwrap();
    for _ in 0..2 {
        let render = ["render", bundle.to_str().unwrap(), c, "--view", "0", "-o", "{}"];
        succeeds(&mut command(&render, &picture));
    }
    let said = command(&["train", c, "--iterations", "10", "-o", "{}"], &bundle).output().unwrap();
    assert!(said.status.success(), "{}", text(&said.stderr));
}
