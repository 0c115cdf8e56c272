//! `pocketsplat report`: the page that a run ends with, in a browser.

use std::fs;
use std::path::Path;

use crate::chromium;
use crate::fixture::{capture, folder, pocketsplat, text, undisturbed, undisturbed_run};

const SCRIPT: &str = include_str!("report.js");

#[test]
fn a_run_ends_with_a_page_that_works() {
    let (folder, capture) = (folder("report"), capture());
    let bundle = folder.join("scene.psb");
    let mut command = pocketsplat();
    command.arg("train").arg(capture).arg("-o").arg(&bundle).args(["--iterations", "60", "--backbone", "hac"]);
    let trained = command.output().unwrap();
    assert!(trained.status.success(), "{}", text(&trained.stderr));
    let page = folder.join("scene.run/report.html");
    assert!(text(&trained.stderr).contains("report.html"), "{}", text(&trained.stderr));
    let html = fs::read_to_string(&page).unwrap();
    assert!(html.len() < 4_000_000, "{} bytes", html.len());
    for absent in ["http:", "{{", ">NaN", ">inf"] {
        let at = html.replace("http://www.w3.org/2000/svg", "").find(absent);
        assert!(at.is_none(), "{absent}");
    }
    assert!(
        html.contains(" data-spread=&quot;"),
        "the bundle says how far its cameras stand apart, and the viewer is told"
    );
    if let Some(said) = chromium::said_by(&html, SCRIPT) {
        assert!(said.len() > 8, "{said:#?}");
    }
    chromium::axe::has_no_violations("report", &html);
    // The same again, elsewhere.
    let again = folder.join("again.html");
    let made = pocketsplat().arg("report").arg(folder.join("scene.run")).arg("-o").arg(&again).output().unwrap();
    assert!(made.status.success(), "{}", text(&made.stderr));
    assert_eq!(fs::read_to_string(&again).unwrap(), html);
    // Photographs that have gone.
    let without = pocketsplat()
        .arg("report")
        .arg(folder.join("scene.run"))
        .arg(folder.join("nothing"))
        .arg("-o")
        .arg(&again)
        .output()
        .unwrap();
    assert!(without.status.success() && text(&without.stderr).contains("the page will lack photographs"));
    assert!(fs::read_to_string(&again).unwrap().contains("not at hand"));
}

#[test]
fn a_report_is_of_the_runs_own_bundle_wherever_both_lie() {
    let home = folder("report-moved");
    let run = home.join("scene.run");
    fs::create_dir(&run).unwrap();
    let report = || {
        let output = pocketsplat().arg("report").arg(&run).output().unwrap();
        (output.status.success(), text(&output.stderr))
    };
    for name in ["config.toml", "result.json", "progress.csv"] {
        fs::copy(undisturbed_run().join(name), run.join(name)).unwrap();
    }
    let config = fs::read_to_string(run.join("config.toml")).unwrap();
    let elsewhere = home.join("elsewhere/scene.psb").display().to_string();
    let line =
        |line: &str| if line.starts_with("output") { format!("output = \"{elsewhere}\"") } else { line.to_owned() };
    fs::write(run.join("config.toml"), config.lines().map(line).collect::<Vec<_>>().join("\n")).unwrap();
    let (_, said) = report();
    assert!(said.contains("there is no bundle") && said.contains(&elsewhere), "{said}");
    let bundle = home.join("scene.psb");
    fs::write(&bundle, undisturbed()).unwrap();
    let (good, said) = report();
    assert!(good, "{said}");
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden/static.psb");
    fs::copy(golden, &bundle).unwrap();
    let (_, said) = report();
    assert!(said.contains("another run has replaced it"), "{said}");
}

#[test]
fn a_run_that_is_not_finished_is_refused() {
    let folder = folder("report-unfinished");
    let run = folder.join("a.run");
    let refused = pocketsplat().arg("report").arg(&run).output().unwrap();
    assert!(!refused.status.success() && text(&refused.stderr).contains("config.toml"), "{}", text(&refused.stderr));
}
