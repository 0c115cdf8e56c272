//! `train --continue`, `plan-runs` and `tables`: what a queue of jobs asks for.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::fixture::{capture, fails, folder, pocketsplat, starts, succeeds, train, undisturbed, wait_for};

/// `train --config --continue` for the configuration of a run.
fn continues(config: &Path) -> Command {
    let mut command = pocketsplat();
    command.arg("train").arg("--config").arg(config).arg("--continue");
    command
}

#[test]
fn a_run_is_continued_from_wherever_it_stands() {
    let home = folder("continue");
    let (bundle, config) = (home.join("a.psb"), home.join("a.toml"));
    // What the run keeps is what it is asked for again.
    let mut child = starts(&mut train(&bundle));
    wait_for(&bundle.with_extension("run"), 45, &mut child);
    child.kill().unwrap();
    child.wait().unwrap();
    fs::copy(bundle.with_extension("run").join("config.toml"), &config).unwrap();
    let said = succeeds(&mut continues(&config));
    assert!(said.contains("going on after iteration "), "{said}");
    assert_eq!(fs::read(&bundle).unwrap(), undisturbed());

    let modified = fs::metadata(&bundle).unwrap().modified().unwrap();
    let said = succeeds(&mut continues(&config));
    assert!(said.contains("trained before") && !said.contains("going on"), "{said}");
    assert_eq!(fs::metadata(&bundle).unwrap().modified().unwrap(), modified, "a finished run is left alone");

    fs::remove_dir_all(bundle.with_extension("run")).unwrap();
    succeeds(&mut continues(&config));
    assert_eq!(fs::read(&bundle).unwrap(), undisturbed(), "not begun, it is begun");

    let error = fails(continues(&config).args(["--seed", "7"]));
    assert!(error.contains("`train.seed` is 42 in the run, 7 on the command line"), "{error}");
}

const PLAN: &str = r#"
[captures.SyntheticNeRF]
lego = "CAPTURE"

[options]
iterations = 20
feature-dim = 8
offsets = 3

[vary]
backbone = ["scaffold", "hac", "hac-plus"]
lambda = [0.004, 0.001]
seed = [1, 2]
"#;

fn plan(home: &Path, text: &str) -> Command {
    let path = home.join("plan.toml");
    fs::write(&path, text.replace("CAPTURE", &capture().display().to_string())).unwrap();
    let mut command = pocketsplat();
    command.args(["--threads", "1", "plan-runs"]).arg(path).arg("-o").arg(home.join("runs"));
    command
}

/// What `eval` would have found.
fn measured(psnr_db: f64, bundle_bytes: u32) -> String {
    let figures = serde_json::json!({
        "psnr_db": psnr_db, "ssim": 0.9, "half_size_copy_psnr_db": 20.0, "bundle_bytes": bundle_bytes, "n_anchors": 10,
        "n_gaussians": 100, "n_views": 3, "split": "test", "renderer": "core", "width_px": 32, "height_px": 32,
        "background": "black", "decode_s": 0.1, "render_s_per_view": 0.1, "scratch_bytes": 1000
    });
    figures.to_string()
}

