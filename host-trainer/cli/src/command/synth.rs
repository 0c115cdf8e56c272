//! `pocketsplat synth`: the procedural capture.

use std::path::PathBuf;

use crate::config::named::{SURFACES, one_of};
use anyhow::Result;
use pocketsplat_capture::synth::{SurfaceFinish, SynthOptions, write_capture};
use pocketsplat_files::Outputs;

use super::output;

/// Write a procedural capture.
///
/// An analytic scene, ray-traced from known cameras, in Blender's format.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Folder to write; must be new or empty.
    folder: PathBuf,
    /// Width and height of the images, pixels.
    #[arg(long, default_value_t = SynthOptions::default().size_px)]
    size: u32,
    /// Views to train on.
    #[arg(long, default_value_t = SynthOptions::default().n_train)]
    train_views: u32,
    /// Views to hold out.
    #[arg(long, default_value_t = SynthOptions::default().n_test)]
    test_views: u32,
    /// Decides the textures and the cameras.
    #[arg(long, default_value_t = SynthOptions::default().seed)]
    seed: u64,
    /// How surfaces reflect light.
    #[arg(long, value_parser = one_of::<SurfaceFinish>(SURFACES), default_value = "mixed")]
    surface: SurfaceFinish,
}

pub(crate) fn run(args: &Args) -> Result<()> {
    let options = SynthOptions {
        size_px: args.size,
        n_train: args.train_views,
        n_test: args.test_views,
        seed: args.seed,
        finish: args.surface,
        ..SynthOptions::default()
    };
    Outputs::folder(&args.folder)?;
    let report = write_capture(&args.folder, &options)?;
    output::print_text(&format!(
        "{}: {} views to train, {} held out, {} px, {:.0} % of the pixels show something\n",
        args.folder.display(),
        report.n_train,
        report.n_test,
        report.size_px,
        100.0 * report.mean_alpha
    ))
}
