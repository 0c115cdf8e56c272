//! Rules of accessibility, as axe-core checks them.

use super::{Screen, said_on};

/// Names the file axe.min.js of the npm package axe-core; `tools/ci.sh` sets it.
const VARIABLE: &str = "POCKETSPLAT_AXE";

/// Frames are pages of their own, which are checked as such.
const SCRIPT: &str = r"
const say = (text) => console.log(`pocketsplat: ${text}`);
await globalThis.pocketsplat?.started;
await new Promise((resolve) => setTimeout(resolve, 500));
say(`${innerWidth} pixels wide, ${matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light'}`);
const { passes, violations } = await axe.run(document, { iframes: false });
for (const { id, nodes } of violations) say(`FAILED ${id}: ${nodes.map((node) => `${node.target} ${node.failureSummary}`).join('; ')}`);
say(`${passes.length} rules passed`);
say('done');
";

/// Fails where a page breaks a rule of axe-core, on a wide screen or a phone, light or dark.
///
/// Says aloud that it checked nothing where there is no axe-core or no browser.
pub(crate) fn has_no_violations(what: &str, page: &str) {
    let Some(path) = std::env::var_os(VARIABLE) else {
        println!(
            "SKIPPED: {VARIABLE} names no axe.min.js (npm install axe-core), so the rules of axe were not checked on the {what}"
        );
        return;
    };
    let axe = std::fs::read_to_string(&path).expect("axe.min.js is readable");
    for [is_phone, is_dark] in [[false, false], [false, true], [true, false], [true, true]] {
        let screen = Screen { is_phone, is_dark };
        let Some(said) = said_on(screen, &with_script(page, &axe), SCRIPT) else { return };
        println!("{what}: {}", said.join(", "));
        let on =
            format!("{} pixels wide, {}", if is_phone { 360 } else { 1280 }, if is_dark { "dark" } else { "light" });
        assert_eq!(said.first(), Some(&on), "{what}");
        let passed = said.last().and_then(|line| line.split(' ').next()).and_then(|n| n.parse::<u32>().ok());
        assert!(passed.is_some_and(|n| n > 15), "{what}: {said:#?}");
    }
}

/// The page with a script at its end, before the one that runs it.
fn with_script(page: &str, script: &str) -> String {
    let (before, after) = page.rsplit_once("</body>").expect("a page has an end");
    format!("{before}<script>{script}</script></body>{after}")
}
