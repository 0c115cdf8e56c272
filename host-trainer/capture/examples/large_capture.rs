//! Writes a capture as large as those that do not fit into memory: 1,000 photographs of 1600×1600 pixels, about 2 GB of PNG.
//!
//! `cargo run --release -p pocketsplat-capture --example large_capture -- FOLDER`;
//! `docs/experiments/2026-11-22-large-captures.md` says what is measured with it, at `--resolution 1600x1066`.

use std::path::Path;
use std::process::ExitCode;

use pocketsplat_capture::synth::{SynthOptions, write_capture};

fn main() -> ExitCode {
    let Some(folder) = std::env::args().nth(1) else {
        eprintln!("give the folder to write");
        return ExitCode::FAILURE;
    };
    // One ray a pixel: what is measured are memory and time, and neither depends on smooth edges.
    let options =
        SynthOptions { size_px: 1600, n_train: 992, n_test: 8, samples_per_axis: 1, ..SynthOptions::default() };
    match write_capture(Path::new(&folder), &options) {
        Ok(_) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
