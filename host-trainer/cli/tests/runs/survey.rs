//! `survey`: methods side by side.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::fixture::{capture, fails, folder, pocketsplat, starts, succeeds};

fn survey(output: &Path) -> Command {
    let mut command = pocketsplat();
    command.arg("survey").arg(capture()).arg("-o").arg(output);
    command.args(["--iterations", "20", "--random-points", "300"]);
    command
}

/// The table without what depends on time.
fn table(folder: &Path) -> Vec<Vec<String>> {
    let text = fs::read_to_string(folder.join("survey.csv")).unwrap();
    let rows: Vec<Vec<String>> = text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect();
    let lasts = |i: &usize| !["decode_s", "train_s"].contains(&&*rows[0][*i]);
    rows.iter().map(|row| (0..row.len()).filter(lasts).map(|i| row[i].clone()).collect()).collect()
}

#[test]
fn a_survey_that_is_killed_goes_on_and_ends_in_the_same_table() {
    let home = folder("survey");
    let published = home.join("published.csv");
    let heads = "Dataset,Scene,Method,Submethod,PSNR,SSIM,LPIPS,Size [Bytes],#Gaussians,Source,Note";
    fs::write(&published, format!("{heads}\nProcedural,capture,HAC,low,35.04,0.979,,1310720,,a paper,\n")).unwrap();
    let (whole, killed) = (home.join("whole"), home.join("killed"));
    let printed = survey(&whole).arg("--published").arg(&published).output().unwrap();
    assert!(printed.status.success(), "{}", String::from_utf8_lossy(&printed.stderr));
    let printed = String::from_utf8_lossy(&printed.stdout).into_owned();
    let rows = table(&whole);
    assert_eq!(printed.lines().count(), rows.len());
    let methods: Vec<&str> = rows[1..].iter().map(|row| row[0].as_str()).collect();
    let explicit = ["3DGS", "LightGaussian", "RDO-Gaussian", "SOG", "Compact3DGS"];
    let measured = [&explicit[..], &["Scaffold-GS", "HAC", "HAC++", "ContextGS", "pocketsplat"]].concat();
    for method in measured.iter().chain(&["HAC (published)"]) {
        assert!(methods.contains(method) && printed.contains(method), "{method}: {methods:?}");
    }
    assert_eq!(methods.iter().filter(|method| **method == "SOG").count(), 2, "two rates");
    assert_eq!(
        fs::read_dir(whole.join("pictures")).unwrap().count(),
        1 + measured.len(),
        "one for each method, and the photograph"
    );
    assert!(fs::read_to_string(whole.join("survey.svg")).unwrap().contains("ContextGS"));

    let mut child = starts(survey(&killed).arg("--published").arg(&published));
    // With some methods behind, and others before it.
    while !killed.join("hac-lambda=0.004.json").exists() {
        assert!(child.try_wait().unwrap().is_none(), "ended before");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let ply = || fs::metadata(killed.join("3dgs.ply")).unwrap().modified().unwrap();
    let before = ply();
    let said = succeeds(survey(&killed).arg("--published").arg(&published));
    assert!(said.contains("trained before") && said.contains("compressed before"), "{said}");
    assert_eq!(ply(), before, "what is done is not done again");
    assert_eq!(table(&killed), rows);

    // A command that ends before the end leaves the table whole.
    let kept = killed.join("sog-harmonics.json");
    let figures = fs::read_to_string(&kept).unwrap();
    fs::write(&kept, "{}").unwrap();
    let said = fails(survey(&killed).arg("--published").arg(&published));
    assert!(said.contains("has no figures of a run"), "{said}");
    assert_eq!(table(&killed), rows);

    // Figures and runs of a program that trains otherwise are none of ours.
    let program: Vec<&str> = rows[1].last().unwrap().split(' ').take(2).collect();
    let by_another = |text: &str| text.replace(&program.join(" "), "0.0.9 r1");
    fs::write(&kept, by_another(&figures)).unwrap();
    let said = succeeds(survey(&killed).arg("--published").arg(&published));
    assert!(said.contains("the figures are of pocketsplat 0.0.9 r1"), "{said}");
    assert_eq!(table(&killed), rows);
    assert!(!fs::read_to_string(&kept).unwrap().contains("0.0.9"));
    for run in ["3dgs.ply.run", "contextgs-lambda=0.004.run"] {
        let result = killed.join(run).join("result.json");
        let ours = fs::read_to_string(&result).unwrap();
        fs::write(&result, by_another(&ours)).unwrap();
        let said = fails(&mut survey(&killed));
        assert!(said.contains("was trained by pocketsplat 0.0.9 r1, and this is"), "{said}");
        assert!(said.contains("choose another --output, or go on with that program"), "{said}");
        fs::write(&result, ours).unwrap();
    }

    let said = fails(survey(&killed).args(["--seed", "7"]));
    assert!(said.contains("`gaussians.seed` is 42 in the run, 7 on the command line"), "{said}");
    assert!(said.contains("choose another --output"), "{said}");
}

#[test]
fn points_are_matched_once() {
    let home = folder("survey_points");
    let capture = home.join("capture");
    succeeds(pocketsplat().arg("synth").arg(&capture).args(["--size", "96", "--train-views", "16"]));
    let mut command = pocketsplat();
    command.arg("survey").arg(&capture).arg("-o").arg(home.join("out"));
    let said = succeeds(command.args(["--iterations", "6", "--points", "matched"]));
    let times = |what: &str| said.matches(what).count();
    assert_eq!(times("initial points matched"), 2, "for 3DGS and for anchors: {said}");
    assert_eq!(times("matched between the photographs by an earlier run"), 1, "{said}");
}

#[test]
fn what_no_survey_can_use_is_refused_before_any_work() {
    let output = folder("survey_refused").join("out");
    let refused = |option: &str, value: &str| fails(survey(&output).args([option, value]));
    let learned = survey(&output).args(["--background", "learned"]).output().unwrap();
    let said = String::from_utf8_lossy(&learned.stderr).into_owned();
    assert!(learned.status.code() == Some(2) && said.contains("possible values: black, white"), "{said}");
    assert!(refused("--test-every", "0").contains("holds out no view"));
    let mut none = pocketsplat();
    none.arg("survey").arg(capture()).arg("-o").arg(&output).args(["--iterations", "0"]);
    let said = fails(&mut none);
    assert!(said.contains("gaussians.iterations is 0"), "{said}");
    assert!(refused("--published", "nothing.csv").contains("nothing.csv"));
    assert!(refused("--lpips-weights", "nothing.safetensors").contains("nothing.safetensors"));
    assert!(!output.exists(), "nothing was begun");
}
