//! The package for web developers, and what of the page needs no browser, in Node.js.
//!
//! Without Node.js it says aloud that it checked nothing.

use std::process::Command;

use pocketsplat_viewer::package;

#[test]
fn numbers_are_checked_and_motion_keeps_its_limits() {
    if Command::new("node").arg("--version").output().is_err() {
        assert!(std::env::var_os("POCKETSPLAT_NEEDS_BROWSER").is_none(), "no Node.js: apt-get install nodejs");
        println!("SKIPPED: no Node.js (apt-get install nodejs), so the package was not used");
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let files = package().into_iter().map(|file| (file.name, file.bytes));
    let scene: &[u8] = include_bytes!("../../tests/golden/static.psb");
    for (name, bytes) in files.chain([("scene.psb", scene)]) {
        std::fs::write(folder.path().join(name), bytes).expect("written");
    }
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/package.mjs");
    let output = Command::new("node").arg(script).arg(folder.path()).output().expect("started");
    let said = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
}
