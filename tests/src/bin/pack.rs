//! Writes the conformance pack: `cargo run --release -p conformance --bin pack -- FOLDER`, by default into `tests/pack`.
//!
//! Files of an earlier pack that it no longer has are removed.

use std::path::{Path, PathBuf};

use conformance::pack;

fn main() -> std::io::Result<()> {
    let default = Path::new(env!("CARGO_MANIFEST_DIR")).join("pack");
    let folder = std::env::args_os().nth(1).map_or(default, PathBuf::from);
    for part in pack::FOLDERS {
        let part = folder.join(part);
        if part.is_dir() {
            std::fs::remove_dir_all(&part)?;
        }
        std::fs::create_dir_all(&part)?;
    }
    let files = pack::files(&pack::bundles::samples());
    for (path, bytes) in &files {
        std::fs::write(folder.join(path), bytes)?;
    }
    println!("{}: {} files, {} bytes", folder.display(), files.len(), files.values().map(Vec::len).sum::<usize>());
    Ok(())
}
