//! Options by which every command names a capture, and the views it chooses.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use pocketsplat::dataset::{self, Background, Capture, LoadOptions, View};
use serde::{Deserialize, Serialize};

/// Where photographs come from and how they are prepared.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct CaptureArgs {
    /// Folder of the capture: transforms_train.json (Blender, Synthetic-NeRF).
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
    /// What transparent images are composited on. [default: black for train, the bundle's elsewhere]
    #[arg(long)]
    #[serde(default, with = "background_name", skip_serializing_if = "Option::is_none")]
    pub(crate) background: Option<Background>,
}

impl CaptureOptions {
    /// What is chosen here, and what `other` chooses where nothing is.
    pub(crate) fn or(&self, other: &Self) -> Self {
        Self {
            max_resolution: self.max_resolution.or(other.max_resolution),
            background: self.background.or(other.background),
        }
    }
}

/// Backgrounds by name.
mod background_name {
    use pocketsplat::dataset::Background;
    use serde::{Deserialize, Deserializer, Serializer, de};

    pub(super) fn serialize<S: Serializer>(background: &Option<Background>, to: S) -> Result<S::Ok, S::Error> {
        to.collect_str(&background.unwrap_or_default())
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Background>, D::Error> {
        String::deserialize(from)?.parse().map(Some).map_err(de::Error::custom)
    }
}

impl CaptureArgs {
    /// Loads the capture and says on stderr what was found.
    pub(crate) fn load(&self, seed: u64) -> Result<Capture> {
        let options = LoadOptions {
            max_resolution: self.options.max_resolution,
            background: self.options.background.unwrap_or(Background::Black),
            seed,
            ..LoadOptions::default()
        };
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
