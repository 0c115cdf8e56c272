//! The `pocketsplat` command: results to stdout, progress to stderr, exit code 0, 1 (failed), 2 (wrong
//! usage) or 130 (training or a search for poses interrupted by a signal, to go on from there).
//!
//! A library, so that the Python package brings the same command.

mod command;
mod config;
mod plot;
mod program;
mod say;

use std::ffi::OsString;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Runs the command line, as the process that it is alone in: it takes the signals and the threads.
///
/// * `program`: the file that starts this command again, where there is one; workflows name it.
/// * `arguments`: without the program's name.
pub fn run(program: Option<PathBuf>, arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    program::set_path(program);
    let code = command::run(arguments);
    // A program in Rust does so when it ends; one in another language does not. A reader that is gone was told of before.
    let _ = std::io::stdout().flush();
    code
}
