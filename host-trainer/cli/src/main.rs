//! The `pocketsplat` command: results to stdout, progress to stderr, exit code 0, 1 (failed), 2 (wrong
//! usage) or 130 (training or a search for poses interrupted by a signal, to go on from there).

mod command;
mod config;
mod plot;
mod program;
mod say;

use std::process::ExitCode;

fn main() -> ExitCode {
    command::run()
}
