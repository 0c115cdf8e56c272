//! Ctrl-C and `kill -9`.

use std::fs;
use std::process::{Child, Command};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::fixture::{
    CHECKPOINT_EVERY, ITERATIONS, VOXEL_SIZE, checkpoints, folder, logged, resume, starts, succeeds, text, train,
    train_with, undisturbed, wait_for,
};

/// The iteration after which the program says that it goes on.
fn going_on_after(said: &str) -> u32 {
    let after = said.split("going on after iteration ").nth(1).unwrap_or("0");
    after.split(' ').next().unwrap().parse().unwrap()
}

#[test]
fn kill_9_at_random_moments_costs_at_most_one_interval_and_no_bit() {
    let expected = undisturbed();
    let home = folder("kill");
    let (output, run) = (home.join("a.psb"), home.join("a.run"));
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut n_killed = 0;
    for _ in 0..3 {
        let mut command = train(&output);
        let mut reached = 0;
        for longest_ms in (900..).step_by(100) {
            let mut child = starts(&mut command);
            // Anywhere: while loading, in an iteration, in the middle of a checkpoint. Later and later, for a machine so
            // busy that nothing comes of a second.
            std::thread::sleep(std::time::Duration::from_millis(rng.random_range(30..longest_ms)));
            let ended = child.try_wait().unwrap().is_some();
            child.kill().unwrap();
            let said = text(&child.wait_with_output().unwrap().stderr);
            let from = going_on_after(&said);
            // Killed while still loading it says nothing yet.
            let began = said.contains("going on after") || said.contains("begins anew");
            assert!(!began || from + CHECKPOINT_EVERY >= reached, "reached {reached}, went on after {from}");
            if ended {
                assert!(!said.contains("error"), "{said}");
                assert!(checkpoints(&run).is_empty());
                break;
            }
            n_killed += 1;
            // Killed after its last word.
            if run.join("result.json").exists() {
                break;
            }
            // Before the first checkpoint there is nothing to go on from.
            reached = logged(&run);
            command = resume(&run);
            if !run.join("config.toml").exists() {
                command = train(&output);
            }
        }
        assert!(fs::read(&output).unwrap() == expected, "the same bytes after {n_killed} kills");
        fs::remove_dir_all(&run).unwrap();
        fs::remove_file(&output).unwrap();
    }
    assert!(n_killed >= 3, "{n_killed} kills are no test");
    eprintln!("killed {n_killed} times");
}

pub(crate) fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill").args([&format!("-{name}"), &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
}

/// Whether this process ignores a signal, and so what it starts: Ctrl-C in the background of a script.
pub(crate) fn is_ignored(number: u32) -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_some_and(|mask| mask >> (number - 1) & 1 == 1)
}

#[test]
fn ctrl_c_writes_a_checkpoint_and_says_how_to_go_on() {
    for (name, number) in [("INT", 2), ("TERM", 15)] {
        if is_ignored(number) {
            eprintln!("skipped: SIG{name} is ignored here");
            continue;
        }
        let home = folder(name);
        let (output, run) = (home.join("a.psb"), home.join("a.run"));
        let mut child = starts(&mut train_with(&output, VOXEL_SIZE, 0));
        wait_for(&run, ITERATIONS / 3, &mut child);
        signal(&child, name);
        let ended = child.wait_with_output().unwrap();
        let said = text(&ended.stderr);
        assert_eq!(ended.status.code(), Some(130), "{said}");
        let hint = format!("go on with `pocketsplat train --resume {}`", run.display());
        assert!(said.contains("interrupted after iteration ") && said.contains(&hint), "{said}");
        assert_eq!(checkpoints(&run).len(), 1);
        assert!(!output.exists());
        let reached = logged(&run);
        let said = succeeds(&mut resume(&run));
        assert!(going_on_after(&said) >= reached, "no iteration is lost");
        assert!(fs::read(&output).unwrap() == undisturbed(), "the same bytes");
    }
}

#[test]
fn a_damaged_checkpoint_costs_one_interval_more_and_no_bit() {
    let home = folder("damage");
    let (output, run) = (home.join("a.psb"), home.join("a.run"));
    let mut child = starts(&mut train(&output));
    wait_for(&run, 3 * CHECKPOINT_EVERY, &mut child);
    child.kill().unwrap();
    child.wait().unwrap();
    let newest = checkpoints(&run).pop().unwrap();
    let bytes = fs::read(&newest).unwrap();
    fs::write(&newest, &bytes[..bytes.len() / 2]).unwrap();
    let said = succeeds(&mut resume(&run));
    assert!(
        said.contains(&format!(
            "warning: a checkpoint is damaged, so the run goes on from an older one: {}",
            newest.display()
        )),
        "{said}"
    );
    assert!(fs::read(&output).unwrap() == undisturbed(), "the same bytes");
}
