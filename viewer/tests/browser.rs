//! The page in a real browser: its canvas has the decoder's bytes, its controls do what they say, nothing is fetched.
//!
//! Needs Chromium; without one it says aloud that it checked nothing. `POCKETSPLAT_VIEW=SCENE.psb` measures a page of that bundle too.

mod chromium;

use std::f32::consts::TAU;
use std::fmt::Write as _;

use pocketsplat_core::{Budget, Bundle, Overflow};
use pocketsplat_format::bundle::crc32;
use pocketsplat_viewer::{Scene, SceneFile, page};

const GOLDEN: [SceneFile<'_>; 4] = [
    SceneFile { name: "static", bytes: include_bytes!("../../tests/golden/static.psb"), spread: None },
    SceneFile { name: "context", bytes: include_bytes!("../../tests/golden/context.psb"), spread: None },
    SceneFile { name: "matte", bytes: include_bytes!("../../tests/golden/matte.psb"), spread: None },
    SceneFile { name: "isotropic", bytes: include_bytes!("../../tests/golden/isotropic.psb"), spread: None },
];
const FRAMES: &str = include_str!("../../tests/golden/frames.csv");
const SCRIPT: &str = include_str!("browser.js");
const MANY_CORES: &str = "Object.defineProperty(navigator, 'hardwareConcurrency', { value: 64 })";

#[test]
fn the_canvas_has_the_golden_frames_and_the_controls_work() {
    let Some(said) = run("golden", &GOLDEN) else { return };
    let mut found = "bundle,tiers,view,crc32\n".to_owned();
    for row in said.iter().filter_map(|line| line.strip_prefix("frame ")) {
        writeln!(found, "{row}").expect("a string takes all");
    }
    assert_eq!(found, FRAMES, "pixels of the canvas");
    let passed = |what: &str| said.iter().filter(|line| line.starts_with("passed ") && line.ends_with(what)).count();
    assert!(passed("") > 100 && passed("less memory, same pixels") > 10, "{said:#?}");
}

#[test]
fn a_page_of_one_bundle_draws() {
    let given = std::env::var_os("POCKETSPLAT_VIEW").map(|path| std::fs::read(path).expect("readable"));
    let name = if given.is_some() { "given" } else { "static" };
    let bytes = given.as_deref().unwrap_or(GOLDEN[0].bytes);
    println!("a page of {} bytes", page(name, &[SceneFile { name, bytes, spread: None }]).len());
    let Some(said) = run(name, &[SceneFile { name, bytes, spread: None }]) else { return };
    said.iter()
        .filter(|line| line.starts_with("first ") || line.starts_with("speed "))
        .for_each(|line| println!("{line}"));
    let found: Vec<&str> = said.iter().filter_map(|line| line.strip_prefix("frame ")).collect();
    assert_eq!(found, frames(name, bytes), "pixels of the canvas");
}

#[test]
fn pages_keep_the_rules_of_accessibility() {
    for (what, scenes) in [("page of a bundle", &GOLDEN[..1]), ("page of two bundles", &GOLDEN[..2])] {
        chromium::axe::has_no_violations(what, &page("a scene", scenes));
    }
}

/// The frames of a bundle as this machine draws them: a row for each as in `frames.csv`.
fn frames(name: &str, bytes: &[u8]) -> Vec<String> {
    let bundle = Bundle::parse(bytes).expect("a sound bundle");
    let mut scene = Scene::open(bytes.to_vec().leak()).expect("a sound bundle");
    let preview = scene.preview();
    let mut rows = Vec::new();
    for tiers in 1..=bundle.n_tiers() {
        let budget =
            Budget::for_frame(preview.width_px, preview.height_px).with_tiers(tiers).with_overflow(Overflow::Slabs);
        scene.bind(&budget).expect("planned");
        for view in 0..4_u8 {
            scene.render(&preview.orbited(TAU * f32::from(view) / 4.0)).expect("drawn");
            let (pixels, _) = scene.rgba().as_chunks::<4>();
            let rgb: Vec<u8> = pixels.iter().flat_map(|&[red, green, blue, _]| [red, green, blue]).collect();
            rows.push(format!("{name},{tiers},{view},{:08x}", crc32(&rgb)));
        }
    }
    rows
}

/// Opens a page of bundles with the script, and returns what it says; nothing where there is no browser.
fn run(title: &str, scenes: &[SceneFile<'_>]) -> Option<Vec<String>> {
    let text = page(title, scenes);
    // Several bundles get two workers each, one bundle what this machine has cores for.
    let text =
        if scenes.len() > 1 { text.replace("<head>", &format!("<head><script>{MANY_CORES}</script>")) } else { text };
    chromium::said_by(&text, SCRIPT)
}
