//! A page in Chromium, and what it says.

#![expect(dead_code, reason = "each suite takes what it needs of it")]

pub(crate) mod axe;
mod served;

use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// What a page may take on a machine that does other things too.
const PATIENCE: Duration = Duration::from_secs(240);

/// What a page is shown on.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Screen {
    /// 360 pixels wide, in a frame, since windows have a least width; else 1280.
    pub(crate) is_phone: bool,
    /// Whether whoever looks prefers dark pages.
    pub(crate) is_dark: bool,
}

/// Opens a page with a script at its end, and returns what it says: lines on the console that begin with `pocketsplat: `, up to `done`.
///
/// Nothing where there is no browser. Fails for a check that `FAILED`, and for whatever else the page has to say, such as an error.
pub(crate) fn said_by(page: &str, script: &str) -> Option<Vec<String>> {
    said_on(Screen::default(), page, script)
}

/// The same, on a screen.
pub(crate) fn said_on(screen: Screen, page: &str, script: &str) -> Option<Vec<String>> {
    let browser = needed()?;
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("page.html");
    // The last one: a page may hold another as text.
    let (before, after) = page.rsplit_once("</body>").expect("a page has an end");
    let text = format!("{before}<script type=\"module\">{script}</script></body>{after}");
    let text = if screen.is_phone { in_frame(&text) } else { text };
    std::fs::write(&file, text).expect("written");
    Some(said_at(screen, &browser, &format!("file://{}", file.display())))
}

/// Serves a folder's files, opens `example.html` of it with a script at its end, and returns what it says, as [`said_by`].
pub(crate) fn said_of_example(mut files: Vec<(&'static str, Vec<u8>)>, script: &str) -> Option<Vec<String>> {
    let browser = needed()?;
    let (_, page) = files.iter_mut().find(|(name, _)| *name == "example.html").expect("an example");
    page.extend(format!("<script type=\"module\">{script}</script>").bytes());
    let address = served::serve(files);
    Some(said_at(Screen::default(), &browser, &format!("{address}/example.html")))
}

/// The browser; without one nothing is checked, and that is said.
fn needed() -> Option<String> {
    let found = browser();
    if found.is_none() {
        assert!(std::env::var_os("POCKETSPLAT_NEEDS_BROWSER").is_none(), "no Chromium: apt-get install chromium");
        println!("SKIPPED: no Chromium (apt-get install chromium), so the page was not opened");
    }
    found
}

/// What the page at an address says up to `done`.
fn said_at(screen: Screen, browser: &str, address: &str) -> Vec<String> {
    let folder = tempfile::tempdir().expect("a folder");
    let mut child = start(screen, browser, address, folder.path());
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
            Some("done") => return said,
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

fn in_frame(page: &str) -> String {
    let page = page.replace('&', "&amp;").replace('"', "&quot;");
    format!(
        "<!doctype html><meta charset=\"utf-8\"><iframe srcdoc=\"{page}\" style=\"width:360px;height:740px;border:0\"></iframe>"
    )
}

fn start(screen: Screen, browser: &str, address: &str, profile: &Path) -> Browser {
    const FLAGS: &str = "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run \
        --disable-background-networking --disable-component-update --disable-sync --disable-dev-shm-usage \
        --window-size=1280,800 --enable-logging=stderr --v=0";
    let mut command = Command::new(browser);
    command.arg(format!("--blink-settings=preferredColorScheme={}", u8::from(!screen.is_dark)));
    command.args(FLAGS.split_whitespace()).arg(format!("--user-data-dir={}", profile.display())).arg(address);
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
