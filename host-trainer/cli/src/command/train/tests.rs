use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use pocketsplat_capture::dataset::{LoadOptions, MOST_IN_MEMORY_BYTES, load};
use pocketsplat_capture::synth::{SynthOptions, write_capture};
use pocketsplat_files::Outputs;
use pocketsplat_trainer::device::Limits;
use pocketsplat_trainer::train::TrainConfig;
use pocketsplat_trainer::train::config::Backbone;
use pocketsplat_trainer::train::run::photographs_in;

use super::loading::check_size;
use super::*;
use crate::command::devices::DeviceChoice;

/// A run of a few seconds on the capture in `home`.
fn attempt(stop: &AtomicBool) -> Attempt<'_> {
    Attempt { device: None, stop, goes_on: GoesOn::Resume(DeviceChoice::Cpu) }
}

#[test]
fn a_run_goes_on_with_the_device_that_was_asked_for() {
    let said = |device| GoesOn::Resume(device).said(Path::new("a b.run"));
    assert_eq!(said(DeviceChoice::Cpu), "go on with `pocketsplat train --resume 'a b.run'`");
    assert_eq!(said(DeviceChoice::Gpu(Some(1))), "go on with `pocketsplat train --resume 'a b.run' --device gpu:1`");
}

fn config(home: &Path, name: &str) -> RunConfig {
    let mut train = TrainConfig { backbone: Backbone::Hac, iterations: 80, ..TrainConfig::default() };
    (train.shape.feature_dim, train.shape.n_offsets) = (8, 3);
    let output = home.join(name).with_extension("psb");
    RunConfig { dataset: home.join("capture"), output, train, checkpoint_every: Some(10), ..RunConfig::default() }
}

/// As a run loads it, whatever is many for the memory.
fn loaded(config: &RunConfig, in_memory_bytes: u64) -> Capture {
    let cache = Some(photographs_in(&config.output.with_extension("run")));
    let options = LoadOptions { cache, in_memory_bytes, n_random_points: 500, ..LoadOptions::default() };
    load(&config.dataset, &options).unwrap().0
}

/// As a run keeps it.
fn resolved(config: RunConfig, capture: &Capture) -> RunConfig {
    RunConfig { train: config.train.resolved_for(capture), ..config }
}

#[test]
fn a_run_on_decoded_photographs_is_interrupted_resumed_and_ends_in_the_same_bytes() {
    let home = tempfile::tempdir().unwrap();
    let options = SynthOptions { size_px: 32, n_train: 6, n_test: 2, samples_per_axis: 1, ..SynthOptions::default() };
    write_capture(&home.path().join("capture"), &options).unwrap();
    let stop = AtomicBool::new(false);

    let in_memory = config(home.path(), "in-memory");
    let capture = loaded(&in_memory, MOST_IN_MEMORY_BYTES);
    let in_memory = resolved(in_memory, &capture);
    let output = |config: &RunConfig| Outputs::new(false).file(&config.output, BUNDLE).unwrap();
    let to = output(&in_memory);
    let folder = RunFolder::start(&in_memory.output.with_extension("run"), "", false).unwrap();
    let result =
        train_in(folder, &in_memory, &capture, Start::New(Before::default()), attempt(&stop), &to).unwrap().unwrap();
    assert_eq!(result.photographs_waited_share, None);
    let expected = fs::read(&in_memory.output).unwrap();

    let cached = config(home.path(), "cached");
    let run = cached.output.with_extension("run");
    // Before there is a run folder.
    let capture = loaded(&cached, 0);
    let cached = resolved(cached, &capture);
    let to = output(&cached);
    let files = || -> Vec<_> {
        let entries = fs::read_dir(photographs_in(&run)).unwrap().map(|entry| entry.unwrap().path());
        entries.filter(|path| path.extension().is_some_and(|e| e == "photograph")).collect()
    };
    assert_eq!(files().len(), 8);
    let folder = RunFolder::start(&run, "", false).unwrap();
    let ended = std::thread::scope(|scope| {
        let training = scope
            .spawn(|| train_in(folder, &cached, &capture, Start::New(Before::default()), attempt(&stop), &to).unwrap());
        while !run.join("iteration-00000020.checkpoint").exists() && !training.is_finished() {
            std::thread::sleep(Duration::from_millis(1));
        }
        stop.store(true, Ordering::Relaxed);
        training.join().unwrap()
    });
    assert!(ended.is_none(), "interrupted after iteration 20");
    drop(capture);
    clear_photographs(&run, ExitCode::from(stop::INTERRUPTED));
    assert_eq!(files().len(), 8, "kept for the run to go on");
    // Whatever happened to one of them meanwhile.
    fs::write(&files()[3], "damaged").unwrap();

    stop.store(false, Ordering::Relaxed);
    let folder = RunFolder::reopen(&run).unwrap();
    let capture = loaded(&cached, 0);
    let result = train_in(folder, &cached, &capture, Start::Resumed, attempt(&stop), &to).unwrap().unwrap();
    assert!(result.photographs_waited_share.is_some_and(|share| (0.0..1.0).contains(&share)));
    assert!(fs::read(&cached.output).unwrap() == expected, "the same bytes");
    let views = result.held_out.unwrap().views;
    assert_eq!(views.len(), 2, "measured with photographs of the cache");
    drop(capture);
    clear_photographs(&run, ExitCode::SUCCESS);
    assert!(!photographs_in(&run).exists() && run.join("result.json").is_file());
}

