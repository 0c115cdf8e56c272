//! What a run was asked for: written, read back, overridden, contradicted.

use std::fs;
use std::path::Path;

use crate::fixture::{
    ITERATIONS, capture, fails, folder, pocketsplat, resume, starts, succeeds, text, train, undisturbed, wait_for,
};

#[test]
fn a_dry_run_says_the_whole_configuration_and_writes_nothing() {
    let home = folder("dry-run");
    let output = home.join("a.psb");
    let said = train(&output).arg("--dry-run").output().unwrap();
    assert!(said.status.success(), "{}", text(&said.stderr));
    assert_eq!(fs::read_dir(&home).unwrap().count(), 0, "nothing is written");
    succeeds(&mut train(&output));
    assert_eq!(text(&said.stdout), fs::read_to_string(home.join("a.run/config.toml")).unwrap());
}

#[test]
fn a_written_configuration_gives_the_same_bundle_again() {
    let home = folder("config");
    let output = home.join("a.psb");
    succeeds(train(&output).args(["--run".as_ref(), home.join("notes").as_os_str()]));
    assert!(!home.join("a.run").exists());
    let config = home.join("notes/config.toml");
    let log = fs::read_to_string(home.join("notes/progress.csv")).unwrap();
    assert!(log.starts_with("iteration,loss,psnr_db,anchors,seconds,dropped,"), "{log}");
    assert_eq!(log.lines().last().unwrap().split(',').next(), Some(ITERATIONS.to_string().as_str()));
    let result = fs::read_to_string(home.join("notes/result.json")).unwrap();
    assert!(result.contains("\"dropped_steps\": 0"), "{result}");

    let again = home.join("b.psb");
    succeeds(pocketsplat().arg("train").arg("--config").arg(&config).arg("-o").arg(&again));
    assert!(fs::read(&again).unwrap() == undisturbed(), "from the configuration");
    let written = fs::read_to_string(home.join("b.run/config.toml")).unwrap();
    let first = fs::read_to_string(&config).unwrap();
    assert_eq!(written.replace("b.psb", "a.psb"), first);

    // What stands on the command line counts more.
    let other = home.join("c.psb");
    let mut command = pocketsplat();
    command.arg("train").arg("--config").arg(&config).arg("-o").arg(&other);
    let effects = ["--effects", "+view-distance,-view-colour,-view-geometry"];
    succeeds(command.args(["--iterations", "5", "--keep-checkpoints", "--modules", "none"]).args(effects));
    let written = fs::read_to_string(home.join("c.run/config.toml")).unwrap();
    for line in [
        "iterations = 5",
        "view_distance = true",
        "view_colour = false",
        "view_geometry = false",
        "n_offsets = 3",
        "voxel_size = 0.2",
    ] {
        assert!(written.lines().any(|l| l == line), "{line}: {written}");
    }
    assert!(home.join("c.run/iteration-00000005.checkpoint").exists());
}

/// `train.hac.lambda` in the configuration of a run.
fn lambda_of(run: &Path) -> f64 {
    let written: toml::Table = fs::read_to_string(run.join("config.toml")).unwrap().parse().unwrap();
    written["train"]["hac"]["lambda"].as_float().unwrap()
}

#[test]
fn bits_weigh_as_much_for_each_pixel_that_shows_the_scene_unless_a_weight_is_given() {
    let home = folder("share");
    let photographs = fs::read_dir(capture().join("train")).unwrap();
    let shares: Vec<f64> = photographs
        .map(|entry| image::open(entry.unwrap().path()).unwrap().into_rgba8())
        .map(|image| {
            image.pixels().filter(|pixel| pixel.0[3] > 0).count() as f64 / f64::from(image.width() * image.height())
        })
        .collect();
    let share = shares.iter().sum::<f64>() / shares.len() as f64;
    assert!((0.1..0.9).contains(&share), "{share}");
    let lambda = |name: &str, options: &[&str]| {
        let mut command = pocketsplat();
        command.arg("train").arg(capture()).arg("-o").arg(home.join(name)).arg("--no-report");
        succeeds(command.args(["--iterations", "20", "--feature-dim", "8", "--offsets", "3"]).args(options));
        lambda_of(&home.join(name).with_extension("run"))
    };
    assert!((lambda("default.psb", &[]) - 0.002 * share).abs() < 1e-9);
    assert_eq!(lambda("given.psb", &["--lambda", "0.002"]), 0.002);
    assert_eq!(lambda("set.psb", &["--set", "train.hac.lambda=0.002"]), 0.002);
    let another_key =
        lambda("another.psb", &["--set", "train.hac.sample=0.5", "--set", "train.densification.interval=50"]);
    assert!((another_key - 0.002 * share).abs() < 1e-9, "{another_key}");
}

