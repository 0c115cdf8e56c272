//! A small capture, the program, and what a run on it ends in when nothing happens.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::OnceLock;

pub(crate) const ITERATIONS: u32 = 160;
/// Leaves a third of the capture's points, with which a step takes a third of the time.
pub(crate) const VOXEL_SIZE: &str = "0.2";
/// Iterations between checkpoints, and so what a `kill -9` may cost.
pub(crate) const CHECKPOINT_EVERY: u32 = 20;

pub(crate) fn pocketsplat() -> Command {
    Command::new(env!("CARGO_BIN_EXE_pocketsplat"))
}

/// A new folder for one test.
pub(crate) fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("runs").join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

/// The capture of all tests.
pub(crate) fn capture() -> &'static Path {
    static CAPTURE: OnceLock<PathBuf> = OnceLock::new();
    CAPTURE.get_or_init(|| {
        let path = folder("capture");
        let made = pocketsplat().arg("synth").arg(&path).args(["--size", "32", "--train-views", "6"]).output().unwrap();
        assert!(made.status.success(), "{}", text(&made.stderr));
        path
    })
}

/// The folder of a run that nothing interrupts.
pub(crate) fn undisturbed_run() -> &'static Path {
    static RUN: OnceLock<PathBuf> = OnceLock::new();
    RUN.get_or_init(|| {
        let output = folder("undisturbed").join("a.psb");
        succeeds(&mut train(&output));
        output.with_extension("run")
    })
}

/// Its bundle.
pub(crate) fn undisturbed() -> &'static [u8] {
    static BUNDLE: OnceLock<Vec<u8>> = OnceLock::new();
    BUNDLE.get_or_init(|| fs::read(undisturbed_run().with_extension("psb")).unwrap())
}

/// `train` on the capture.
pub(crate) fn train(output: &Path) -> Command {
    train_with(output, VOXEL_SIZE, CHECKPOINT_EVERY)
}

/// As [`train`], with another voxel size and another interval between checkpoints.
pub(crate) fn train_with(output: &Path, voxel_size: &str, checkpoint_every: u32) -> Command {
    let mut command = pocketsplat();
    command.arg("train").arg(capture()).arg("-o").arg(output);
    command.args(["--iterations", &ITERATIONS.to_string(), "--feature-dim", "8", "--offsets", "3"]);
    command.args(["--voxel-size", voxel_size, "--checkpoint-every", &checkpoint_every.to_string()]);
    command
}

/// `train --resume`.
pub(crate) fn resume(run: &Path) -> Command {
    let mut command = pocketsplat();
    command.arg("train").arg("--resume").arg(run);
    command
}

pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Runs the command to its end, which must be a good one; returns what it said.
pub(crate) fn succeeds(command: &mut Command) -> String {
    let Output { status, stderr, .. } = command.output().unwrap();
    assert!(status.success(), "{status}: {}", text(&stderr));
    text(&stderr)
}

/// Runs the command to its end, which must be exit code 1 with one line of error; returns the line.
pub(crate) fn fails(command: &mut Command) -> String {
    let Output { status, stderr, .. } = command.output().unwrap();
    let said = text(&stderr);
    assert_eq!(status.code(), Some(1), "{said}");
    let errors: Vec<&str> = said.lines().filter(|line| line.starts_with("error: ")).collect();
    assert_eq!(errors.len(), 1, "{said}");
    errors[0].to_owned()
}

/// Starts the command without waiting for it.
pub(crate) fn starts(command: &mut Command) -> Child {
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

/// The last iteration that the log of a run has a row for.
pub(crate) fn logged(run: &Path) -> u32 {
    let log = fs::read_to_string(run.join("progress.csv")).unwrap_or_default();
    log.lines().rev().find_map(|row| row.split(',').next()?.parse().ok()).unwrap_or(0)
}

/// Waits until the run has done so many iterations.
pub(crate) fn wait_for(run: &Path, iteration: u32, child: &mut Child) {
    while logged(run) < iteration {
        assert!(child.try_wait().unwrap().is_none(), "ended before iteration {iteration}");
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
}

/// The checkpoints in a run folder, oldest first.
pub(crate) fn checkpoints(run: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(run).unwrap().map(|entry| entry.unwrap().path());
    let mut found: Vec<_> = entries.filter(|path| path.extension().is_some_and(|e| e == "checkpoint")).collect();
    found.sort();
    found
}
