//! `pocketsplat report`: the page that a run ends with, in a browser.

use std::fs;

use crate::chromium;
use crate::fixture::{capture, folder, pocketsplat, text};

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
    if let Some(said) = chromium::said_by(&html, SCRIPT) {
        assert!(said.len() > 8, "{said:#?}");
    }
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
fn a_run_that_is_not_finished_is_refused() {
    let folder = folder("report-unfinished");
    let run = folder.join("a.run");
    let refused = pocketsplat().arg("report").arg(&run).output().unwrap();
    assert!(!refused.status.success() && text(&refused.stderr).contains("config.toml"), "{}", text(&refused.stderr));
}
