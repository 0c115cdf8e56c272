//! `<pocketsplat-view>` in a real browser: its canvas has the decoder's pixels, and it says what it cannot draw.
//!
//! Needs Chromium; without one it says aloud that it checked nothing.

mod chromium;

use pocketsplat_viewer::package;

const SCRIPT: &str = include_str!("element.js");

#[test]
fn the_element_draws_and_says_what_it_cannot() {
    let bundles: [(&str, &[u8]); 3] = [
        ("scene.psb", include_bytes!("../../tests/golden/static.psb")),
        ("other.psb", include_bytes!("../../tests/golden/matte.psb")),
        ("damaged.psb", b"no bundle"),
    ];
    let files: Vec<(&str, Vec<u8>)> =
        package().iter().map(|file| (file.name, file.bytes)).chain(bundles).map(|(n, b)| (n, b.to_vec())).collect();
    let Some(said) = chromium::said_of_example(files, SCRIPT) else { return };
    let n_passed = said.iter().filter(|line| line.starts_with("passed ")).count();
    assert!(n_passed >= 15, "{said:#?}");
}
