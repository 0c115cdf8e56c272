//! Gives the program the commit that it is built from, where it is built from the repository.

#![expect(clippy::disallowed_macros, reason = "cargo reads what a build script prints")]

use std::path::PathBuf;
use std::process::Command;

fn main() {
    // Asked while it runs: working trees that share a target folder share this program.
    let root = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default()).join("../..");
    // A package lies in nobody's repository, or in another's.
    if !root.join(".git").exists() {
        println!("cargo:rerun-if-changed=build.rs");
        return;
    }
    // What decides a figure: a change of any of them makes the commit `-dirty`.
    for part in ["decoder-core/src", "decoder-format/src", "decoder-half/src", "host-trainer"] {
        println!("cargo:rerun-if-changed={}", root.join(part).display());
    }
    println!("cargo:rerun-if-changed={}", root.join(".git/logs/HEAD").display());
    let said = Command::new("git").args(["describe", "--always", "--dirty", "--abbrev=7"]).current_dir(&root).output();
    if let Ok(said) = said
        && said.status.success()
        && let Ok(commit) = String::from_utf8(said.stdout)
    {
        println!("cargo:rustc-env=POCKETSPLAT_COMMIT={}", commit.trim());
    }
}
