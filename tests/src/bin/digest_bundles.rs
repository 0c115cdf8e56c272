//! Writes the bundles that `tests/digest` decodes and draws on every target: `static.psb`, `context.psb` and `hard.psb`.

use std::path::PathBuf;

use conformance::bundles::{CODERS, tiered};
use conformance::hard_cases;
use conformance::scenes::CASES;

fn main() -> std::io::Result<()> {
    let folder = PathBuf::from(std::env::args_os().nth(1).expect("usage: digest_bundles FOLDER"));
    std::fs::create_dir_all(&folder)?;
    for (coder, name) in CODERS.into_iter().zip(["static.psb", "context.psb"]) {
        std::fs::write(folder.join(name), tiered(&CASES[0], coder, 64))?;
    }
    std::fs::write(folder.join("hard.psb"), hard_cases::gathered())
}
