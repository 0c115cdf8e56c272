//! Full disks, folders that cannot be written, two processes in one folder, captures that change.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::Command;

use crate::fixture::{
    capture, checkpoints, fails, folder, pocketsplat, resume, starts, succeeds, text, train, undisturbed, wait_for,
};

/// Starts a run and kills it when it has checkpoints.
fn killed_run(home: &Path) {
    let mut child = starts(&mut train(&home.join("a.psb")));
    wait_for(&home.join("a.run"), 50, &mut child);
    child.kill().unwrap();
    child.wait().unwrap();
}

/// `command` in a shell that first does `before`.
fn after(before: &str, command: &Command) -> Command {
    let mut shell = Command::new("sh");
    shell.arg("-c").arg(format!("{before}; exec \"$@\"")).arg("sh").arg(command.get_program()).args(command.get_args());
    shell
}

#[test]
fn a_write_that_fails_ends_the_run_and_harms_nothing() {
    let home = folder("limit");
    let run = home.join("a.run");
    killed_run(&home);
    let before = checkpoints(&run);
    // Files may grow to some hundred kB: the configuration fits, a checkpoint does not.
    let error = fails(&mut after("trap '' XFSZ; ulimit -f 300", &resume(&run)));
    assert!(error.contains("could not write") && error.contains(".checkpoint"), "{error}");
    assert!(error.contains("--resume"), "{error}");
    assert_eq!(checkpoints(&run), before);
    assert!(fs::read_dir(&run).unwrap().all(|e| e.unwrap().path().extension().is_none_or(|e| e != "partial")));
    succeeds(&mut resume(&run));
    assert!(fs::read(home.join("a.psb")).unwrap() == undisturbed());
}

#[test]
fn a_full_disk_is_named() {
    let home = folder("full");
    // A disk of its own that only this process sees.
    let mount = format!("mount -t tmpfs -o size=2m tmpfs '{}'", home.display());
    let inside = |command: &Command| {
        let mut unshared = Command::new("unshare");
        let shell = after(&mount, command);
        unshared.args(["--mount", "--map-root-user"]).arg(shell.get_program()).args(shell.get_args());
        unshared
    };
    let possible = inside(&Command::new("true")).output();
    if !possible.is_ok_and(|output| output.status.success()) {
        eprintln!("skipped: no small disk can be mounted here");
        return;
    }
    let error = fails(&mut inside(&train(&home.join("a.psb"))));
    assert!(error.contains("could not write") && error.contains("No space left on device"), "{error}");
    assert!(error.contains(".checkpoint"), "{error}");
}

#[test]
fn what_cannot_be_had_costs_an_earlier_run_nothing() {
    let home = folder("nothing-lost");
    let output = home.join("a.psb");
    succeeds(train(&output).args(["--fork-at", "10"]));
    let files = |run: &str| {
        let files = fs::read_dir(home.join(run)).unwrap().map(|entry| entry.unwrap().path());
        files
            .filter(|path| path.is_file())
            .map(|path| (path.clone(), fs::read(path).unwrap()))
            .collect::<BTreeMap<_, _>>()
    };
    let before = files("a.run");
    let taken = std::net::TcpListener::bind(("127.0.0.1", 0)).unwrap();
    let watch = format!("--watch={}", taken.local_addr().unwrap().port());
    for unfit in [&[watch.as_str()][..], &["--device", "gpu:99"]] {
        // Drivers of GPUs complain on stderr where it is not set.
        fails(train(&output).args(unfit).env("XDG_RUNTIME_DIR", &home));
        assert!(files("a.run") == before, "{unfit:?}");
    }
    let mut fork = pocketsplat();
    fork.arg("train").arg("--from").arg(home.join("a.run")).args(["--at", "10", &watch, "-o"]);
    fails(fork.arg(home.join("b.psb")));
    assert!(!home.join("b.run").join("config.toml").exists(), "nothing was begun");
    let error = fails(&mut train(&home));
    assert!(error.contains("is a folder, and needs to be a file"), "{error}");
}

