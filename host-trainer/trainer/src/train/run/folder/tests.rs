use std::fs;
use std::sync::atomic::AtomicBool;

use super::*;
use crate::train::run::Neural;
use crate::train::run::residence::Residence;
use crate::train::test_capture::{SIZE_PX, tiny_capture, tiny_config};
use pocketsplat_kernels::step::{LoadNumber, StepReport};

const ITERATIONS: u32 = 40;

/// Asks the run to stop after some iteration.
struct StopAfter<'s>(u32, &'s AtomicBool);

impl Observer for StopAfter<'_> {
    fn step(&mut self, iteration: u32, _: &StepReport<f32>, _: &pocketsplat_kernels::scene::Scene<f32>) {
        if iteration == self.0 {
            self.1.store(true, Ordering::Relaxed);
        }
    }
}

/// Trains until after iteration `until`, from wherever the folder stands.
fn train(
    folder: &mut RunFolder,
    interval: Interval,
    until: u32,
) -> (Ending, pocketsplat_kernels::scene::Scene<f32>, Vec<String>) {
    let capture = tiny_capture();
    let resumed = folder.resume(&capture).unwrap();
    let (mut trainer, passed_over) = match resumed {
        Some(resumed) => (resumed.restored.run, resumed.passed_over),
        None => (Trainer::new(&capture, tiny_config(ITERATIONS)).unwrap(), Vec::new()),
    };
    let stop = AtomicBool::new(false);
    let ending = folder.train(&mut trainer, &mut StopAfter(until, &stop), interval, &stop).unwrap();
    (ending, trainer.state.learned.scene, passed_over)
}

