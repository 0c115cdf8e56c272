//! A bundle on disk and what it says about the capture it was trained on.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::{Background, Capture, View};
use pocketsplat_codec::bundle::{normalisation_of, protocol_of};
use pocketsplat_files::FileKind;
use pocketsplat_format::Bundle;
use pocketsplat_format::bundle::crc32;
use pocketsplat_viewer::SceneFile;
use serde::Deserialize;

use super::capture::{CaptureArgs, refuse_gaussians};
use crate::config::{CaptureOptions, Protocol, RunConfig};
use crate::say::say;

/// What a run's result.json says of its bundle.
#[derive(Deserialize)]
struct Written {
    bundle_crc: u32,
}

/// The bytes of a bundle and where they came from.
pub(crate) struct BundleFile {
    pub(crate) path: PathBuf,
    pub(crate) bytes: Vec<u8>,
}

impl BundleFile {
    pub(crate) fn read(path: &Path) -> Result<Self> {
        refuse_gaussians(path)?;
        if path.is_dir() {
            let Ok(run) = RunConfig::of_run(path) else {
                bail!("{} is a folder; give a bundle (.psb)", path.display())
            };
            bail!("{} is the folder of a run; give its bundle, {}", path.display(), run.output.display());
        }
        let bytes = FileKind::read(path, |kind| kind == Some(FileKind::Bundle));
        let bytes = bytes.with_context(|| format!("could not read the bundle {}", path.display()))?;
        if let Some(kind) = FileKind::of(&bytes).filter(|kind| *kind != FileKind::Bundle) {
            let remedy = kind.remedy().unwrap_or("give a .psb file");
            bail!("{} is {kind}, needed: a bundle (.psb); {remedy}", path.display());
        }
        Ok(Self { path: path.to_owned(), bytes })
    }

    /// The bundle of a finished run: where it was written, or beside the run's folder where both have moved.
    ///
    /// # Errors
    /// There is none, or it is not what the run wrote.
    pub(crate) fn of_run(folder: &Path, config: &RunConfig) -> Result<Self> {
        let result = folder.join("result.json");
        let text = std::fs::read_to_string(&result)
            .with_context(|| format!("could not read {}: is the run finished?", result.display()))?;
        let written: Written =
            serde_json::from_str(&text).with_context(|| format!("{} is no result of a run", result.display()))?;
        let name = config.output.file_name().unwrap_or_default();
        let beside = folder.parent().unwrap_or(folder).join(name);
        let path = if config.output.is_file() { &config.output } else { &beside };
        if !path.is_file() {
            bail!("there is no bundle {}, nor {}; put it back there", config.output.display(), beside.display());
        }
        let file = Self::read(path)?;
        let found = crc32(&file.bytes);
        let needed = written.bundle_crc;
        if found != needed {
            bail!(
                "{} has the checksum {found:08x}, and the run in {} wrote {needed:08x}: another run has replaced it; train that one \
                 anew, with another --output",
                path.display(),
                folder.display()
            );
        }
        Ok(file)
    }

    /// Checks the file, each of its chunks too; says so when it is cut at the end of a tier.
    pub(crate) fn parse(&self) -> Result<Bundle<'_>> {
        let bundle = Bundle::parse(&self.bytes);
        let sound = bundle.and_then(|bundle| bundle.chunks().try_for_each(|chunk| chunk.check()).map(|()| bundle));
        let bundle = sound.with_context(|| format!("{} cannot be used", self.path.display()))?;
        let (n_tiers, n_written) = (bundle.n_tiers(), bundle.header().n_tiers);
        if n_tiers < n_written {
            say!(
                "{} is cut after tier {n_tiers} of {n_written}: a smaller scene of {} of {} anchors",
                self.path.display(),
                bundle.n_anchors(),
                bundle.header().n_anchors
            );
        }
        Ok(bundle)
    }

    /// Loads the capture as the bundle's was prepared, but for what the command line says; warns where it is another one.
    pub(crate) fn load(&self, bundle: &Bundle<'_>, args: &CaptureArgs) -> Result<(CaptureOptions, Capture)> {
        let protocol = self.protocol(bundle);
        let source = self.capture_options(bundle, protocol.as_ref(), args)?;
        if let Some(protocol) = &protocol {
            say!("as the bundle says: {protocol}");
        }
        let capture = source.load(0)?;
        if let Some(why) = protocol.and_then(|protocol| protocol.contradiction(&capture)) {
            say!("warning: {why}");
        }
        Ok((source.options, capture))
    }

    /// What the bundle says of its photographs; nothing in bundles of other writers.
    pub(crate) fn protocol(&self, bundle: &Bundle<'_>) -> Option<Protocol> {
        let parsed = Protocol::parse(protocol_of(bundle, &self.bytes)?);
        parsed.inspect_err(|error| say!("warning: could not read the section protocol: {error}")).ok()
    }

    /// The bundle as a page shows it.
    pub(crate) fn scene<'a>(&'a self, name: &'a str, bundle: &Bundle<'_>) -> SceneFile<'a> {
        let spread = self.protocol(bundle).and_then(|protocol| protocol.spread);
        SceneFile { name, bytes: &self.bytes, spread }
    }

    /// Fills what the command line left open with what the bundle was trained with, and refuses what contradicts it.
    fn capture_options(
        &self,
        bundle: &Bundle<'_>,
        protocol: Option<&Protocol>,
        args: &CaptureArgs,
    ) -> Result<CaptureArgs> {
        let header = bundle.header();
        let [width, height] = header.training_px;
        let header_says = CaptureOptions {
            max_resolution: Some(u32::from(width.max(height))),
            background: Background::of_rgb8(header.background),
            ..CaptureOptions::default()
        };
        // What is composited on a background says nothing of what lies behind a scene: a backdrop of the photographs, or a colour that was learned.
        let trained_with = protocol.map_or(header_says, |protocol| protocol.options.clone());
        if let (Some(asked), Some(trained)) = (args.options.background, trained_with.background)
            && asked != trained
        {
            bail!("{} was trained on {trained}, not on {asked}; leave --background out", self.path.display());
        }
        Ok(CaptureArgs { dataset: args.dataset.clone(), options: args.options.or(&trained_with) })
    }

    /// The camera of a view in the frame of this bundle, which need not be the frame of the capture as loaded now.
    pub(crate) fn camera(&self, bundle: &Bundle<'_>, capture: &Capture, view: &View) -> Camera {
        let own = normalisation_of(bundle);
        if own == capture.normalisation {
            return view.camera.clone();
        }
        let centre_world = view.camera.centre_world() / capture.normalisation.scale + capture.normalisation.centre;
        let translation = -(view.camera.rotation * own.point(centre_world));
        Camera { translation, ..view.camera.clone() }
    }
}