#[test]
fn what_a_configuration_cannot_say_is_refused_by_name() {
    let home = folder("bad-config");
    let config = home.join("my.toml");
    let mut command = pocketsplat();
    command.arg("train").arg("--config").arg(&config);
    fs::write(&config, "[train]\niteration = 3\n").unwrap();
    let error = fails(&mut command);
    assert!(error.contains("my.toml") && error.contains("unknown key `train.iteration`"), "{error}");
    fs::write(&config, "output = \"a.psb\"\n").unwrap();
    let error = fails(&mut command);
    assert!(error.contains("names no `dataset`"), "{error}");
    fs::write(&config, "dataset = \"x\"\noutput = \"a.psb\"\n[train.rates.feature]\nstart = nan\n").unwrap();
    let error = fails(&mut command);
    assert!(error.contains("train.rates.feature.start is NaN, needs 0 to 10"), "{error}");
}

#[test]
fn a_run_goes_on_only_with_what_it_began_with() {
    let home = folder("contradiction");
    let (output, run) = (home.join("a.psb"), home.join("a.run"));
    let mut child = starts(&mut train(&output));
    wait_for(&run, 30, &mut child);
    child.kill().unwrap();
    child.wait().unwrap();
    let error = fails(resume(&run).args(["--iterations", "400"]));
    assert!(error.contains("`train.iterations` is 160 in the run, 400 on the command line"), "{error}");
    let error = fails(resume(&run).args(["--flash", "300kB"]));
    assert!(
        error.contains("`encoding.limits` is nothing in the run, { flash_bytes = 300000 } on the command line"),
        "{error}"
    );
    // Before the rest is trained, what its end would refuse.
    let error = fails(resume(&run).args(["--tiers", "0.4,0.4,0"]));
    assert!(error.contains("tiers of pruning rates [0.4, 0.4, 0.0]"), "{error}");
    let config = run.join("config.toml");
    let begun = fs::read_to_string(&config).unwrap();
    fs::write(&config, begun.replace("seed = 42", "seed = 43")).unwrap();
    let error = fails(&mut resume(&run));
    assert!(
        error.contains(
            "config.toml and the checkpoint disagree: `train.seed` is 43 in config.toml, 42 in the checkpoint"
        ),
        "{error}"
    );
    fs::write(&config, begun).unwrap();
    // Where the bundle goes does not decide what it is.
    let elsewhere = home.join("b.psb");
    let said = succeeds(resume(&run).arg("-o").arg(&elsewhere).args(["--checkpoint-every", "1000", "--fork-at", "5"]));
    assert!(said.contains("--fork-at 5 keeps nothing"), "{said}");
    assert!(fs::read(&elsewhere).unwrap() == undisturbed());
}

#[test]
fn a_fork_shares_a_run_up_to_an_iteration() {
    let home = folder("fork");
    let whole = home.join("a.psb");
    succeeds(train(&whole).args(["--fork-at", "90"]));
    assert!(fs::read(&whole).unwrap() == undisturbed());
    let fork = |name: &str, at: &str| {
        let mut command = pocketsplat();
        command.arg("train").arg("--from").arg(home.join("a.run")).args(["--at", at]).arg("-o").arg(home.join(name));
        command
    };
    let said = succeeds(&mut fork("same.psb", "90"));
    assert!(said.contains("going on after iteration 90"), "{said}");
    assert!(fs::read(home.join("same.psb")).unwrap() == undisturbed(), "the same settings end in the same bytes");
    // Killed, it goes on from where it was, not from the capture's points.
    let lower = ["--set", "train.rates.feature.end=1e-6"];
    succeeds(fork("other.psb", "90").args(lower));
    let mut child = starts(fork("killed.psb", "90").args(lower).args(["--fork-at", "92"]));
    wait_for(&home.join("killed.run"), 95, &mut child);
    child.kill().unwrap();
    child.wait().unwrap();
    succeeds(resume(&home.join("killed.run")).args(["--fork-at", "100"]));
    for kept in [92, 100] {
        assert!(home.join(format!("killed.run/iteration-{kept:08}.checkpoint")).exists(), "{kept}");
    }
    let other = fs::read(home.join("other.psb")).unwrap();
    assert!(other != undisturbed() && other == fs::read(home.join("killed.psb")).unwrap());

    // From there on the photographs may have another size, which the bundle names.
    succeeds(fork("smaller.psb", "90").args(["--max-resolution", "16"]));
    let inspected = pocketsplat().arg("inspect").arg(home.join("smaller.psb")).output().unwrap();
    let inspected = text(&inspected.stdout);
    let size = inspected.lines().find(|line| line.starts_with("training_px")).expect(&inspected);
    assert!(size.ends_with(" 16 16"), "{size}");

    let error = fails(&mut fork("b.psb", "91"));
    assert!(error.contains("no checkpoint of iteration 91, it has those of [90]"), "{error}");
    let error = fails(fork("b.psb", "90").args(["--backbone", "scaffold", "--modules", "none"]));
    assert!(error.contains("keeps `train.backbone` of its run"), "{error}");
    assert!(!home.join("b.run").exists(), "before anything was done");
    let error = fails(&mut fork("a.psb", "90"));
    assert!(error.contains("cannot be both the run to begin from and the new one"), "{error}");
    assert!(home.join("a.run/iteration-00000090.checkpoint").exists(), "nothing is lost");
}

