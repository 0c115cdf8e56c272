//! Modules from the command line: attached, resumed, refused.

use std::fs;

use pocketsplat_format::Bundle;

use crate::fixture::{fails, folder, pocketsplat, resume, starts, succeeds, text, train, wait_for};

#[test]
fn a_run_with_every_module_goes_on_in_the_same_bytes_on_either_backbone() {
    for backbone in ["scaffold", "hac-plus"] {
        let home = folder(&format!("modules-{backbone}"));
        let names = if backbone == "hac-plus" {
            "distribution,tiered-pruning,rdo-pruning"
        } else {
            "distribution,tiered-pruning"
        };
        let modules = ["--backbone", backbone, "--modules", names, "--effects", "+detail"];
        let whole = home.join("whole.psb");
        succeeds(train(&whole).args(modules));
        let written = fs::read_to_string(home.join("whole.run/config.toml")).unwrap();
        for line in ["[train.modules.distribution]", "form = \"tiered\"", "rate = 0.4", "detail_hidden = 32"] {
            assert!(written.lines().any(|l| l == line), "{line}: {written}");
        }
        // Killed where places have been given out.
        let output = home.join("killed.psb");
        let mut child = starts(train(&output).args(modules));
        wait_for(&home.join("killed.run"), 110, &mut child);
        child.kill().unwrap();
        child.wait().unwrap();
        succeeds(&mut resume(&home.join("killed.run")));
        assert!(fs::read(&output).unwrap() == fs::read(&whole).unwrap(), "{backbone}");
        assert!(fs::read(&whole).unwrap() != crate::fixture::undisturbed());
    }
}

#[test]
fn modules_and_effects_of_the_command_line_replace_those_of_a_configuration_and_their_heads() {
    let home = folder("modules-replaced");
    let detailed = home.join("detailed.psb");
    let given = ["--modules", "distribution", "--effects", "+detail"];
    succeeds(train(&detailed).args(given));
    let config = home.join("detailed.run/config.toml");
    assert!(fs::read_to_string(&config).unwrap().contains("detail_hidden = 32"));
    for (modules, effects, detail) in
        [("none", "-detail", false), ("hard-pruning", "-detail", false), ("tiered-pruning", "+view-colour", true)]
    {
        let output = home.join(format!("{modules}.psb"));
        let mut command = pocketsplat();
        command.arg("train").arg("--config").arg(&config).arg("-o").arg(&output);
        succeeds(command.args(["--modules", modules, "--effects", effects]));
        let written = fs::read_to_string(output.with_extension("run").join("config.toml")).unwrap();
        assert_eq!(written.contains("detail_hidden = 32"), detail, "{modules}: {written}");
        assert!(!written.contains("[train.modules.distribution]"), "{modules}: {written}");
        assert_eq!(written.contains("[train.modules.pruning]"), modules != "none", "{written}");
        let bytes = fs::read(output).unwrap();
        assert_eq!(Bundle::parse(&bytes).unwrap().header().detail_hidden, if detail { 32 } else { 0 }, "{modules}");
    }
    // The modules that a run began with are no other setting: it goes on.
    let run = home.join("detailed.run");
    fs::remove_file(run.join("result.json")).unwrap();
    let error = fails(resume(&run).args(["--modules", "none"]));
    assert!(error.contains("the run began with another setting"), "{error}");
    succeeds(resume(&run).args(given));
}

#[test]
fn a_module_that_there_is_not_is_refused_by_its_name() {
    let output = folder("no-module").join("a.psb");
    let refused = train(&output).args(["--modules", "distribution,sharpening"]).output().unwrap();
    let error = text(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2), "wrong usage: {error}");
    assert!(error.contains("'sharpening'") && error.contains("distribution, hard-pruning, tiered-pruning"), "{error}");
    let error = fails(train(&output).args(["--modules", "hard-pruning,tiered-pruning"]));
    assert!(error.contains("needs one of the two"), "{error}");
    let error = fails(train(&output).args(["--modules", "hard-pruning", "--set", "train.modules.pruning.rate=0.7"]));
    assert!(error.contains("train.modules.pruning.rate is 0.7, needs 0 to 0.4"), "{error}");
    let error = fails(train(&output).args(["--effects", "+detail", "--set", "train.modules.detail.depth=3"]));
    assert!(error.contains("unknown key `train.modules.detail.depth`"), "{error}");
    let error = fails(train(&output).args(["--set", "train.modules.distribution.form=histogram"]));
    assert!(error.contains("unknown key `train.modules.distribution.form`; known here: divergence, spread"), "{error}");
}
