//! What the ending of a name says, and the command that writes such a file.

use std::path::Path;

use anyhow::{Result, bail};
use pocketsplat_files::{Content, FileKind, shell_word};

/// Endings of names that mean a format, ours or not: a file of another format does not get them.
const KNOWN: &str = "psb ply spz sog splat ksplat html htm png apng jpg jpeg gif webp heic heif avif tif tiff bmp exr \
    dng mp4 mov avi mkv webm svg csv md txt json toml yaml yml xml pdf zip gz tar 7z glb gltf obj las laz npy npz r3d \
    checkpoint";

fn ending(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

/// Refuses a name that means another format than what is about to be written, and names the command that writes that format.
///
/// * `source`: what that command reads, a bundle or a file of Gaussians; where there is none, the bundle that is written itself.
pub(in crate::command) fn check_name(path: &Path, content: Content, source: Option<&Path>) -> Result<()> {
    let own: &[&str] = match content {
        Content::Kind(FileKind::Bundle) => &["psb"],
        Content::Kind(FileKind::WebPage) => &["html", "htm"],
        Content::Text(..) => &["svg"],
        _ => return Ok(()),
    };
    let found = ending(path);
    if own.contains(&found.as_str()) || !KNOWN.split_whitespace().any(|known| known == found) {
        return Ok(());
    }
    let bundle = path.with_extension("psb");
    let source = source.or((content == Content::Kind(FileKind::Bundle)).then_some(bundle.as_path()));
    // What is there already is not to be replaced by that command either.
    let source = source.filter(|_| !path.exists());
    let command = source.and_then(|source| command_that_makes(path, source));
    let command = command.map_or_else(String::new, |command| format!("; `{command}` makes a .{found} of it"));
    let (path, own) = (path.display(), own[0]);
    bail!("{path}: what is written is {content}; end the name in .{own}{command}");
}

/// The command that writes `target`, as its ending says, from a bundle or a file of Gaussians.
pub(in crate::command) fn command_that_makes(target: &Path, source: &Path) -> Option<String> {
    let is_bundle = match ending(source).as_str() {
        "psb" => true,
        "ply" | "spz" | "sog" | "glb" => false,
        _ => return None,
    };
    let (from, to) = (shell_word(source), shell_word(target));
    match (ending(target).as_str(), is_bundle) {
        ("psb", false) => Some(format!("pocketsplat import {from} -o {to}")),
        ("ply" | "spz" | "sog" | "glb", _) => Some(format!("pocketsplat export {from} -o {to}")),
        ("html" | "htm", true) => Some(format!("pocketsplat view {from} -o {to}")),
        ("png" | "jpg" | "jpeg", true) => Some(format!("pocketsplat render {from} --preview -o {to}")),
        ("gif" | "apng", true) => Some(format!("pocketsplat render {from} --orbit 48 -o {to}")),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::{BUNDLE, FIGURE, PAGE};
    use super::*;

    fn said(path: &str, content: Content, source: Option<&str>) -> String {
        check_name(Path::new(path), content, source.map(Path::new))
            .map_or_else(|error| error.to_string(), |()| String::new())
    }

    #[test]
    fn a_name_of_another_format_is_refused_with_the_command_that_writes_it() {
        for (path, command) in [
            ("a b.ply", "`pocketsplat export 'a b.psb' -o 'a b.ply'`"),
            ("x.SPZ", "`pocketsplat export x.psb -o x.SPZ`"),
            ("x.html", "`pocketsplat view x.psb -o x.html`"),
            ("x.jpg", "`pocketsplat render x.psb --preview -o x.jpg`"),
            ("x.gif", "`pocketsplat render x.psb --orbit 48 -o x.gif`"),
            ("images.txt", "end the name in .psb"),
        ] {
            let said = said(path, BUNDLE, None);
            assert!(said.contains("what is written is a bundle (.psb)") && said.contains(command), "{said}");
        }
        for path in ["x.psb", "x", "null", "x.bin", "x.v2", "x.PSB"] {
            assert_eq!(said(path, BUNDLE, None), "");
        }
        let said_of_page = said("x.png", PAGE, Some("s.psb"));
        assert!(said_of_page.contains("`pocketsplat render s.psb --preview -o x.png`"), "{said_of_page}");
        assert!(said("x.psb", FIGURE, None).contains("end the name in .svg"));
        assert_eq!(said("x.htm", PAGE, None), "");
    }

    #[test]
    fn a_command_is_named_only_where_there_is_one() {
        let of = |target: &str, source: &str| command_that_makes(Path::new(target), Path::new(source));
        assert_eq!(of("a.psb", "b.sog").unwrap(), "pocketsplat import b.sog -o a.psb");
        assert_eq!((of("a.psb", "b.psb"), of("a.html", "b.ply"), of("a.ply", "run")), (None, None, None));
    }
}
