//! A file of explicit Gaussians on disk and what it says about the capture it was trained on.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{Background, Capture, Normalisation};
use pocketsplat_gaussians::{Format, Gaussians, Notes};
use pocketsplat_trainer::explicit::frame;
use pocketsplat_trainer::explicit::render::Renderer;
use pocketsplat_trainer::explicit::up::Up;

use super::capture::CaptureArgs;
use crate::config::{CaptureOptions, Protocol};
use crate::say::say;

/// Begins each comment that is a line of the protocol.
const PROTOCOL: &str = "pocketsplat ";
/// Begins the comment that says which axis points up, as other programs write it too.
const VERTICAL_AXIS: &str = "Vertical axis:";

/// A file of Gaussians, read.
pub(crate) struct GaussiansFile {
    pub(crate) n_bytes: usize,
    /// In the frame of the file.
    pub(crate) gaussians: Gaussians,
    pub(crate) notes: Notes,
    /// Seconds that reading took.
    pub(crate) read_s: f64,
}

impl GaussiansFile {
    /// Whether a file is one by its name.
    pub(crate) fn is_one(path: &Path) -> bool {
        Format::of_path(path).is_some()
    }

    pub(crate) fn read(path: &Path) -> Result<Self> {
        let started = Instant::now();
        let (gaussians, notes) = Format::read(path)?;
        let read_s = started.elapsed().as_secs_f64();
        if !notes.ignored.is_empty() {
            say!(
                "warning: {} has more than Gaussians, which is left out: {}",
                path.display(),
                notes.ignored.join(", ")
            );
        }
        let metadata = std::fs::metadata(path).with_context(|| format!("could not read {}", path.display()))?;
        let n_bytes = usize::try_from(metadata.len())?;
        Ok(Self { n_bytes, gaussians, notes, read_s })
    }

    /// What a run writes beside its Gaussians.
    ///
    /// * `cameras`: which photographs were taken with, upright for the most part.
    pub(crate) fn notes_of<'a>(
        protocol: Option<&Protocol>,
        cameras: impl Iterator<Item = &'a Camera>,
    ) -> Result<Notes> {
        let text = protocol.map(Protocol::to_text).transpose()?.unwrap_or_default();
        let up = Up::of_cameras(cameras).map(|up| format!("{VERTICAL_AXIS} {}", up.comment()));
        let comments = up.into_iter().chain(text.lines().map(|line| format!("{PROTOCOL}{line}"))).collect();
        Ok(Notes { comments, ..Notes::default() })
    }

    /// The axis that points up, if the file says so.
    pub(crate) fn up(&self) -> Option<Up> {
        self.notes.comments.iter().find_map(|comment| Up::of_comment(comment.strip_prefix(VERTICAL_AXIS)?))
    }

    /// Loads the capture as that of the file was prepared, but for what the command line says; warns where it is another one.
    pub(crate) fn load(&self, args: &CaptureArgs) -> Result<(CaptureOptions, Capture)> {
        let protocol = self.protocol();
        let black = CaptureOptions { background: Some(Background::Black), ..CaptureOptions::default() };
        let trained_with = protocol.as_ref().map_or(black, |protocol| protocol.options.clone());
        let options = args.options.or(&trained_with);
        if let Some(protocol) = &protocol {
            say!("as the file says: {protocol}");
        }
        let capture = CaptureArgs { dataset: args.dataset.clone(), options: options.clone() }.load(0)?;
        if let Some(why) = protocol.and_then(|protocol| protocol.contradiction(&capture)) {
            say!("warning: {why}");
        }
        Ok((options, capture))
    }

    /// Whether opacities are to be scaled by what the dilation adds to a splat's area.
    pub(crate) fn compensation(&self) -> bool {
        self.notes.compensation
    }

    /// What the file says of its photographs; nothing in files of other writers.
    fn protocol(&self) -> Option<Protocol> {
        let lines: Vec<&str> = self.notes.comments.iter().filter_map(|line| line.strip_prefix(PROTOCOL)).collect();
        if lines.is_empty() { None } else { Protocol::parse(&lines.join("\n")).ok() }
    }

    /// Draws for the cameras of a capture.
    pub(crate) fn renderer(&self, normalisation: &Normalisation) -> Renderer {
        let mut gaussians = self.gaussians.clone();
        frame::to_normalised(&mut gaussians, normalisation);
        Renderer::new(&gaussians).with_compensation(self.notes.compensation)
    }
}
