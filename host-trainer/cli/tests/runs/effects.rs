//! Effects: forced, refused, measured, and kept with the run.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use pocketsplat_format::Bundle;
use pocketsplat_format::bundle::Effects;

use crate::fixture::{fails, folder, pocketsplat, resume, starts, succeeds, text, train};
use crate::interruption::signal;

fn effects_of(bundle: &PathBuf) -> Effects {
    let bytes = fs::read(bundle).unwrap();
    Bundle::parse(&bytes).unwrap().header().features.effects
}

#[test]
fn forced_effects_are_those_of_the_bundle() {
    let home = folder("forced-effects");
    let output = home.join("a.psb");
    succeeds(train(&output).args(["--effects", "+detail,-view-colour,-view-geometry,+view-distance"]));
    let expected = Effects { detail: true, view_distance: true, anisotropic: true, ..Effects::default() };
    assert_eq!(effects_of(&output), expected);
    succeeds(train(&output).args(["--effects", "-view-geometry"]));
    assert_eq!(effects_of(&output), Effects { view_colour: true, anisotropic: true, ..Effects::default() });
    succeeds(train(&output).args(["--effects", "-view-colour", "--backbone", "hac"]));
    assert_eq!(effects_of(&output), Effects { view_geometry: true, anisotropic: true, ..Effects::default() });
    succeeds(train(&output).args(["--effects", "-view-colour,-view-geometry"]));
    assert_eq!(effects_of(&output), Effects { anisotropic: true, ..Effects::default() });
    succeeds(train(&output).args(["--effects", "none"]));
    assert_eq!(effects_of(&output), Effects::default());
}

#[test]
fn isotropic_runs_go_through_every_phase_and_module() {
    let output = folder("isotropic").join("a.psb");
    let modules = ["--backbone", "hac", "--modules", "distribution,hard-pruning"];
    succeeds(train(&output).args(["--effects", "-anisotropy,+detail"]).args(modules));
    let bytes = fs::read(&output).unwrap();
    let bundle = Bundle::parse(&bytes).unwrap();
    assert!(!bundle.header().features.effects.anisotropic && bundle.n_anchors() > 0);
    assert_eq!(bundle.heads().covariance.n_out, 3, "a scale logit an offset");
}

#[test]
fn an_effect_is_set_in_one_way() {
    let output = folder("one-way").join("a.psb");
    for key in ["train.shape.view_distance=true", "train.shape.view_colour=true", "train.modules.detail.weight=0.5"] {
        let said = fails(train(&output).args(["--set", key]));
        assert!(said.contains(&format!("--set {key} belongs to the effect")) && said.contains("--effects +"), "{said}");
    }
    assert!(!output.exists() && !output.with_extension("run").exists(), "before anything was done");
    let settings = ["--effects", "+detail", "--set", "train.modules.detail.hidden=5"];
    succeeds(train(&output).args(settings));
    for key in ["train.shape={view_colour=false}", "train={shape={anisotropic=false}}", "train.modules={detail={}}"] {
        let said = fails(train(&output).args(["--set", key]).arg("--overwrite"));
        assert!(said.contains(&format!("--set {key} belongs to the effect")) && said.contains("--effects +"), "{said}");
    }
    let said = fails(train(&output).args(["--effects", "+detail", "--set", "train.shape.detail_hidden=99"]));
    assert!(said.contains("belongs to the effect detail") && said.contains("train.modules.detail.hidden"), "{said}");
    assert!(effects_of(&output).detail && effects_of(&output).view_colour);
}

#[test]
fn a_run_too_short_to_measure_keeps_its_effects_and_says_so() {
    let output = folder("short-effects").join("a.psb");
    let said = succeeds(train(&output).args(["--effects", "auto"]));
    assert!(said.contains("effects: view-colour + view-geometry + anisotropy; a run needs 16000 iterations"), "{said}");
    let said = succeeds(train(&output).args(["--effects", "auto", "--set", "effects.least_iterations=1"]));
    assert!(
        said.contains("effects: view-colour + view-geometry + anisotropy; the capture has too few training views"),
        "{said}"
    );
    let said = succeeds(&mut train(&output));
    assert!(said.contains("a run needs 16000 iterations"), "measuring is the default: {said}");
    let said = succeeds(train(&output).args(["--effects", "+view-colour"]));
    assert!(!said.contains("effects:"), "nothing is measured that was decided about: {said}");
}

#[test]
fn effects_are_measured_once_and_stay_with_the_run() {
    let home = folder("measured-effects");
    let views = home.join("capture");
    succeeds(pocketsplat().arg("synth").arg(&views).args(["--size", "24", "--train-views", "13", "--test-views", "2"]));
    let run = |name: &str| -> (PathBuf, Command) {
        let output = home.join(name);
        let mut command = pocketsplat();
        command.arg("train").arg("-o").arg(&output);
        (output, command)
    };
    let (output, mut command) = run("a.psb");
    command.arg(&views).args(["--iterations", "80", "--feature-dim", "8", "--offsets", "3"]);
    // So dear that nothing pays, whatever it is worth.
    let least = "effects.least_iterations=80";
    let measured = ["--effects", "auto", "--set", least, "--set", "effects.price.effect_db=1000"];
    command.args(measured);
    let said = succeeds(&mut command);
    let (estimate, pilot) = (said.find(" of them to measure effects), "), said.find("effects: pilot 1 with none"));
    assert!(estimate.zip(pilot).is_some_and(|(estimate, pilot)| estimate < pilot), "{said}");
    assert!(said.contains("effects: pilot 5 with detail") && said.contains("effects: none, measured in"), "{said}");
    assert_eq!(effects_of(&output), Effects::default());
    let kept = home.join("a.run");
    let table = fs::read_to_string(kept.join("effects.csv")).unwrap();
    assert!(table.lines().count() >= 5 && table.lines().filter(|line| line.ends_with("true")).count() == 1, "{table}");
    let config = fs::read_to_string(kept.join("config.toml")).unwrap();
    assert!(config.contains("auto = false") && config.contains("view_colour = false"), "{config}");
    let (again, mut command) = run("b.psb");
    let said = succeeds(command.arg("--config").arg(kept.join("config.toml")));
    assert!(!said.contains("effects:"), "nothing is measured again: {said}");
    assert!(fs::read(&output).unwrap() == fs::read(again).unwrap());

    // Stopped while pilots are trained: those that are done stay.
    let (interrupted, mut command) = run("c.psb");
    command.arg(&views).args(["--iterations", "80", "--feature-dim", "8", "--offsets", "3"]).args(measured);
    let mut child = starts(&mut command);
    let folder = home.join("c.run");
    while !folder.join("pilots.csv").exists() {
        assert!(child.try_wait().unwrap().is_none(), "ended before its first pilot");
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    signal(&child, "TERM");
    let ended = child.wait_with_output().unwrap();
    let said = text(&ended.stderr);
    assert_eq!(ended.status.code(), Some(130), "{said}");
    assert!(said.contains("pilots are kept; go on with `pocketsplat train --resume"), "{said}");
    let said = succeeds(resume(&folder).args(["--fork-at", "60"]));
    assert!(!said.contains("effects: pilot 1 with none") && said.contains("effects: pilot 6"), "{said}");
    assert!(fs::read(output).unwrap() == fs::read(interrupted).unwrap());

    let (_, mut fork) = run("d.psb");
    let said = fails(fork.arg("--from").arg(&folder).args(["--at", "60"]).args(measured));
    assert!(said.contains("a fork keeps the effects of its run"), "{said}");
    assert!(!home.join("d.run").exists(), "before anything was done");
}
