//! The commands, one file each; only these files print.

mod ablate;
mod bundle;
mod capture;
mod compare;
mod cost;
mod demo;
mod doctor;
mod effects;
mod encode;
mod eval;
mod fit;
mod inspect;
mod lpips;
mod named;
mod output;
mod plot;
mod point;
mod progress;
mod render;
mod run_config;
mod settings;
mod stop;
mod sweep;
mod synth;
mod train;
mod train_args;
mod verify;

use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::{Parser, Subcommand};

/// Train a neural Gaussian-splat scene, compress it to a fraction of a megabyte, draw it on a microcontroller.
#[derive(Parser)]
#[command(name = "pocketsplat", version, propagate_version = true)]
struct Cli {
    /// Threads; 0 takes one per core. No result depends on it.
    #[arg(long, global = true, default_value_t = 0)]
    threads: usize,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Train(train_args::Args),
    Eval(eval::Args),
    Render(render::Args),
    Inspect(inspect::Args),
    Fit(fit::Args),
    Cost(cost::Args),
    Verify(verify::Args),
    Plot(plot::Args),
    Sweep(sweep::Args),
    Ablate(ablate::Args),
    Compare(compare::Args),
    Synth(synth::Args),
    Demo(demo::Args),
    Doctor(doctor::Args),
}

/// Parses the command line and runs the command.
pub(crate) fn run() -> Result<ExitCode> {
    let cli = Cli::parse();
    rayon::ThreadPoolBuilder::new()
        .num_threads(cli.threads)
        .build_global()
        .with_context(|| format!("could not start {} threads", cli.threads))?;
    match cli.command {
        Command::Train(args) => return train::run(&args),
        Command::Sweep(args) => return sweep::run(&args),
        Command::Ablate(args) => return ablate::run(&args),
        Command::Verify(args) => return verify::run(&args),
        Command::Eval(args) => eval::run(&args),
        Command::Render(args) => render::run(&args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Fit(args) => fit::run(&args),
        Command::Cost(args) => cost::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Plot(args) => plot::run(&args),
        Command::Synth(args) => synth::run(&args),
        Command::Doctor(args) => doctor::run(&args),
        Command::Demo(args) => demo::run(&args),
    }
    .map(|()| ExitCode::SUCCESS)
}
