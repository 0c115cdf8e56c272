//! Puts the bundle into flash, and tells the linker the memory of the chip.
//!
//! `PSB_BUNDLE` is the absolute path of the bundle.

use std::path::PathBuf;
use std::{env, fs};

fn main() {
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    println!("cargo::rerun-if-env-changed=PSB_BUNDLE");
    let Some(bundle) = env::var_os("PSB_BUNDLE") else {
        println!(
            "cargo::error=PSB_BUNDLE is not set: set it to the absolute path of a bundle, as boards/README.md shows"
        );
        return;
    };
    println!("cargo::rerun-if-changed={}", bundle.display());
    if let Err(error) = fs::copy(&bundle, out.join("bundle.psb")) {
        println!("cargo::error=bundle {}: {error}", bundle.display());
    }
    fs::copy("memory.x", out.join("memory.x")).expect("OUT_DIR takes a file");
    println!("cargo::rerun-if-changed=memory.x");
    println!("cargo::rustc-link-search={}", out.display());
    // Here and not in .cargo/config.toml, where a RUSTFLAGS of the environment would replace them.
    for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo::rustc-link-arg-bins={argument}");
    }
}