#[test]
fn a_bundle_is_measured_as_it_was_trained_and_another_capture_is_noticed() {
    let home = folder("protocol");
    let output = home.join("a.psb");
    succeeds(train(&output).args(["--resolution", "24x16", "--background", "white"]));
    let eval = |capture: &Path| {
        let found = pocketsplat().arg("eval").arg(&output).arg(capture).arg("--json").output().unwrap();
        assert!(found.status.success(), "{}", text(&found.stderr));
        (serde_json::from_slice::<serde_json::Value>(&found.stdout).unwrap(), text(&found.stderr))
    };
    let (found, said) = eval(capture());
    let result: serde_json::Value = serde_json::from_slice(&fs::read(home.join("a.run/result.json")).unwrap()).unwrap();
    assert_eq!((&result["psnr_db"], &result["ssim"]), (&found["psnr_db"], &found["ssim"]), "what training said");
    assert_eq!((&found["width_px"], &found["height_px"]), (&24.into(), &16.into()), "{found}");
    assert_eq!(found["background"], "white");
    assert!(said.contains("as the bundle says: images cut to 24x16, background white"), "{said}");
    assert!(!said.contains("another capture"), "{said}");
    let other = home.join("other");
    succeeds(pocketsplat().arg("synth").arg(&other).args(["--size", "32", "--train-views", "6", "--seed", "7"]));
    let (_, said) = eval(&other);
    assert!(said.contains("warning: this is another capture than the bundle was trained on"), "{said}");
}

#[test]
fn a_run_ends_with_what_people_want_to_know_and_commands_to_copy() {
    let home = folder("last words");
    let mut command = train("desk lamp.psb".as_ref());
    let done = command.current_dir(&home).output().unwrap();
    let (result, said) = (text(&done.stdout), text(&done.stderr));
    assert!(done.status.success(), "{said}");
    assert!(result.starts_with("quality:  ") && result.contains(" dB PSNR, "), "{result}");
    assert!(result.contains(" bytes, desk lamp.psb\n") && result.contains("time:     "), "{result}");
    assert!(said.contains("pocketsplat fit 'desk lamp.psb'"), "as it was typed, as one word: {said}");
    let kept: serde_json::Value =
        serde_json::from_slice(&fs::read(home.join("desk lamp.run/result.json")).unwrap()).unwrap();
    assert_eq!((&kept["schema_version"], &kept["iterations"]), (&1.into(), &ITERATIONS.into()));
    let evaluated = pocketsplat().arg("eval").arg(home.join("desk lamp.psb")).arg(capture()).output().unwrap();
    assert!(text(&evaluated.stdout).starts_with("quality:  "), "{}", text(&evaluated.stdout));
    assert!(!text(&evaluated.stderr).contains("LPIPS"), "{}", text(&evaluated.stderr));
}

#[test]
fn an_empty_configuration_trains_what_no_configuration_trains() {
    let home = folder("empty-config");
    let empty = home.join("empty.toml");
    fs::write(&empty, "").unwrap();
    let dry = |options: &[&str]| {
        let mut command = pocketsplat();
        command.arg("train").arg(capture()).arg("-o").arg(home.join("a.psb")).arg("--dry-run").args(options);
        let said = command.output().unwrap();
        assert!(said.status.success(), "{}", text(&said.stderr));
        text(&said.stdout)
    };
    let plain = dry(&[]);
    assert_eq!(dry(&["--config", empty.to_str().unwrap()]), plain);
    fs::write(&empty, "preset = \"quick\"\nunset = [\"train.modules.rdo\"]\n").unwrap();
    let quick = dry(&["--preset", "quick", "--modules", "none"]);
    assert_eq!(dry(&["--config", empty.to_str().unwrap()]), quick);
    assert!(quick.starts_with("unset = [\"train.modules.rdo\"]\npreset = \"quick\"\n"), "{quick}");
}

#[test]
fn tiers_deeper_than_those_trained_for_are_named_with_a_remedy_that_works() {
    let home = folder("deeper-tiers");
    let warned = |options: &[&str]| {
        let mut command = pocketsplat();
        command.arg("train").arg(capture()).arg("-o").arg(home.join("a.psb")).arg("--dry-run").args(options);
        let said = command.output().unwrap();
        assert!(said.status.success(), "{}", text(&said.stderr));
        let said = text(&said.stderr);
        said.lines().find(|line| line.starts_with("warning: tiered-pruning")).map(str::to_owned)
    };
    let modules = ["--modules", "rdo-pruning,tiered-pruning"];
    assert_eq!(warned(&modules), None, "the default tiers are those that are trained for");
    let deeper = [&modules[..], &["--tiers", "0.6,0.3,0"]].concat();
    let said = warned(&deeper).expect("a warning");
    let remedy = "--set train.modules.pruning.rate=0.6";
    assert!(said.contains("leaves out 0.4 of the anchors at most") && said.contains(remedy), "{said}");
    assert_eq!(warned(&[&deeper[..], &remedy.split(' ').collect::<Vec<_>>()].concat()), None);
    assert_eq!(warned(&["--tiers", "0.6,0.3,0"]), None, "nothing is trained for tiers");
}
