//! Pictures of explicit Gaussians.

use anyhow::{Result, bail};
use pocketsplat_capture::dataset::{Image, View};
use rayon::prelude::*;

use super::super::capture::{CaptureArgs, views_of};
use super::super::eval::Renderer;
use super::super::gaussians::GaussiansFile;
use super::{Args, Shot};

/// What to draw, in its order, and the pictures.
pub(super) fn draw(args: &Args) -> Result<(Vec<Shot>, Vec<Image>)> {
    if args.renderer == Renderer::Reference {
        bail!("{} holds Gaussians and no bundle; leave out --renderer", args.bundle.display());
    }
    let Some(dataset) = &args.dataset else {
        bail!(
            "{} holds Gaussians and no camera; give the capture and --view or --all, or make a bundle of it with \
             `pocketsplat import`",
            args.bundle.display()
        );
    };
    let file = GaussiansFile::read(&args.bundle)?;
    let (_, capture) = file.load(&CaptureArgs { dataset: dataset.clone(), options: args.options.clone() })?;
    let views = views_of(&capture, args.split)?;
    let shot = |view: &View| Shot { name: format!("view {}", view.name), camera: view.camera.clone() };
    let shots = match args.view {
        None => views.iter().map(shot).collect(),
        Some(index) => match views.get(index) {
            Some(view) => vec![shot(view)],
            None => bail!("--view {index} of {} views; choose 0 to {}", views.len(), views.len() - 1),
        },
    };
    let renderer = file.renderer(&capture.normalisation);
    let pictures = shots.par_iter().map(|shot| renderer.image(&shot.camera, capture.background)).collect();
    Ok((shots, pictures))
}
