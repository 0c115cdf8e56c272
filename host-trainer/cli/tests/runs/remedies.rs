//! Every command that an error, a warning or a result names is run as it is printed, by a shell.

use std::ffi::OsString;
use std::fs::{self, File};
use std::os::unix::ffi::OsStringExt as _;
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::fixture::{capture, folder, pocketsplat, starts, text, train, undisturbed, wait_for};
use crate::interruption::signal;

/// The commands that a text names: in backticks, or behind `see it:` and its like.
pub(crate) fn commands_in(said: &str) -> Vec<String> {
    let quoted = said.split('`').skip(1).step_by(2).map(str::to_owned);
    let offered = said.lines().filter_map(|line| Some(line.split_once(":  ")?.1.trim().to_owned()));
    let mut commands: Vec<String> =
        quoted.chain(offered).filter(|command| command.starts_with("pocketsplat ")).collect();
    commands.dedup();
    commands
}

/// Runs a command as a person would who copies it, in the folder `at`: to its end, an import until it trains.
pub(crate) fn works(at: &Path, command: &str) {
    let own = Path::new(env!("CARGO_BIN_EXE_pocketsplat")).parent().unwrap();
    let path = std::env::join_paths(
        [own.to_owned()].into_iter().chain(std::env::split_paths(&std::env::var_os("PATH").unwrap())),
    );
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("stderr");
    let mut shell = Command::new("sh");
    shell.arg("-c").arg(command).current_dir(at).env("PATH", path.unwrap());
    shell.stdout(Stdio::null()).stderr(File::create(&log).unwrap()).process_group(0);
    let mut child = shell.spawn().unwrap();
    let (started, said) = (Instant::now(), || text(&fs::read(&log).unwrap()));
    while started.elapsed() < Duration::from_secs(300) {
        if let Some(status) = child.try_wait().unwrap() {
            assert!(status.success(), "{command}: {}", said());
            return;
        }
        if command.contains(" import ") && said().contains(" it/s ") {
            // The shell and what it started.
            let killed = Command::new("kill").args(["-9", "--", &format!("-{}", child.id())]).status();
            assert!(killed.unwrap().success());
            child.wait().unwrap();
            return;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    panic!("{command} does not begin: {}", said());
}

/// What a command says that has to fail, or to succeed.
fn says(command: &mut Command, succeeds: bool) -> String {
    let output = command.output().unwrap();
    let said = text(&output.stderr);
    assert_eq!(output.status.success(), succeeds, "{command:?}: {said}");
    said
}

/// Runs every command that `said` names, of which there have to be some with each of these words.
fn all_work(at: &Path, said: &str, words: &[&str]) {
    let commands = commands_in(said);
    for word in words {
        assert!(commands.iter().any(|command| command.contains(word)), "{word}: {commands:?} in {said}");
    }
    for command in commands {
        works(at, &command);
    }
}

/// A folder whose name a shell would take apart.
fn home(name: &str) -> PathBuf {
    let home = folder(name).join("it's $HOME; 100 %");
    fs::create_dir(&home).unwrap();
    home
}

#[test]
fn a_run_that_stopped_goes_on_by_the_command_that_it_names() {
    let home = home("remedies-run");
    let output = home.join("a.psb");
    let stopped = |at: &str| {
        let output = home.join(at);
        let mut child = starts(&mut train(&output));
        wait_for(&output.with_extension("run"), 40, &mut child);
        signal(&child, "TERM");
        text(&child.wait_with_output().unwrap().stderr)
    };
    all_work(&home, &stopped("a.psb"), &["train --resume"]);
    assert!(fs::read(&output).unwrap() == undisturbed());
    // What a finished run offers: its paths are those that the user gave.
    let said = says(train(&output).arg("--overwrite"), true);
    all_work(&home, &said, &["render ", "fit "]);
    assert!(home.join("view.png").is_file());

    stopped("b.psb");
    let run = home.join("b.run");
    all_work(&home, &says(&mut train(&home.join("b.psb")), false), &["train --resume"]);
    fs::remove_file(run.join("result.json")).unwrap();
    all_work(&home, &says(pocketsplat().arg("report").arg(&run), false), &["train --resume"]);
}

#[test]
fn what_is_of_another_format_is_made_by_the_command_that_is_named() {
    let home = home("remedies-formats");
    let bundle = home.join("a.psb");
    fs::write(&bundle, undisturbed()).unwrap();
    // Of a bundle that is yet to be written under the name that is advised.
    for name in ["a.ply", "a.html", "a.png", "a.gif"] {
        let mut train = pocketsplat();
        train.arg("train").arg(capture()).arg("-o").arg(home.join(name));
        let said = says(&mut train, false);
        if name != "a.ply" {
            all_work(&home, &said, &["-o"]);
            assert!(home.join(name).is_file(), "{name}");
            continue;
        }
        // Without the minutes that fitting takes.
        let [command] = commands_in(&said).try_into().unwrap();
        works(&home, &format!("{command} --iterations 0"));
    }
    let splats = home.join("a.ply");
    let from = |command: &str, file: &Path, to: &str| {
        let mut one = pocketsplat();
        one.arg(command).arg(file).arg("-o").arg(home.join(to));
        one
    };
    all_work(&home, &says(&mut from("export", &bundle, "b.html"), false), &["view "]);
    let said = says(from("render", &bundle, "b.spz").arg("--preview"), false);
    let [command] = commands_in(&said).try_into().unwrap();
    works(&home, &format!("{command} --iterations 0"));
    all_work(&home, &says(&mut from("view", &bundle, "b.jpg"), false), &["render "]);
    all_work(&home, &says(&mut from("export", &splats, "c.psb"), false), &["import "]);
    all_work(&home, &says(pocketsplat().arg("fit").arg(&splats), false), &["import "]);
}

#[test]
fn gaussians_of_a_run_are_compressed_by_the_command_that_it_names() {
    let home = home("remedies-3dgs");
    let mut train = pocketsplat();
    train.arg("train").arg(capture()).args(["--backbone", "3dgs", "--iterations", "20", "-o"]).arg(home.join("a.ply"));
    train.args(["--set", "capture.n_random_points=2000"]);
    all_work(&home, &says(&mut train, true), &["import "]);
}

#[test]
fn a_path_that_is_no_text_is_named_so_that_a_shell_finds_it() {
    let home = folder("remedies-bytes");
    // Linux takes any bytes, other systems text alone.
    let odd = home.join(OsString::from_vec(b"caf\xe9 'x'.run".to_vec()));
    if fs::create_dir(&odd).is_err() {
        eprintln!("skipped: names are text here");
        return;
    }
    fs::remove_dir(&odd).unwrap();
    let mut child = starts(train(&home.join("a.psb")).arg("--run").arg(&odd));
    wait_for(&odd, 40, &mut child);
    signal(&child, "TERM");
    let said = text(&child.wait_with_output().unwrap().stderr);
    all_work(&home, &said, &["train --resume"]);
    assert!(fs::read(home.join("a.psb")).unwrap() == undisturbed());
}

#[test]
fn options_that_are_advised_are_taken() {
    let home = home("remedies-options");
    let output = home.join("a.psb");
    // Each error names an option, with which the command works.
    let cases: [(&[&str], &str, &[&str]); 2] = [
        (&["--backbone", "scaffold", "--lambda", "0.1"], "--backbone hac", &["--backbone", "hac", "--lambda", "0.1"]),
        (&["--fork-at", "999"], "name one of 1 to 10", &["--fork-at", "5"]),
    ];
    for (given, advice, instead) in cases {
        let command = |options: &[&str]| {
            let mut command = pocketsplat();
            command.arg("train").arg(capture()).arg("-w").arg("-o").arg(&output);
            command.args(["--iterations", "10"]).args(options);
            command
        };
        let said = says(&mut command(given), false);
        assert!(said.contains(advice), "{advice}: {said}");
        says(&mut command(instead), true);
    }
    // A file in the way is replaced as it is advised.
    fs::write(home.join("page.html"), "mine").unwrap();
    let view = || {
        let mut view = pocketsplat();
        view.arg("view").arg(&output).arg("-o").arg(home.join("page.html"));
        view
    };
    assert!(says(&mut view(), false).contains("--overwrite"));
    says(view().arg("--overwrite"), true);
    // The smallest memory that is named is enough.
    let verified =
        |ram: &str| text(&pocketsplat().arg("verify").arg(&output).args(["--ram", ram]).output().unwrap().stderr);
    let said = verified("1");
    let needed = said.split("give --ram ").nth(1).unwrap_or_else(|| panic!("{said}")).split(' ').next().unwrap();
    let said = verified(needed);
    assert!(!said.contains("give --ram"), "{said}");
}
