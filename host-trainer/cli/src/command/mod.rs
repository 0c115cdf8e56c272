//! The commands, one file each; only these files print.

mod bench;
mod bundle;
mod capture;
mod compare;
mod completions;
mod cost;
mod demo;
mod device_args;
mod devices;
mod doctor;
mod effects;
mod estimate;
mod eval;
mod export;
mod fit;
mod foreign;
mod gaussians;
mod help;
mod import;
mod inspect;
mod loaded;
mod loss;
mod lpips;
mod output;
mod outputs;
mod plan_runs;
mod plot;
mod point;
mod poses;
mod process;
mod progress;
mod render;
mod report;
mod settings;
mod stand;
mod stop;
mod survey;
mod synth;
mod tables;
mod train;
mod train_args;
mod verify;
mod view;
mod watch;
mod workflow;

use std::ffi::OsString;
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};

use crate::say::say;

/// Train a neural Gaussian-splat scene, compress it to a fraction of a megabyte, draw it on a microcontroller.
#[derive(Parser)]
#[command(name = "pocketsplat", version = crate::program::this(), propagate_version = true)]
struct Cli {
    /// Worker threads, 0 for one per core; results do not depend on it.
    #[arg(long, value_name = "N", global = true, default_value_t = 0, help_heading = crate::config::heading::RUN)]
    threads: usize,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Train(train_args::Args),
    Import(import::Args),
    Eval(eval::Args),
    Render(render::Args),
    View(view::Args),
    Export(export::Args),
    Report(report::Args),
    Inspect(inspect::Args),
    Fit(fit::Args),
    Cost(cost::Args),
    Verify(verify::Args),
    Plot(plot::Args),
    PlanRuns(plan_runs::Args),
    Tables(tables::Args),
    Compare(compare::Args),
    Survey(survey::Args),
    Poses(poses::Args),
    Synth(synth::Args),
    Demo(demo::Args),
    Doctor(doctor::Args),
    Devices(devices::Args),
    Bench(bench::Args),
    Completions(completions::Args),
    Man(completions::ManArgs),
}

/// Takes out clap's tip to pass an unknown option as a value: no command takes such values.
fn drop_tip_of_values(error: &mut clap::Error) {
    if let Some(ContextValue::StyledStrs(mut tips)) = error.remove(ContextKind::Suggested) {
        tips.retain(|tip| !tip.to_string().contains(" as a value, use "));
        if !tips.is_empty() {
            error.insert(ContextKind::Suggested, ContextValue::StyledStrs(tips));
        }
    }
}

