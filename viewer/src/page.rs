//! One HTML file that draws bundles, with everything inside.

use pocketsplat_instructions::board::{BOARDS, Board};

use crate::figures::name_of;
use crate::package::{CHECK, MODULE, MOTION, ORBIT, POCKETSPLAT, SHARPNESS, VIEW, WORKER};

const PAGE: &str = include_str!("../web/page.html");
const STYLE: &str = include_str!("../web/style.css");
const SCRIPTS: [&str; 7] =
    [CHECK, ORBIT, MOTION, SHARPNESS, VIEW, include_str!("../web/figures.js"), include_str!("../web/viewer.js")];

/// A bundle and what the page calls it.
#[derive(Clone, Copy, Debug)]
pub struct SceneFile<'a> {
    /// Unlike those of the others.
    pub name: &'a str,
    /// The bytes of the bundle.
    pub bytes: &'a [u8],
    /// How far the cameras of the capture stood to the left of the preview's, to the right of it and ahead of it, normalised units, where it
    /// is known: the page moves within that by itself.
    pub spread: Option<[f64; 3]>,
}

/// A page that draws bundles side by side, with one camera.
///
/// It fetches nothing, and its content security policy forbids it to. Its length is 4/3 of the bundles' and of the module's, and
/// 50 kB more.
pub fn page(title: &str, scenes: &[SceneFile<'_>]) -> String {
    let bundles: Vec<String> = scenes
        .iter()
        .map(|scene| {
            let name = escaped(scene.name);
            let spread = scene
                .spread
                .map_or_else(String::new, |[left, right, ahead]| format!(" data-spread=\"{left} {right} {ahead}\""));
            format!("<script type=\"text/plain\" data-bundle=\"{name}\"{spread}>{}</script>", base64(scene.bytes))
        })
        .collect();
    PAGE.replace("{{STYLE}}", STYLE.trim_end())
        .replace("{{MODULE}}", &base64(MODULE))
        .replace("{{WORKER}}", &joined(&[CHECK, POCKETSPLAT, WORKER]))
        .replace("{{SCRIPT}}", &joined(&SCRIPTS))
        .replace("{{BOARDS}}", &boards())
        .replace("{{TITLE}}", &escaped(title))
        .replace("{{BUNDLES}}", &bundles.join("\n"))
}

/// An option for each board, with what the page takes of it.
fn boards() -> String {
    let options = BOARDS.iter().map(|board| {
        let Board { chip, clock_mhz, ram_bytes, frame_px: [width, height], processor, .. } = board;
        let set = name_of(processor.instruction_set());
        let hertz = u64::from(*clock_mhz) * 1_000_000;
        format!(
            "          <option value=\"{set}\" data-size=\"{width},{height}\" data-ram=\"{ram_bytes}\" data-hertz=\"{hertz}\" data-cycles=\"{}\">{}</option>",
            processor.cycles_per_instruction(),
            escaped(chip)
        )
    });
    options.collect::<Vec<_>>().join("\n")
}

/// Modules as one script: what one exports the next ones see, so nothing is imported.
fn joined(modules: &[&str]) -> String {
    let lines = modules.iter().flat_map(|module| module.lines()).filter(|line| !line.starts_with("import "));
    lines.map(|line| format!("{}\n", line.strip_prefix("export ").unwrap_or(line))).collect()
}

/// Text that is no markup, nor a mark of the page: for the content of elements and for attributes in double quotes.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;").replace('{', "&#123;")
}

/// Bytes as text (RFC 4648, with padding).
pub fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let at = |i: usize| u32::from(group.get(i).copied().unwrap_or(0));
        let bits = at(0) << 16 | at(1) << 8 | at(2);
        for digit in 0..4 {
            let value = bits >> (18 - 6 * digit) & 63;
            text.push(if digit <= group.len() { char::from(DIGITS[value as usize]) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use pocketsplat_instructions::InstructionSet;

    use super::{PAGE, SceneFile, base64, name_of, page};

    #[test]
    fn base64_is_the_standards() {
        for (bytes, text) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }

    #[test]
    fn every_set_of_instructions_can_be_chosen() {
        for set in InstructionSet::ALL {
            assert!(PAGE.contains(&format!("<option value=\"{}\">", name_of(set))), "{set:?}");
        }
    }

    #[test]
    fn a_page_is_whole_and_asks_for_nothing() {
        let scenes = [
            SceneFile { name: "a <b> \"c\"", bytes: b"one", spread: None },
            SceneFile { name: "{{TITLE}}", bytes: b"two", spread: Some([0.25, 1.5, 0.0]) },
        ];
        let text = page("A & B", &scenes);
        assert!(
            text.contains("<title>A &amp; B</title>") && text.contains("data-bundle=\"a &lt;b&gt; &quot;c&quot;\"")
        );
        assert!(text.contains("\">b25l</script>") && text.contains(" data-spread=\"0.25 1.5 0\">dHdv</script>"));
        for absent in ["http:", "https:", "{{S", "{{M", "{{W", "{{B", "import ", "export "] {
            assert!(!text.contains(absent), "{absent}");
        }
        // Two bundles, the module, the worker and the page's script.
        assert_eq!((text.matches("<script").count(), text.matches("</script>").count()), (5, 5));
    }
}