#[test]
fn a_fork_on_another_backbone_keeps_the_width_of_its_run() {
    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        args: Args,
    }
    let home = tempfile::tempdir().unwrap();
    let run = home.path().join("a.run");
    fs::create_dir(&run).unwrap();
    let width = |config: &RunConfig, more: &[&str]| {
        fs::write(run.join("config.toml"), toml::to_string(config).unwrap()).unwrap();
        let line = ["train", "--from", run.to_str().unwrap(), "--at", "10", "-o", "b.psb", "--backbone", "scaffold"];
        let Line { args } = clap::Parser::parse_from(line.iter().chain(more));
        args.resolved().unwrap().train.shape.feature_dim
    };
    let config = config(home.path(), "a");
    let published =
        RunConfig { train: TrainConfig { backbone: Backbone::Hac, ..TrainConfig::default() }, ..config.clone() };
    assert_eq!(width(&published, &[]), 32);
    assert_eq!(width(&config, &[]), 8);
    assert_eq!(width(&published, &["--set", "train.shape.feature_dim=16"]), 16, "which the run refuses");
}

#[test]
fn photographs_that_no_device_draws_are_refused_before_training() {
    let home = tempfile::tempdir().unwrap();
    let options = SynthOptions { size_px: 24, n_train: 4, n_test: 2, samples_per_axis: 1, ..SynthOptions::default() };
    write_capture(&home.path().join("capture"), &options).unwrap();
    let mut capture = loaded(&config(home.path(), "a"), MOST_IN_MEMORY_BYTES);
    let level = |number| Limits { level: Some(number), ..Limits::default() };
    check_size(&capture, &level(1)).unwrap();
    // The largest of them has not the longest side, and is not the last.
    (capture.train[0].camera.width_px, capture.train[0].camera.height_px) = (120, 120);
    (capture.train[3].camera.width_px, capture.train[3].camera.height_px) = (128, 24);
    let said = check_size(&capture, &level(1)).unwrap_err().to_string();
    assert!(said.starts_with("the photographs are 120x120 px, and level 1 allows"), "{said}");
    check_size(&capture, &Limits::default()).unwrap();
    capture.test[1].camera.height_px = 4200;
    let said = check_size(&capture, &Limits::default()).unwrap_err().to_string();
    assert!(said.contains(&capture.test[1].name) && said.contains("24x4200 px"), "{said}");
}
