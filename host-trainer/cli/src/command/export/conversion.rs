//! A file of Gaussians in another format, and what that lost.

use std::process::ExitCode;

use anyhow::{Result, bail};
use pocketsplat_files::Output;
use pocketsplat_gaussians::{Degree, Format, Notes};
use pocketsplat_trainer::explicit::bulk::shows_nothing;
use pocketsplat_trainer::explicit::frame;
use serde::Serialize;

use super::super::gaussians::{GaussiansFile, write_gaussians};
use super::super::loss::loss_at_30_db;
use super::super::output::print;
use super::cameras::{Around, around_gaussians};
use super::rounding::Rounding;
use super::{Args, FrameRecord, LARGE_LOSS_DB, read_again};
use crate::config::CaptureOptions;
use crate::say::say;

/// A file of Gaussians in another format.
#[derive(Debug, Serialize)]
struct Conversion {
    format: &'static str,
    bytes: usize,
    source_bytes: usize,
    n_gaussians: usize,
    /// Gaussians that the file does not hold.
    n_left_out: usize,
    sh_degree: usize,
    /// Of the new file's pictures to the old one's; 100 where they are the same.
    psnr_to_source_db: f64,
    /// What a scene of 30 dB loses by that.
    loss_at_30_db: f64,
    n_views: usize,
    /// Where the file's numbers lie in the scene, where they are not its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    frame: Option<FrameRecord>,
}

/// Background of the pictures: none of it is part of a scene.
const BACKGROUND: [f32; 3] = [0.5; 3];

/// Writes the Gaussians of a file in another format; nothing is fitted.
pub(super) fn run(args: &Args, format: Format, output: &Output) -> Result<ExitCode> {
    if args.dataset.is_some() || args.iterations.is_some() || args.options != CaptureOptions::default() {
        bail!(
            "{} holds Gaussians, which are written as they are; leave CAPTURE, --iterations and options of photographs out",
            args.bundle.display()
        );
    }
    let file = GaussiansFile::read_to_convert(&args.bundle, args.axes.spz_axes)?;
    args.axes.refuse_unless(format == Format::Spz || file.notes.spz_axes.is_some(), &args.output)?;
    if shows_nothing(&file.gaussians) {
        bail!(
            "nothing in {} can be seen, so no picture tells what another format loses: 0 of {} Gaussians are opaque enough to be drawn, \
             needed: 1; check that its opacities are those before the sigmoid, as 3DGS writes them",
            args.bundle.display(),
            file.gaussians.len()
        );
    }
    let gaussians = file.gaussians.reduced_to(Degree::ALL[usize::from(args.sh_degree)]);
    let notes = Notes { spz_axes: args.axes.spz_axes.or(file.notes.spz_axes), ..file.notes.clone() };
    let written = write_gaussians(format, output, &gaussians, &notes)?;
    let (mut there, there_notes) = read_again(format, output, &written, args)?;

    // Both in one frame, near the origin.
    let Around { cameras, normalisation } = around_gaussians(&gaussians, &notes.frame);
    let mut here = gaussians;
    frame::to_normalised(&mut here, &frame::of_file(&notes.frame, &normalisation));
    frame::to_normalised(&mut there, &frame::of_file(&there_notes.frame, &normalisation));
    let rounding = Rounding {
        given: &here,
        written: &there,
        sources: &written.sources,
        cameras: &cameras,
        background: BACKGROUND,
        compensation: notes.compensation,
    };
    let psnr_to_source_db = rounding.psnr_db();
    let loss_db = loss_at_30_db(psnr_to_source_db);
    if loss_db > LARGE_LOSS_DB {
        say!(
            "warning: {}: its pictures are {psnr_to_source_db:.2} dB from those of {}, by which a scene of 30 dB loses {loss_db:.2} dB, \
             {}; a .ply loses none",
            args.output.display(),
            args.bundle.display(),
            rounding.worst()
        );
    }
    let conversion = Conversion {
        format: format.extension(),
        bytes: written.bytes.len(),
        source_bytes: file.n_bytes,
        n_gaussians: there.len(),
        n_left_out: here.len() - there.len(),
        sh_degree: there.degree.number(),
        psnr_to_source_db,
        loss_at_30_db: loss_db,
        n_views: cameras.len(),
        frame: FrameRecord::of(&written.frame),
    };
    print(&conversion, args.json)?;
    Ok(args.loss.hold(&args.output, loss_db, "a .ply loses none"))
}