fn names(folder: &RunFolder) -> Vec<String> {
    let mut names: Vec<_> =
        files::names(folder.path()).unwrap().into_iter().map(|n| n.into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_folder_takes_a_run_through_interruption_and_damage_to_the_same_end() {
    let home = tempfile::tempdir().unwrap();
    let mut whole = RunFolder::start(&home.path().join("whole.run"), "a = 1", false).unwrap();
    let (ending, scene, _) = train(&mut whole, Interval::Iterations(7), u32::MAX);
    assert_eq!(ending, Ending::Finished);
    assert_eq!(
        names(&whole),
        [
            "config.toml",
            "iteration-00000035.checkpoint",
            "iteration-00000040.checkpoint",
            "lock",
            "previews",
            "progress.csv"
        ]
    );
    let previews = |path: &Path| files::names(&path.join(PREVIEWS)).unwrap().len();
    assert_eq!((previews(whole.path()), newest_preview(whole.path()).unwrap().0), (ITERATIONS as usize, ITERATIONS));
    let log = fs::read_to_string(whole.path().join(LOG)).unwrap();

    let path = home.path().join("broken.run");
    let mut folder = RunFolder::start(&path, "a = 1", false).unwrap();
    assert_eq!(train(&mut folder, Interval::Iterations(9), 23).0, Ending::Interrupted);
    drop(folder);
    // The newest checkpoint turns out damaged.
    let newest = path.join("iteration-00000023.checkpoint");
    let mut bytes = fs::read(&newest).unwrap();
    bytes[1000] ^= 1;
    fs::write(&newest, bytes).unwrap();
    fs::write(path.join("iteration-00000030.checkpoint.partial"), "half").unwrap();
    let mut folder = RunFolder::reopen(&path).unwrap();
    assert_eq!(folder.config().unwrap(), "a = 1");
    let (ending, resumed_scene, passed_over) = train(&mut folder, Interval::Iterations(9), u32::MAX);
    assert_eq!(ending, Ending::Finished);
    assert!(passed_over.len() == 1 && passed_over[0].contains("iteration-00000023.checkpoint: its content"));
    assert!(resumed_scene == scene, "the same bits");
    let without_seconds = |log: &str| {
        let row = |row: &str| row.split(',').enumerate().filter(|(i, _)| *i != 4).map(|(_, v)| v.to_owned()).collect();
        log.lines().map(row).collect::<Vec<Vec<String>>>()
    };
    let resumed_log = fs::read_to_string(path.join(LOG)).unwrap();
    assert_eq!(without_seconds(&resumed_log), without_seconds(&log));
    assert_eq!(log.lines().count(), 1 + ITERATIONS as usize);

    folder.finish("{}", false).unwrap();
    let error = RunFolder::reopen(&path).unwrap_err();
    assert!(matches!(error, RunError::Finished { .. }), "{error}");
    let again = RunFolder::start(&path, "a = 2", false).unwrap();
    assert_eq!(names(&again), ["config.toml", "lock"]);
}

#[test]
fn a_fork_begins_where_its_run_stood() {
    let (home, capture) = (tempfile::tempdir().unwrap(), tiny_capture());
    let path = home.path().join("a.run");
    let mut folder = RunFolder::start(&path, "", false).unwrap().forking_at(&[12, 20]);
    let (_, scene, _) = train(&mut folder, Interval::Iterations(7), u32::MAX);
    folder.finish("{}", false).unwrap();
    let config = tiny_config(ITERATIONS);
    let mut same = fork(&path, 12, &capture, config).unwrap();
    assert_eq!(same.iteration(), 12);
    let mut other = config;
    other.rates.feature.end = 1e-6;
    let mut other = fork(&path, 20, &capture, other).unwrap();
    for trainer in [&mut same, &mut other] {
        while !trainer.is_done() {
            trainer.advance().unwrap();
        }
    }
    assert!(*same.scene() == scene, "the same settings, the same bits");
    assert!(other.state.learned.scene != scene && other.state.learned.scene.anchors.len() == scene.anchors.len());

    let message = fork(&path, 35, &capture, config).unwrap_err().to_string();
    assert!(message.contains("no checkpoint of iteration 35, it has those of [12, 20]"), "{message}");
    let mut wider = config;
    wider.shape.feature_dim += 1;
    let error = fork(&path, 12, &capture, wider).unwrap_err();
    let source = std::error::Error::source(&error).unwrap().to_string();
    let width = config.shape.feature_dim;
    let expected =
        format!("a fork keeps `train.shape.feature_dim` of its run, which is {width}, but {} was asked for", width + 1);
    assert!(source.contains(&expected), "{error}: {source}");
}

#[test]
fn a_fork_has_a_folder_only_with_its_first_checkpoint() {
    let (home, capture) = (tempfile::tempdir().unwrap(), tiny_capture());
    let path = home.path().join("a.run");
    let mut trainer = Trainer::new(&capture, tiny_config(ITERATIONS)).unwrap();
    // What is on a device, and was not fetched, cannot be written.
    trainer.machine.device.residence = Residence::Device(LoadNumber(1));
    // Neither where there was nothing, nor where a finished run lies.
    for finished in [false, true] {
        if finished {
            RunFolder::start(&path, "a = 1", false).unwrap().finish("{}", false).unwrap();
        }
        let error = RunFolder::start_from(&path, "a = 2", false, &trainer).unwrap_err();
        assert!(matches!(error, RunError::Write { .. }), "{error}");
        assert!(
            matches!(RunFolder::reopen(&path), Err(RunError::NoRun { .. })),
            "it would begin with the capture's points"
        );
    }
    trainer.machine.device.residence = Residence::Host;
    let folder = RunFolder::start_from(&path, "a = 2", false, &trainer).unwrap();
    assert_eq!(names(&folder), ["config.toml", "iteration-00000000.checkpoint", "lock"]);
}

#[test]
fn a_view_that_is_reproduced_exactly_has_a_psnr_that_a_curve_shows() {
    let (home, capture) = (tempfile::tempdir().unwrap(), tiny_capture());
    let path = home.path().join(LOG);
    let trainer = Trainer::new(&capture, tiny_config(ITERATIONS)).unwrap();
    let mut log = ProgressLog::open(&path, &trainer).unwrap();
    for squared_error in [0.0, 0.01] {
        log.add(&trainer, &LoggedStep { loss: 0.5, squared_error, rate: None, is_dropped: false }).unwrap();
    }
    let text = fs::read_to_string(&path).unwrap();
    let psnr = |row: &str| row.split(',').nth(2).unwrap().parse::<f64>().unwrap();
    let found: Vec<f64> = text.lines().skip(1).map(psnr).collect();
    // One of a photograph's values is off by one level.
    let n_values = f64::from(3 * SIZE_PX * SIZE_PX);
    let expected = [10.0 * (255.0 * 255.0 * n_values).log10(), 20.0];
    assert!(found.len() == 2 && found.iter().zip(expected).all(|(found, psnr)| (found - psnr).abs() < 1e-3), "{text}");
}

#[test]
fn checkpoints_by_time_wait_for_their_time() {
    let home = tempfile::tempdir().unwrap();
    for (seconds, at_least) in [(0.0, 2), (1e9, 1)] {
        let mut folder = RunFolder::start(home.path(), "", true).unwrap();
        train(&mut folder, Interval::Seconds(seconds), u32::MAX);
        assert_eq!(folder.checkpoints().unwrap().len(), at_least, "every {seconds} s");
    }
}

#[test]
fn effects_that_are_being_measured_are_a_run_too() {
    let home = tempfile::tempdir().unwrap();
    let path = home.path().join("a.run");
    let folder = RunFolder::start(&path, "", false).unwrap();
    std::fs::write(folder.pilots(), "one pilot\n").unwrap();
    drop(folder);
    assert!(matches!(RunFolder::start(&path, "", false), Err(RunError::Unfinished { .. })));
    RunFolder::start(&path, "", true).unwrap();
}

#[test]
fn an_unfinished_run_is_not_overwritten_by_accident() {
    let home = tempfile::tempdir().unwrap();
    let path = home.path().join("a.run");
    let mut folder = RunFolder::start(&path, "", false).unwrap();
    train(&mut folder, Interval::Iterations(0), 3);
    let error = RunFolder::start(&path, "", false).unwrap_err();
    assert!(matches!(error, RunError::InUse { .. }), "{error}");
    assert!(matches!(RunFolder::reopen(&path), Err(RunError::InUse { .. })));
    drop(folder);
    let error = RunFolder::start(&path, "", false).unwrap_err();
    assert!(matches!(error, RunError::Unfinished { .. }), "{error}");
    assert!(error.to_string().contains("--resume") && error.to_string().contains("--overwrite"), "{error}");
    RunFolder::start(&path, "", true).unwrap();
}

#[test]
fn other_folders_are_left_alone() {
    let home = tempfile::tempdir().unwrap();
    let error = RunFolder::reopen(home.path()).unwrap_err();
    assert!(matches!(error, RunError::NoRun { .. }), "{error}");
    fs::write(home.path().join("photo.png"), "").unwrap();
    for overwrite in [false, true] {
        let error = RunFolder::start(home.path(), "", overwrite).unwrap_err();
        assert!(matches!(error, RunError::Foreign { .. }), "{error}");
    }
    assert_eq!(files::names(home.path()).unwrap(), ["photo.png"]);
    // Another program's configuration.
    fs::write(home.path().join(CONFIG), "title = 1").unwrap();
    assert!(matches!(RunFolder::start(home.path(), "", true), Err(RunError::Foreign { .. })));
}

#[test]
fn what_is_not_of_the_run_stays_in_its_folder() {
    let home = tempfile::tempdir().unwrap();
    let path = home.path().join("a.run");
    let mut folder = RunFolder::start(&path, "", false).unwrap();
    train(&mut folder, Interval::Iterations(0), u32::MAX);
    folder.finish("{}", false).unwrap();
    for name in ["film.mp4.partial", "iteration-00000030.checkpoint.4711.partial", "previews/mine.jpg"] {
        fs::write(path.join(name), "mine").unwrap();
    }
    RunFolder::check(&path, false).unwrap();
    let again = RunFolder::start(&path, "", false).unwrap();
    assert_eq!(names(&again), ["config.toml", "film.mp4.partial", "lock", "previews"]);
    assert_eq!(files::names(&path.join(PREVIEWS)).unwrap(), ["mine.jpg"]);
    // Another program's folder, whose lock says who holds it.
    let other = home.path().join("other");
    fs::create_dir(&other).unwrap();
    for (name, content) in [(CONFIG, "title = 1"), (LOCK, "pid 17"), (RESULT, "theirs")] {
        fs::write(other.join(name), content).unwrap();
    }
    for refused in [RunFolder::check(&other, true), RunFolder::start(&other, "", true).map(drop)] {
        assert!(matches!(refused, Err(RunError::Foreign { .. })), "{refused:?}");
    }
    assert_eq!(fs::read_to_string(other.join(RESULT)).unwrap(), "theirs");
    let file = home.path().join("file");
    fs::write(&file, "mine").unwrap();
    for refused in [RunFolder::check(&file, true), RunFolder::start(&file, "", true).map(drop)] {
        assert!(refused.unwrap_err().to_string().contains("choose another folder with --run"));
    }
}

#[test]
fn a_picture_that_cannot_be_written_ends_no_run() {
    #[derive(Default)]
    struct Heard(usize);
    impl Observer for Heard {
        fn step(&mut self, _: u32, _: &StepReport<f32>, _: &pocketsplat_kernels::scene::Scene<f32>) {}
        fn unwritten(&mut self, why: &dyn std::error::Error) {
            assert!(why.to_string().contains(PREVIEWS), "{why}");
            self.0 += 1;
        }
    }
    let (home, capture) = (tempfile::tempdir().unwrap(), tiny_capture());
    // No folder of pictures can be made; then one of the pictures cannot.
    for name in [PREVIEWS, "previews/00000003.jpg/folder"] {
        let path = home.path().join(name.replace('/', "-"));
        let mut folder = RunFolder::start(&path, "", false).unwrap();
        if name == PREVIEWS {
            fs::write(path.join(name), "").unwrap();
        } else {
            fs::create_dir_all(path.join(name)).unwrap();
        }
        let mut heard = Heard::default();
        let mut trainer = Trainer::new(&capture, tiny_config(5)).unwrap();
        let every = Interval::Iterations(0);
        let ending = folder.train(&mut trainer, &mut heard, every, &AtomicBool::new(false)).unwrap();
        assert_eq!((ending, heard.0), (Ending::Finished, 1), "{name}");
    }
}

#[test]
fn when_no_checkpoint_is_sound_all_are_named() {
    let home = tempfile::tempdir().unwrap();
    let folder = RunFolder::start(home.path(), "", false).unwrap();
    assert!(folder.resume::<Neural>(&tiny_capture()).unwrap().is_none());
    for iteration in [3, 4] {
        fs::write(home.path().join(format!("iteration-{iteration:08}.checkpoint")), "nothing").unwrap();
    }
    let message = folder.resume::<Neural>(&tiny_capture()).unwrap_err().to_string();
    assert!(message.contains("iteration-00000003") && message.contains("iteration-00000004"), "{message}");
}

#[test]
fn a_write_that_fails_leaves_the_older_file() {
    let home = tempfile::tempdir().unwrap();
    let path = home.path().join("file");
    fs::write(&path, "older").unwrap();
    let error = files::write_whole(&path, |out| {
        out.write_all(&vec![0; 100_000])?;
        Err(std::io::ErrorKind::StorageFull.into())
    });
    assert!(matches!(error, Err(RunError::Write { .. })), "{error:?}");
    assert_eq!(fs::read(&path).unwrap(), b"older");
    assert_eq!(files::names(home.path()).unwrap(), ["file"]);
}
