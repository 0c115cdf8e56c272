//! A file of explicit Gaussians on disk and what it says about the capture it was trained on.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{Background, Capture, Normalisation};
use pocketsplat_files::Output;
use pocketsplat_gaussians::{Format, Gaussians, Notes, SpzAxes, Written};
use pocketsplat_trainer::explicit::frame;
use pocketsplat_trainer::explicit::render::Renderer;
use pocketsplat_trainer::explicit::up::Up;

use super::capture::CaptureArgs;
use crate::config::{CaptureOptions, Protocol, RunConfig};
use crate::say::say;

/// Begins each comment that is a line of the protocol.
const PROTOCOL: &str = "pocketsplat ";
/// Begins the comment that says which axis points up, as other programs write it too.
pub(crate) const VERTICAL_AXIS: &str = "Vertical axis:";

/// What a .spz does not say, or says wrongly.
#[derive(clap::Args, Clone, Copy, Debug)]
pub(crate) struct AxesArgs {
    /// Axes of a .spz, read or written: as-described (y up, z back) or as-in-ply, as splat-transform 3 and others write them
    /// [default: as the file says, else as-described]
    #[arg(long, value_name = "AXES")]
    pub(crate) spz_axes: Option<SpzAxes>,
}

impl AxesArgs {
    /// Fails where they are given for another file.
    pub(crate) fn refuse_unless(self, is_spz: bool, path: &Path) -> Result<()> {
        if self.spz_axes.is_some() && !is_spz {
            bail!("{} is no .spz; leave --spz-axes out", path.display());
        }
        Ok(())
    }
}

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
    /// Whether a file is one by its bytes, or where they say nothing by its name.
    pub(crate) fn is_one(path: &Path) -> bool {
        pocketsplat_gaussians::is_one(path)
    }

    /// Whether a run is one of `import`: of splats, and of no capture.
    pub(crate) fn is_trained_on(config: &RunConfig) -> bool {
        config.dataset.is_file() || Self::is_one(&config.dataset)
    }

    /// Reads a file, and says on stderr what was not read as it stands.
    pub(crate) fn read(path: &Path, axes: AxesArgs) -> Result<Self> {
        let file = Self::read_to_convert(path, axes.spz_axes)?;
        axes.refuse_unless(file.notes.spz_axes.is_some(), path)?;
        Ok(file)
    }

    /// The same for a file that may become a .spz.
    ///
    /// * `spz_axes`: of a .spz, whatever its record says.
    pub(crate) fn read_to_convert(path: &Path, spz_axes: Option<SpzAxes>) -> Result<Self> {
        let started = Instant::now();
        let (gaussians, notes) = pocketsplat_gaussians::read(path, spz_axes)?;
        let read_s = started.elapsed().as_secs_f64();
        let name = path.display();
        for remark in &notes.remarks {
            say!("{name}: {remark}");
        }
        for warning in &notes.warnings {
            say!("warning: {name}: {warning}");
        }
        if !notes.ignored.is_empty() {
            say!("warning: {name} has more than Gaussians, which is left out: {}", notes.ignored.join(", "));
        }
        let n_bytes = n_bytes(path).with_context(|| format!("could not read {name}"))?;
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
    pub(super) fn protocol(&self) -> Option<Protocol> {
        let lines: Vec<&str> = self.notes.comments.iter().filter_map(|line| line.strip_prefix(PROTOCOL)).collect();
        if lines.is_empty() { None } else { Protocol::parse(&lines.join("\n")).ok() }
    }

    /// Draws for the cameras of a capture.
    pub(crate) fn renderer(&self, normalisation: &Normalisation) -> Renderer {
        self.renderer_of_numbers(&frame::of_file(&self.notes.frame, normalisation))
    }

    /// Draws for cameras that stand among the numbers of the file, wherever these lie in the scene.
    ///
    /// * `normalisation`: of these numbers.
    pub(crate) fn renderer_of_numbers(&self, normalisation: &Normalisation) -> Renderer {
        let mut gaussians = self.gaussians.clone();
        frame::to_normalised(&mut gaussians, normalisation);
        Renderer::new(&gaussians).with_compensation(self.notes.compensation)
    }

    /// A camera of the scene, among the numbers of the file.
    pub(crate) fn camera(&self, camera: &Camera) -> Camera {
        frame::of_scene(&self.notes.frame).camera(camera)
    }
}

/// Bytes of a file, or of the files of a folder.
fn n_bytes(path: &Path) -> std::io::Result<usize> {
    let is_manifest = path.file_name().is_some_and(|name| name == "meta.json");
    let folder = if path.is_dir() { Some(path) } else { path.parent().filter(|_| is_manifest) };
    let Some(folder) = folder else { return Ok(std::fs::metadata(path)?.len() as usize) };
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    std::fs::read_dir(folder)?.map(|entry| Ok(entry?.metadata()?.len() as usize)).sum()
}

/// Writes Gaussians, and says on stderr what the format does not hold of them.
///
/// * `notes`: with the frame of `gaussians`.
pub(crate) fn write_gaussians(
    format: Format,
    output: &Output,
    gaussians: &Gaussians,
    notes: &Notes,
) -> Result<Written> {
    let path = output.path();
    let written = format.write(gaussians, notes).map_err(|fault| anyhow!("{} {fault}", path.display()))?;
    output.write(&written.bytes)?;
    for warning in &written.warnings {
        say!("warning: {}: {warning}", path.display());
    }
    if format == Format::Spz {
        let axes = notes.spz_axes.unwrap_or(SpzAxes::AsDescribed);
        say!("{}: its axes are written {}, and its record says so", path.display(), axes.name());
    }
    Ok(written)
}
