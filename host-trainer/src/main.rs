//! The `pocketsplat` command: results to stdout, progress to stderr, exit code 0, 1 (failed) or 2 (wrong usage).

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    match cli::run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
