//! The page in a real browser: its canvas has the decoder's bytes, its controls do what they say, nothing is fetched.
//!
//! Needs Chromium; without one it says aloud that it checked nothing. `POCKETSPLAT_VIEW=SCENE.psb` measures a page of that bundle too.

use std::f32::consts::TAU;
use std::fmt::Write as _;
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use pocketsplat_core::bundle::crc32;
use pocketsplat_core::{Budget, Bundle, Overflow};
use pocketsplat_viewer::{Scene, SceneFile, page};

const GOLDEN: [SceneFile<'_>; 4] = [
    SceneFile { name: "static", bytes: include_bytes!("../../tests/golden/static.psb") },
    SceneFile { name: "context", bytes: include_bytes!("../../tests/golden/context.psb") },
    SceneFile { name: "matte", bytes: include_bytes!("../../tests/golden/matte.psb") },
    SceneFile { name: "isotropic", bytes: include_bytes!("../../tests/golden/isotropic.psb") },
];
const FRAMES: &str = include_str!("../../tests/golden/frames.csv");
const SCRIPT: &str = include_str!("browser.js");
const MANY_CORES: &str = "Object.defineProperty(navigator, 'hardwareConcurrency', { value: 64 })";
/// What a page may take on a machine that does other things too.
const PATIENCE: Duration = Duration::from_secs(240);

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
    println!("a page of {} bytes", page(name, &[SceneFile { name, bytes }]).len());
    let Some(said) = run(name, &[SceneFile { name, bytes }]) else { return };
    said.iter()
        .filter(|line| line.starts_with("first ") || line.starts_with("speed "))
        .for_each(|line| println!("{line}"));
    let found: Vec<&str> = said.iter().filter_map(|line| line.strip_prefix("frame ")).collect();
    assert_eq!(found, frames(name, bytes), "pixels of the canvas");
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

/// Opens a page with the script, and returns what it says; nothing where there is no browser. Fails for a check that failed, and for
/// whatever else the page has to say, such as an error.
fn run(title: &str, scenes: &[SceneFile<'_>]) -> Option<Vec<String>> {
    let Some(browser) = browser() else {
        assert!(std::env::var_os("POCKETSPLAT_NEEDS_BROWSER").is_none(), "no Chromium: apt-get install chromium");
        println!("SKIPPED: no Chromium (apt-get install chromium), so the page was not opened");
        return None;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("page.html");
    let text = page(title, scenes).replace("</body>", &format!("<script type=\"module\">{SCRIPT}</script></body>"));
    // Several bundles get two workers each, one bundle what this machine has cores for.
    let text =
        if scenes.len() > 1 { text.replace("<head>", &format!("<head><script>{MANY_CORES}</script>")) } else { text };
    std::fs::write(&file, text).expect("written");
    let mut child = start(&browser, &file, &folder.path().join("profile"));
    let stderr = BufReader::new(child.0.stderr.take().expect("piped"));
    let (sender, lines) = mpsc::channel();
    std::thread::spawn(move || stderr.lines().map_while(Result::ok).try_for_each(|line| sender.send(line)));
    let (start, mut said, mut log) = (Instant::now(), Vec::new(), Vec::new());
    loop {
        let left = PATIENCE.saturating_sub(start.elapsed());
        let line = lines.recv_timeout(left).unwrap_or_else(|error| panic!("{error} after {said:#?}; {log:#?}"));
        // [process:thread:time:INFO:CONSOLE:line] "text", source: …
        let Some((_, message)) = line.split_once("CONSOLE") else {
            log.push(line);
            continue;
        };
        let text = message.split_once("] \"").map_or(message, |(_, text)| text);
        let text = text.rsplit_once("\", source:").map_or(text, |(text, _)| text);
        match text.strip_prefix("pocketsplat: ") {
            Some("done") => return Some(said),
            Some(text) if !text.starts_with("FAILED") => said.push(text.to_owned()),
            _ => panic!("the page says {text:?}, after {said:#?}"),
        }
    }
}

/// A browser that ends with the test.
struct Browser(Child);

impl Drop for Browser {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn start(browser: &str, file: &Path, profile: &Path) -> Browser {
    const FLAGS: [&str; 12] = [
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-quic",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--disable-dev-shm-usage",
        "--window-size=1280,800",
        "--enable-logging=stderr",
        "--v=0",
    ];
    let mut command = Command::new(browser);
    command.args(FLAGS).arg(format!("--user-data-dir={}", profile.display())).arg(format!("file://{}", file.display()));
    Browser(command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("started"))
}

fn browser() -> Option<String> {
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let runs = |name: &&str| {
        Command::new(name)
            .arg("--version")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status()
            .is_ok_and(|s| s.success())
    };
    names.into_iter().find(|name| runs(name)).map(str::to_owned)
}
