//! `pocketsplat completions` and `pocketsplat man`: what shells and manuals want of the command line.

use std::path::PathBuf;

use anyhow::{Context as _, Result};
use clap::CommandFactory as _;
use clap_complete::{Shell, generate};

use super::{Cli, output};

/// The name that is completed.
const NAME: &str = "pocketsplat";

/// Print completions for a shell.
///
/// For bash: pocketsplat completions bash > ~/.local/share/bash-completion/completions/pocketsplat
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Shell to complete in.
    shell: Shell,
}

pub(crate) fn run(args: &Args) -> Result<()> {
    let mut text = Vec::new();
    generate(args.shell, &mut Cli::command(), NAME, &mut text);
    output::print_text(&String::from_utf8(text)?)
}

/// Write the manual pages.
///
/// For instance pocketsplat man ~/.local/share/man/man1
#[derive(clap::Args)]
pub(crate) struct ManArgs {
    /// Folder to write them into.
    folder: PathBuf,
}

pub(crate) fn write_manual(args: &ManArgs) -> Result<()> {
    let written =
        std::fs::create_dir_all(&args.folder).and_then(|()| clap_mangen::generate_to(Cli::command(), &args.folder));
    written.with_context(|| format!("could not write the manual pages into {}", args.folder.display()))
}