#[test]
fn a_plan_is_written_once_and_its_tables_say_what_is_there() {
    let home = folder("plan");
    let published = home.join("published.csv");
    let heads = "Dataset,Scene,Method,Submethod,PSNR,SSIM,LPIPS,Size [Bytes],#Gaussians,Source,Note";
    let rows = "SyntheticNeRF,,HAC,low,33.24,0.967,0.037,1240000,,a paper,\nSyntheticNeRF,lego,HAC,low,35.04,0.979,0.022,1310720,,a \
                paper,\nDeepBlending,,HAC,low,29.98,0.902,,4560000,,a paper,\n";
    fs::write(&published, format!("{heads}\n{rows}")).unwrap();
    let beside = format!("published = \"published.csv\"\n{PLAN}");
    let said = succeeds(&mut plan(&home, &beside.replace("SyntheticNeRF", "nerf_synthetic")));
    assert!(said.contains("no published result is of nerf_synthetic lego"), "{said}");
    let said = succeeds(&mut plan(&home, &beside));
    assert!(!said.contains("no published result"), "{said}");
    let runs = home.join("runs");
    let planned: serde_json::Value = serde_json::from_slice(&fs::read(runs.join("runs.json")).unwrap()).unwrap();
    let planned = planned["runs"].as_array().unwrap().clone();
    assert_eq!(planned.len(), 2 + 2 * 4, "scaffold has no weight of bits");
    for run in &planned {
        assert!(run["memory_mb"].as_u64().unwrap() > 10 && run["minutes"].as_u64().unwrap() > 0, "{run}");
        assert_eq!(run["threads"], 1);
    }
    // A queue compares times: what is right already is not written again.
    let config = runs.join("lego/hac-lambda-0.001-seed-2.toml");
    let before = fs::metadata(&config).unwrap().modified().unwrap();
    succeeds(&mut plan(&home, &beside));
    assert_eq!(fs::metadata(&config).unwrap().modified().unwrap(), before);

    let tables = || {
        let mut command = pocketsplat();
        command.arg("tables").arg(&runs);
        command
    };
    assert!(fails(&mut tables()).contains("no run of "), "nothing is measured");
    // HAC++ takes four fifths of HAC's bytes for the same PSNR; its seeds differ by two percent.
    for (lambda, psnr_db, bytes) in [("0.004", 30.0, 100_000.0), ("0.001", 33.0, 300_000.0)] {
        for (method, factor) in [("hac", 1.0), ("hac-plus", 0.8)] {
            for (seed, spread) in [(1, 0.99), (2, 1.01)] {
                let figures = measured(psnr_db, (bytes * factor * spread) as u32);
                fs::write(runs.join(format!("lego/{method}-lambda-{lambda}-seed-{seed}.json")), figures).unwrap();
            }
        }
    }
    succeeds(&mut tables());
    let read = |name: &str| fs::read_to_string(runs.join("tables").join(name)).unwrap();
    assert_eq!(read("runs.csv").lines().count(), 9, "the two of scaffold are not measured");
    let differences = read("bd_rate.csv");
    let cells: Vec<&str> = differences.lines().nth(1).unwrap().split(',').collect();
    assert_eq!(&cells[2..7], ["lego", "hac-plus", "hac", "2", "2"], "{differences}");
    let [rate, low, high] = [7, 8, 9].map(|i| cells[i].parse::<f64>().unwrap());
    assert!((rate + 20.0).abs() < 0.01 && low < -21.0 && high > -19.0, "{differences}");
    let scene = read("SyntheticNeRF/lego.csv");
    assert!(scene.contains("hac,lambda=0.004,30.0,0.9,,100000.0,100.0,2,1"), "{scene}");
    let page = read("comparison.md");
    assert!(page.contains("| HAC low | 33.24 / 0.967 / 0.037 / 1.24 | 29.98 / 0.902 / – / 4.56 |"), "{page}");
    assert!(page.contains("| **ours: hac lambda=0.004, 32×32 px** | 30.00 / 0.900 / – / 0.10 | not run |"), "{page}");
    let has_published = |figure: &str| read(figure).contains("HAC (published)");
    assert!(has_published("SyntheticNeRF/lego.svg") && has_published("SyntheticNeRF.svg"), "the plan names them");

    // A mean over scenes that the plan does not have.
    let mic = "SyntheticNeRF,mic,HAC,low,35.9,0.99,0.01,900000,,a paper,";
    fs::write(&published, format!("{heads}\n{rows}{mic}\n")).unwrap();
    succeeds(tables().arg("--published").arg(&published));
    assert!(has_published("SyntheticNeRF/lego.svg") && !has_published("SyntheticNeRF.svg"), "of one scene of two");
    assert!(read("comparison.md").contains("1 of 2 scenes"), "{page}");

    fs::write(&published, format!("{heads}\nA,,HAC,,30,,,,,,\n")).unwrap();
    assert!(fails(tables().arg("--published").arg(&published)).contains("has no Source"));
}

