//! The command `pocketsplat` as a program.

use std::process::ExitCode;

fn main() -> ExitCode {
    pocketsplat_command::run(std::env::current_exe().ok(), std::env::args_os().skip(1))
}
