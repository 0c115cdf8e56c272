//! `pocketsplat view`: a page and a folder, or a refusal that leaves nothing behind.

use std::fs;
use std::path::Path;

use crate::fixture::{folder, pocketsplat, text};

#[test]
fn a_page_and_a_package_are_written_whole() {
    let folder = folder("view");
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden");
    let (page, package) = (folder.join("deep/two.html"), folder.join("pkg"));
    let mut command = pocketsplat();
    command.arg("view").args([golden.join("static.psb"), golden.join("context.psb")]);
    let made = command.arg("-o").arg(&page).arg("--package").arg(&package).output().unwrap();
    assert!(made.status.success(), "{}", text(&made.stderr));
    let html = fs::read_to_string(&page).unwrap();
    assert!(html.contains("data-bundle=\"static\"") && html.contains("data-bundle=\"context\""), "both bundles");
    assert_eq!(fs::read(package.join("scene.psb")).unwrap(), fs::read(golden.join("static.psb")).unwrap());
    assert!(fs::read_to_string(package.join("package.json")).unwrap().contains("\"type\": \"module\""));
    assert!(fs::read(package.join("pocketsplat.wasm")).unwrap().starts_with(b"\0asm"));
    let into = |package: &Path| {
        let bundle = golden.join("context.psb");
        pocketsplat().arg("view").arg(bundle).arg("--package").arg(package).output().unwrap()
    };
    assert!(into(&package).status.success(), "a package is written anew");
    let mine = folder.join("mine");
    fs::create_dir(&mine).unwrap();
    fs::write(mine.join("scene.psb"), "mine").unwrap();
    let said = text(&into(&mine).stderr);
    assert!(
        said.contains("scene.psb exists already") && fs::read(mine.join("scene.psb")).unwrap() == b"mine",
        "{said}"
    );
}

#[test]
fn what_is_no_bundle_or_no_page_is_refused_and_nothing_is_written() {
    let folder = folder("view-refused");
    let (bundle, page) = (folder.join("a.psb"), folder.join("a.html"));
    fs::write(&bundle, b"solid cube").unwrap();
    let refused = |bundle: &Path, output: &Path| {
        let output = pocketsplat().arg("view").arg(bundle).arg("-o").arg(output).output().unwrap();
        assert_eq!(output.status.code(), Some(1));
        text(&output.stderr)
    };
    let message = refused(&bundle, &page);
    assert!(message.contains("a.psb") && message.contains("the first 8 bytes differ"), "{message}");
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden/static.psb");
    let message = refused(&golden, &bundle);
    assert!(message.contains("end the name in .html"), "{message}");
    assert_eq!(fs::read(&bundle).unwrap(), b"solid cube", "a bundle given as the page is not written over");
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1, "no page");
}