/// Parses the command line, runs the command, and says what failed: as JSON on stdout where results go there as JSON.
///
/// * `arguments`: without the program's name.
pub(crate) fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let as_json = arguments.iter().any(|arg| arg == "--json");
    let command = help::grouped(help::own_options(Cli::command())).mut_subcommands(accepting_negative_numbers);
    // Usage begins with the name.
    let parsed = command.try_get_matches_from([OsString::from("pocketsplat")].iter().chain(&arguments));
    let cli = match parsed.and_then(|matches| Cli::from_arg_matches(&matches)) {
        Ok(cli) => cli,
        Err(mut error) => {
            drop_tip_of_values(&mut error);
            let hint = foreign::hint(&arguments, &error);
            if as_json && error.use_stderr() {
                let said = error.render().to_string();
                print_failure(said.trim_start_matches("error: "), hint.map(str::to_owned).as_slice());
            }
            // Nobody can be told where this fails.
            let _ = error.print();
            if let Some(hint) = hint {
                say!("hint: {hint}");
            }
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    dispatch(cli).unwrap_or_else(|error| {
        say!("error: {error:#}");
        if as_json {
            let causes: Vec<String> = error.chain().skip(1).map(ToString::to_string).collect();
            print_failure(&error.to_string(), &causes);
        }
        ExitCode::FAILURE
    })
}

/// Lets `--lambda -1` reach the check that says which numbers there may be.
fn accepting_negative_numbers(command: clap::Command) -> clap::Command {
    command.allow_negative_numbers(true)
}

fn print_failure(error: &str, causes: &[String]) {
    let schema_version = output::SCHEMA_VERSION;
    let failure = serde_json::json!({ "schema_version": schema_version, "error": error.trim_end(), "causes": causes });
    // It stands on stderr as well; if stdout is gone there is nobody to tell.
    let _ = output::print_text(&format!("{failure:#}\n"));
}

/// As many threads as were asked for, but no more than there are cores: more only take turns.
fn n_threads(asked: usize) -> usize {
    let n_cores = std::thread::available_parallelism().map_or(usize::MAX, usize::from);
    if asked > n_cores {
        say!("using {n_cores} threads, one for each core, instead of {asked}");
    }
    asked.min(n_cores)
}

fn dispatch(cli: Cli) -> Result<ExitCode> {
    let n_threads = n_threads(cli.threads);
    rayon::ThreadPoolBuilder::new()
        .num_threads(n_threads)
        .build_global()
        .with_context(|| format!("could not start {n_threads} threads"))?;
    match cli.command {
        Command::Train(args) => return train::run(args),
        Command::PlanRuns(args) => return plan_runs::run(&args),
        Command::Survey(args) => return survey::run(&args),
        Command::Import(args) => return import::run(&args),
        Command::Demo(args) => return demo::run(&args),
        Command::Verify(args) => return verify::run(&args),
        Command::Doctor(args) => return doctor::run(&args),
        Command::Poses(args) => return poses::run(&args),
        Command::Export(args) => return export::run(&args),
        Command::Eval(args) => eval::run(&args),
        Command::Render(args) => render::run(&args),
        Command::View(args) => view::run(&args),
        Command::Report(args) => report::run(&args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Fit(args) => fit::run(&args),
        Command::Cost(args) => cost::run(&args),
        Command::Tables(args) => tables::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Plot(args) => plot::run(&args),
        Command::Synth(args) => synth::run(&args),
        Command::Devices(args) => devices::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Completions(args) => completions::run(&args),
        Command::Man(args) => completions::write_manual(&args),
    }
    .map(|()| ExitCode::SUCCESS)
}

#[cfg(test)]
mod tests {
    use std::ffi::OsString;

    use clap::{Arg, CommandFactory as _};

    use super::Cli;
    use crate::config::heading::DEVICE;

    fn commands() -> Vec<clap::Command> {
        let mut cli = Cli::command();
        cli.build();
        cli.get_subcommands().filter(|command| command.get_name() != "help").cloned().collect()
    }

    #[test]
    fn short_help_of_train_has_at_most_20_options() {
        let mut train = commands().into_iter().find(|command| command.get_name() == "train").expect("train");
        let help = train.render_help().to_string();
        let options: Vec<&str> = help.lines().filter(|line| line.trim_start().starts_with('-')).collect();
        assert!(options.len() <= 20, "{}: {help}", options.len());
        let headings: Vec<&str> = help.lines().filter(|line| line.ends_with(':') && !line.starts_with(' ')).collect();
        let expected = ["Arguments:", "Options:", "Input:", "Output:", "Quality:", "Device:", "Run:"];
        assert_eq!(headings, expected, "{help}");
    }

    #[test]
    fn options_of_other_trainers_are_told_ours() {
        let train = commands().into_iter().find(|command| command.get_name() == "train").expect("train");
        super::foreign::check(&train);
        let hint_of = |command: &str, given: &str| {
            let arguments = ["--threads", "2", command, "photos", given].map(OsString::from);
            let parsed = Cli::command().no_binary_name(true).try_get_matches_from(&arguments);
            super::foreign::hint(&arguments, &parsed.expect_err(given))
        };
        let hint = |given: &str| hint_of("train", given);
        assert!(hint("--max_steps=7000").is_some_and(|hint| hint.contains("--iterations")));
        assert!(hint("--data").is_some_and(|hint| hint.contains("train PHOTOS")));
        assert_eq!([hint("--nothing-of-ours"), hint("--lambda"), hint_of("render", "--steps=5")], [None; 3]);
    }

    #[test]
    fn only_limits_stand_under_device() {
        for command in commands() {
            let under_device = command.get_arguments().filter(|arg| arg.get_help_heading() == Some(DEVICE));
            let others: Vec<&str> = under_device.map(|arg| arg.get_id().as_str()).collect();
            assert!(others.iter().all(|name| ["level", "ram", "flash", "target"].contains(name)), "{others:?}");
        }
    }

    #[test]
    fn the_help_of_an_option_is_one_sentence() {
        let text = |arg: &Arg| arg.get_long_help().or(arg.get_help()).map(ToString::to_string).unwrap_or_default();
        for command in commands() {
            for arg in command.get_arguments() {
                let help = text(arg);
                let sentence = help.split("[default").next().unwrap_or_default().trim().trim_end_matches('.');
                let at = format!("{} --{}: {help}", command.get_name(), arg.get_id());
                assert!(!sentence.is_empty() && !sentence.contains(". "), "{at}");
            }
        }
    }
}