#[test]
fn a_folder_that_cannot_be_written_is_an_error_before_any_work() {
    let home = folder("read-only");
    fs::set_permissions(&home, fs::Permissions::from_mode(0o555)).unwrap();
    let mut commands = [train(&home.join("a.psb")), train(&home.join("../writable.psb"))];
    commands[1].arg("--run").arg(home.join("a.run"));
    let writable = folder("writable");
    fs::set_permissions(&writable, fs::Permissions::from_mode(0o777)).unwrap();
    let mut commands = commands.into_iter();
    let as_root = fs::metadata(&home).unwrap().uid() == 0;
    for command in commands.by_ref() {
        let mut command = command;
        if as_root {
            // Root may write anywhere; nobody may not.
            command.uid(65534).gid(65534);
            if !command.output().is_ok_and(|output| output.status.code() == Some(1)) {
                eprintln!("skipped: this is root, and nobody cannot run {:?}", pocketsplat().get_program());
                return;
            }
        }
        let error = fails(&mut command);
        assert!(error.contains("could not") && error.contains("Permission denied"), "{error}");
        assert!(!error.contains("training stopped"), "{error}");
    }
    fs::set_permissions(&home, fs::Permissions::from_mode(0o755)).unwrap();
    assert_eq!(fs::read_dir(&home).unwrap().count(), 0);
}

#[test]
fn a_second_process_in_the_folder_is_turned_away() {
    let home = folder("two");
    let (output, run) = (home.join("a.psb"), home.join("a.run"));
    let mut child = starts(&mut train(&output));
    wait_for(&run, 30, &mut child);
    let here = format!("error: another process works in {}", run.display());
    for mut second in [train(&output), resume(&run)] {
        let error = fails(&mut second);
        assert!(error.starts_with(&here), "{error}");
    }
    let error = fails(train(&output).arg("--overwrite"));
    assert!(error.starts_with(&here), "{error}");
    let ended = child.wait_with_output().unwrap();
    assert!(ended.status.success(), "the first is not disturbed: {}", text(&ended.stderr));
    assert!(fs::read(&output).unwrap() == undisturbed());
}

#[test]
fn an_unfinished_run_is_kept_until_it_is_given_up() {
    let home = folder("kept");
    let (output, run) = (home.join("a.psb"), home.join("a.run"));
    killed_run(&home);
    let error = fails(&mut train(&output));
    assert!(error.contains(&format!("pocketsplat train --resume {}", run.display())), "{error}");
    assert!(error.contains("--overwrite"), "{error}");
    succeeds(train(&output).arg("--overwrite"));
    assert!(fs::read(&output).unwrap() == undisturbed());
    let error = fails(&mut resume(&run));
    assert!(error.contains("is finished"), "{error}");
    let error = fails(&mut resume(&home));
    assert!(error.contains("is no run folder"), "{error}");
}

#[test]
fn a_capture_that_changed_is_named_and_one_that_moved_is_found() {
    let home = folder("changed");
    let run = home.join("a.run");
    killed_run(&home);
    let moved = home.join("moved");
    let copied = Command::new("cp").arg("-r").arg(capture()).arg(&moved).status().unwrap();
    assert!(copied.success());
    // One photograph takes the place of another.
    let photos = moved.join("train");
    let mut names: Vec<_> = fs::read_dir(&photos).unwrap().map(|e| e.unwrap().path()).collect();
    names.sort();
    let original = fs::read(&names[1]).unwrap();
    fs::copy(&names[0], &names[1]).unwrap();
    let error = fails(resume(&run).arg(&moved));
    assert!(error.contains("this is not the capture that the run began with: the pixels"), "{error}");
    fs::write(&names[1], original).unwrap();
    succeeds(resume(&run).arg(&moved));
    assert!(fs::read(home.join("a.psb")).unwrap() == undisturbed());
}
