//! `pocketsplat doctor`: what is wrong with a capture, and what to do about it.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Result, bail};
use pocketsplat_capture::dataset::{LoadOptions, Severity, diagnose};

use super::capture::refuse_gaussians;
use super::output;

/// Check a capture; every finding comes with a remedy.
///
/// Checks images, poses, lenses, scale and splits.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder of the capture.
    dataset: PathBuf,
    /// Folder of images to read, for captures that hold several sizes [default: the only one, or images]
    #[arg(long, value_name = "NAME")]
    images: Option<String>,
    /// Number of the sparse model to read, for COLMAP captures that hold several [default: the one with the most images]
    #[arg(long, value_name = "N")]
    model: Option<u32>,
    /// Hold out every N-th view; 0 holds out none.
    #[arg(long, value_name = "N", default_value_t = LoadOptions::default().test_every)]
    test_every: u32,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<ExitCode> {
    refuse_gaussians(&args.dataset)?;
    let options = LoadOptions {
        images: args.images.clone(),
        model: args.model,
        test_every: args.test_every,
        ..LoadOptions::default()
    };
    let diagnosis = diagnose(&args.dataset, &options);
    output::print_or(&diagnosis, args.json, format_args!("{diagnosis}\n"))?;
    if !diagnosis.has_errors() {
        return Ok(ExitCode::SUCCESS);
    }
    if !args.json {
        bail!("{} cannot be trained on: {} errors", args.dataset.display(), diagnosis.count(Severity::Error));
    }
    // The diagnosis has said it.
    Ok(ExitCode::FAILURE)
}
