//! Options by which every command names a capture, and the views it chooses.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use pocketsplat_capture::dataset::{self, Background, Capture, FrameSize, LoadOptions, Severity, View};
use serde::{Deserialize, Serialize};

/// Where photographs come from and how they are prepared.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct CaptureArgs {
    /// Folder of the capture: transforms_train.json (Blender, Synthetic-NeRF), sparse/0 (COLMAP) or transforms.json
    /// (nerfstudio, instant-ngp).
    pub(crate) dataset: PathBuf,
    #[command(flatten)]
    pub(crate) options: CaptureOptions,
}

/// How photographs are prepared; also a section of a run's configuration.
#[derive(clap::Args, Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct CaptureOptions {
    /// Longest side of the images, pixels; larger ones are reduced with an area filter, intrinsics with them.
    /// [default: as they are for train, the bundle's training resolution elsewhere]
    #[arg(long, value_name = "PX")]
    pub(crate) max_resolution: Option<u32>,
    /// Reduce images until they just cover such a frame and keep their middle: what a display shows. To be repeated for eval
    /// and render where it cuts something off.
    #[arg(long, value_name = "WxH", conflicts_with = "max_resolution")]
    #[serde(default, with = "frame_size", skip_serializing_if = "Option::is_none")]
    pub(crate) resolution: Option<FrameSize>,
    /// What transparent images are composited on: black or white; learned: black, and the colour behind the scene is trained
    /// with it. [default: black for train, the bundle's elsewhere]
    #[arg(long)]
    #[serde(default, with = "background_name", skip_serializing_if = "Option::is_none")]
    pub(crate) background: Option<Background>,
    /// Folder of images to read, for captures that hold several (images, images_2, …). [default: the only one, or images]
    #[arg(long, value_name = "NAME")]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) images: Option<String>,
    /// Hold out every N-th view by name where the capture has no split of its own; 0 holds out none. To be repeated for
    /// eval and render, as is --images. [default: 8]
    #[arg(long, value_name = "N")]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) test_every: Option<u32>,
}

impl CaptureOptions {
    /// What is chosen here, and what `other` chooses where nothing is.
    pub(crate) fn or(&self, other: &Self) -> Self {
        // One way to say the size replaces the other.
        let size_said = self.max_resolution.is_some() || self.resolution.is_some();
        let size = if size_said { self } else { other };
        Self {
            max_resolution: size.max_resolution,
            resolution: size.resolution,
            background: self.background.or(other.background),
            images: self.images.clone().or_else(|| other.images.clone()),
            test_every: self.test_every.or(other.test_every),
        }
    }
}

/// Sizes of frames as text.
mod frame_size {
    use pocketsplat_capture::dataset::FrameSize;
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

    pub(super) fn serialize<S: Serializer>(size: &Option<FrameSize>, to: S) -> Result<S::Ok, S::Error> {
        size.map(|size| size.to_string()).serialize(to)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<FrameSize>, D::Error> {
        String::deserialize(from)?.parse().map(Some).map_err(de::Error::custom)
    }
}

/// Backgrounds by name.
mod background_name {
    use pocketsplat_capture::dataset::Background;
    use serde::{Deserialize, Deserializer, Serializer, de};

    pub(super) fn serialize<S: Serializer>(background: &Option<Background>, to: S) -> Result<S::Ok, S::Error> {
        to.collect_str(&background.unwrap_or_default())
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Background>, D::Error> {
        String::deserialize(from)?.parse().map(Some).map_err(de::Error::custom)
    }
}

impl CaptureArgs {
    fn load_options(&self, seed: u64) -> LoadOptions {
        let default = LoadOptions::default();
        LoadOptions {
            max_resolution: self.options.max_resolution,
            frame: self.options.resolution,
            background: self.options.background.unwrap_or(Background::Black),
            seed,
            images: self.options.images.clone(),
            test_every: self.options.test_every.unwrap_or(default.test_every),
            ..default
        }
    }

    /// Loads the capture and says on stderr what was found.
    pub(crate) fn load(&self, seed: u64) -> Result<Capture> {
        let options = self.load_options(seed);
        let findings = dataset::diagnose_cheaply(&self.dataset, &options);
        if findings.count(Severity::Warning) > 0 {
            eprintln!("`pocketsplat doctor {}` has something to say", self.dataset.display());
        }
        let (capture, report) = dataset::load(&self.dataset, &options)
            .with_context(|| format!("could not load the capture {}", self.dataset.display()))?;
        eprintln!("{report}");
        Ok(capture)
    }
}

/// Which views of a capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Split {
    /// Held out of training.
    Test,
    /// Trained on.
    Train,
}

impl Split {
    /// The views of this split, at least one.
    pub(crate) fn views(self, capture: &Capture) -> Result<&[View]> {
        let views = match self {
            Self::Test => &capture.test,
            Self::Train => &capture.train,
        };
        if views.is_empty() {
            bail!("the capture has no {self:?} view; choose the other --split");
        }
        Ok(views)
    }
}
