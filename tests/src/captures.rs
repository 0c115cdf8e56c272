//! Real captures, for the suites that want them.

use std::io::Write as _;
use std::path::{Path, PathBuf};

/// The folder of a real capture, or `None` after saying on stderr what is skipped and how to run it.
///
/// Looked for in `$POCKETSPLAT_DATA`, then in `../shared/data` beside the workspace.
///
/// * `name`: folder of the capture, such as `lego`.
/// * `suite`: what the caller is about to test, for the message.
pub fn find(name: &str, suite: &str) -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let root = std::env::var_os("POCKETSPLAT_DATA").map_or(beside, PathBuf::from);
    let folder = root.join(name);
    if folder.is_dir() {
        return Some(folder);
    }
    // Not `eprintln!`, which a test that passes keeps to itself.
    let _ = writeln!(
        std::io::stderr(),
        "SKIPPED: {suite}: no capture at {}; set POCKETSPLAT_DATA to a folder that has {name}/",
        folder.display()
    );
    None
}
