//! Runs whose terminal goes away, or whose words nobody reads.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::fixture::{
    ITERATIONS, checkpoints, folder, pocketsplat, resume, starts, succeeds, text, train, undisturbed, wait_for,
};
use crate::interruption::{is_ignored, signal};

/// `command` in a shell that first does `before` and gives it these ends.
fn within(before: &str, command: &Command, ends: &str) -> Command {
    let mut shell = Command::new("sh");
    shell.arg("-c").arg(format!("{before} exec \"$@\" {ends}")).arg("sh");
    shell.arg(command.get_program()).args(command.get_args());
    shell
}

#[test]
fn a_run_goes_on_whatever_becomes_of_its_words() {
    let home = folder("terminal-closed");
    let output = home.join("a.psb");
    // A disk that is full, and no stderr at all.
    let has_full = Path::new("/dev/full").exists();
    for ends in if has_full { ["2>&-", "2>/dev/full"].as_slice() } else { &["2>&-"] } {
        assert!(within("", &train(&output), ends).status().unwrap().success(), "{ends}");
        assert!(fs::read(&output).unwrap() == undisturbed());
    }
    // A reader that has seen enough, of both.
    let mut child = train(&output).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop((child.stdout.take(), child.stderr.take()));
    assert!(child.wait().unwrap().success());
    assert!(fs::read(&output).unwrap() == undisturbed());
    if !has_full {
        eprintln!("skipped: there is no /dev/full");
        return;
    }
    // A result that is lost is a failure, though.
    let inspect = within("", pocketsplat().arg("inspect").arg(&output), ">/dev/full").output().unwrap();
    assert_eq!(inspect.status.code(), Some(1));
    assert!(text(&inspect.stderr).contains("could not write to stdout"), "{}", text(&inspect.stderr));
}

#[test]
fn a_run_in_the_background_outlives_its_terminal() {
    let home = folder("terminal-gone");
    let output = home.join("a.psb");
    // A pseudoterminal of Python's, closed while the run writes to it; SIGHUP is ignored, as after a logout.
    let script = "import os, pty, signal, subprocess, sys, time\n\
        master, slave = pty.openpty()\n\
        def alone():\n\x20os.setsid()\n\x20signal.signal(signal.SIGHUP, signal.SIG_IGN)\n\
        run = subprocess.Popen(sys.argv[1:], stdin=slave, stdout=slave, stderr=slave, preexec_fn=alone)\n\
        os.close(slave)\ntime.sleep(0.3)\nos.close(master)\nsys.exit(run.wait() % 256)\n";
    let command = train(&output);
    let mut python = Command::new("python3");
    python.arg("-c").arg(script).arg(command.get_program()).args(command.get_args());
    match python.status() {
        Err(error) => eprintln!("skipped: there is no python3 ({error})"),
        Ok(status) => {
            assert!(status.success(), "{status}");
            assert!(fs::read(&output).unwrap() == undisturbed());
        }
    }
}

#[test]
fn sighup_saves_a_run_and_is_ignored_where_it_was() {
    if is_ignored(1) {
        eprintln!("skipped: SIGHUP is ignored here, as under nohup");
        return;
    }
    let home = folder("terminal-hup");
    let (output, run) = (home.join("a.psb"), home.join("a.run"));
    let mut child = starts(&mut train(&output));
    wait_for(&run, ITERATIONS / 4, &mut child);
    // A closing terminal sends it, and so does its shell.
    signal(&child, "HUP");
    signal(&child, "HUP");
    let ended = child.wait_with_output().unwrap();
    assert_eq!(ended.status.code(), Some(130), "{}", text(&ended.stderr));
    assert!(!checkpoints(&run).is_empty() && text(&ended.stderr).contains("--resume"));
    succeeds(&mut resume(&run));
    assert!(fs::read(&output).unwrap() == undisturbed());

    let (output, run) = (home.join("b.psb"), home.join("b.run"));
    let mut child = starts(&mut within("trap '' HUP;", &train(&output), ""));
    wait_for(&run, ITERATIONS / 4, &mut child);
    signal(&child, "HUP");
    let ended = child.wait_with_output().unwrap();
    assert!(ended.status.success(), "{}", text(&ended.stderr));
    assert!(fs::read(&output).unwrap() == undisturbed());
}

#[test]
fn the_first_checkpoint_comes_within_seconds() {
    let home = folder("terminal-first");
    let (output, run) = (home.join("a.psb"), home.join("a.run"));
    let mut command = pocketsplat();
    command.arg("train").arg(crate::fixture::capture()).arg("-o").arg(&output).args(["--effects", "none"]);
    let mut child = starts(command.args(["--iterations", "1000000"]));
    while !run.join("progress.csv").exists() {
        assert!(child.try_wait().unwrap().is_none(), "ended before it began");
        std::thread::sleep(Duration::from_millis(20));
    }
    let started = Instant::now();
    while checkpoints(&run).is_empty() && started.elapsed() < Duration::from_secs(45) {
        std::thread::sleep(Duration::from_millis(100));
    }
    let found = checkpoints(&run);
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!found.is_empty(), "nothing to go on from after {:?}", started.elapsed());
}
