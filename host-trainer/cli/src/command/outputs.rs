//! Where commands write: what an output is called, and what it may replace.

mod mark;
mod name;

use std::path::Path;

use anyhow::{Context as _, Result};
use pocketsplat_files::{Content, FileKind, Outputs, write_whole};
use pocketsplat_gaussians::Format;

use super::capture::CaptureArgs;
pub(super) use mark::{marked_jpeg, marked_png};
pub(super) use name::{check_name, command_that_makes};

pub(super) const BUNDLE: Content = Content::Kind(FileKind::Bundle);
pub(super) const PAGE: Content = Content::Kind(FileKind::WebPage);
pub(super) const PNG: Content = Content::Picture(FileKind::Png);
pub(super) const JPEG: Content = Content::Picture(FileKind::Jpeg);
pub(super) const GIF: Content = Content::Kind(FileKind::Gif);
/// As plotters begins them.
pub(super) const FIGURE: Content = Content::Text(&["<svg width="], "a figure (.svg)");

/// Of a folder that is ours: whatever lies there under the name.
pub(super) const ANYTHING: Content = Content::Text(&[""], "a file of the folder");

/// A table whose first column has this name.
pub(super) const fn table(beginning: &'static [&'static str]) -> Content {
    Content::Text(beginning, "a table (.csv)")
}

/// A file of Gaussians.
pub(super) const fn gaussians(format: Format) -> Content {
    Content::Kind(match format {
        Format::Ply => FileKind::Ply,
        Format::Spz => FileKind::Gzip,
        Format::Sog => FileKind::Zip,
        Format::Glb => FileKind::Glb,
    })
}

/// What a command may replace.
#[derive(clap::Args, Clone, Copy, Debug, Default)]
pub(crate) struct OverwriteArgs {
    /// Replace a file of another kind where the output goes, or a run that is not finished, but nothing that the command reads
    /// [default: refuse]
    #[arg(short = 'w', long)]
    overwrite: bool,
}

impl OverwriteArgs {
    /// Whether it was asked for.
    pub(crate) fn is_given(self) -> bool {
        self.overwrite
    }

    /// None yet.
    pub(crate) fn outputs(self) -> Outputs {
        Outputs::new(self.overwrite)
    }
}

/// The outputs of a command that reads a capture as well.
///
/// * `path`: where one of them goes. Only where it is there already may it be a photograph that lies outside of the capture's folder.
pub(super) fn reading_capture(outputs: Outputs, capture: &CaptureArgs, path: &Path) -> Outputs {
    let outputs = outputs.reading_folder(&capture.dataset);
    let elsewhere = if path.is_file() { capture.files() } else { Vec::new() };
    elsewhere.iter().fold(outputs, |outputs, file| outputs.reading(file))
}

/// Writes a file into a folder that is ours.
pub(super) fn keep(path: &Path, bytes: &[u8]) -> Result<()> {
    write_whole(path, |out| out.write_all(bytes)).with_context(|| format!("could not write {}", path.display()))
}