#[test]
fn a_plan_that_train_would_refuse_is_refused_before_any_work() {
    let home = folder("bad-plan");
    let refused = |text: &str| fails(&mut plan(&home, text));
    let error = refused(&PLAN.replace("feature-dim = 8", "feature-dims = 8"));
    assert!(error.contains("lego/scaffold-seed-1 is no run") && error.contains("--feature-dims"), "{error}");
    let error = refused(&PLAN.replace("0.001]", "-1]"));
    assert!(error.contains("lego/hac-lambda--1-seed-1 is no run") && error.contains("lambda"), "{error}");
    let error = refused(&PLAN.replace("\"scaffold\"", "\"3dgs\""));
    assert!(error.contains("makes no bundle"), "{error}");
    let names = |names: &str| refused(&format!("{PLAN}[names]\n{names}\n"));
    let error = names("hac = \"ours\"\nhac-plus = \"ours\"");
    assert!(error.contains("`hac` and `hac-plus` are both called ours"), "{error}");
    let error = names("hacc = \"ours\"");
    assert!(error.contains("calls `hacc` \"ours\"") && error.contains("hac, hac-plus, scaffold"), "{error}");
    let error = refused(&format!("{PLAN}[[exclude]]\nlambda = 0.002\n"));
    assert!(error.contains("lambda 0.002, which no run has"), "{error}");
    let error = refused(&PLAN.replace("offsets = 3", "effects = \"auto\""));
    assert!(error.contains("need the same effects"), "{error}");
    let error = refused("captures.a.lego = \"missing\"");
    assert!(error.contains("missing"), "{error}");
    assert!(!home.join("runs/runs.json").exists(), "nothing was written");
}

const RATES: &str = r#"
[captures.Synthetic]
lamp = "CAPTURE"

[options]
iterations = 80
feature-dim = 8
offsets = 3
checkpoint-every = 20
modules = "rdo-pruning,tiered-pruning"

[vary]
lambda = [0.004, 0.001]
"#;

#[test]
fn runs_of_a_plan_go_on_where_they_were_stopped_and_nothing_is_trained_twice() {
    let home = folder("plan-run");
    let run = |text: &str| {
        let mut command = plan(&home, text);
        command.arg("--run");
        command
    };
    let runs = home.join("runs");
    let mut child = starts(&mut run(RATES));
    wait_for(&runs.join("lamp/lambda-0.004.run"), 45, &mut child);
    child.kill().unwrap();
    child.wait().unwrap();
    let table = runs.join("tables/runs.csv");
    assert!(!table.exists(), "no run is done");

    let said = succeeds(&mut run(RATES));
    assert!(said.contains("going on after iteration ") && !said.contains("trained before"), "{said}");
    let first = fs::read_to_string(&table).unwrap();
    assert_eq!(first.lines().count(), 3, "{first}");
    let heads: Vec<&str> = first.lines().next().unwrap().split(',').collect();
    let at = |name: &str| heads.iter().position(|head| *head == name).unwrap();
    for (row, lambda) in first.lines().skip(1).zip(["0.004", "0.001"]) {
        let cells: Vec<&str> = row.split(',').collect();
        let bytes = fs::metadata(runs.join(format!("lamp/lambda-{lambda}.psb"))).unwrap().len();
        assert_eq!(
            (cells[at("rate")], cells[at("Size [Bytes]")]),
            (&*format!("lambda={lambda}"), &*bytes.to_string()),
            "{row}"
        );
        assert!(cells[at("PSNR")].parse::<f64>().unwrap() > 10.0 && cells[at("LPIPS")].is_empty(), "no weights: {row}");
    }
    let figures = fs::read_to_string(runs.join("lamp/lambda-0.001.json")).unwrap();
    assert!(figures.contains("\"pruning_rate\""), "trained tiers are measured: {figures}");

    let said = succeeds(&mut run(&RATES.replace("0.001]", "0.001, 0.002]")));
    assert_eq!(said.matches("trained before").count(), 2, "{said}");
    let longer = fs::read_to_string(&table).unwrap();
    assert_eq!(longer.lines().count(), 4);
    assert!(
        first.lines().all(|line| longer.lines().any(|other| other == line)),
        "{longer} has what was there: {first}"
    );
    let mut plot = pocketsplat();
    let figure = home.join("rates.svg");
    succeeds(plot.arg("plot").arg(&table).arg("-o").arg(&figure));
    let figure = fs::read_to_string(figure).unwrap();
    // A marker for each rate, and one in the legend; names stand where there is room.
    assert!(figure.matches("<circle").count() == 4 && figure.contains("λ 0.001"), "{figure}");

    let error = fails(&mut run(&RATES.replace("iterations = 80", "iterations = 81")));
    assert!(
        error.contains("`train.iterations` is 80 in the run, 81 on the command line")
            && error.contains("lambda-0.004.run"),
        "{error}"
    );
}
