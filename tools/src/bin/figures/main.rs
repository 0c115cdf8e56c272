//! The figures of README and pages: runs what docs/results/plan.toml lists, and fills the blocks of the pages.
//!
//! ```sh
//! cargo run --release -p tools --bin figures -- run CAPTURES --out RUNS   # trains what is not trained yet; the same command goes on
//! cargo run -p tools --bin figures -- write                               # fills the blocks from docs/results/figures/*.csv
//! cargo run -p tools --bin figures -- check                               # fails where a page says something else
//! ```
//!
//! A block begins with `<!-- table NAME -->` and ends with `<!-- end of table -->`.

mod blocks;
mod board;
mod decoder;
mod guides;
mod links;
mod picture;
mod plan;
mod rows;
mod run;

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use anyhow::{Result, ensure};
use clap::{Parser, Subcommand};

/// Runs, writes and checks the figures of the pages.
#[derive(Parser)]
struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// Train and measure the runs of the plan that are not measured yet, and write their CSVs.
    Run(run::Args),
    /// Fill the blocks of all pages from the CSVs.
    Write,
    /// Fail where a block is not what its CSV says, a guide holds a figure outside of blocks, or a link leads nowhere.
    Check,
}

fn main() -> Result<ExitCode> {
    match Args::parse().what {
        What::Run(args) => run::run(&args)?,
        What::Write => blocks::write(&plan::Plan::read()?)?,
        What::Check => {
            let plan = plan::Plan::read()?;
            let faults = [blocks::faults(&plan)?, guides::faults()?, links::faults()?].concat();
            if !faults.is_empty() {
                eprintln!("{} faults of pages:\n{}", faults.len(), faults.join("\n"));
                return Ok(ExitCode::FAILURE);
            }
            println!("pages: blocks as their CSVs, no figure outside of them, every link leads somewhere");
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// A path within the repository.
fn in_repository(path: impl AsRef<Path>) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

/// What a command prints; it says what it does on the terminal.
fn said_by(command: &mut Command) -> Result<Vec<u8>> {
    let done = command.stderr(std::process::Stdio::piped()).output()?;
    ensure!(done.status.success(), "{command:?} failed:\n{}", String::from_utf8_lossy(&done.stderr));
    Ok(done.stdout)
}
