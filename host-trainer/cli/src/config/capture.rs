//! How photographs are prepared: options of every command that reads a capture, and a section of a run's configuration.

use anyhow::{Result, bail};
use pocketsplat_capture::dataset::{Background, FrameSize, MOST_RANDOM_POINTS, PointsChoice, SceneKind};
use serde::{Deserialize, Serialize};

use super::heading::INPUT;
use super::named::{BACKGROUNDS, POINTS, SCENES, one_of};
use crate::plot::thousands;

/// How photographs are prepared.
#[derive(clap::Args, Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct CaptureOptions {
    /// Longest side of the images in pixels, to which larger ones are reduced [default: by the preset for train, the
    /// training size of the bundle elsewhere]
    #[arg(long, value_name = "PX", help_heading = INPUT)]
    pub(crate) max_resolution: Option<u32>,
    /// Size of a display, to which images are reduced and cut [default: as --max-resolution]
    #[arg(long, value_name = "WxH", conflicts_with = "max_resolution", help_heading = INPUT)]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) resolution: Option<FrameSize>,
    /// Colour behind transparent images; learned is trained with the scene [default: black for train, but white for
    /// 3dgs on a Blender capture; the bundle's elsewhere]
    #[arg(long, value_name = "COLOUR", value_parser = one_of::<Background>(BACKGROUNDS), help_heading = INPUT)]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) background: Option<Background>,
    /// What the photographs show: object, which stands on nothing, or room [default: object where pixels are transparent or one colour
    /// runs along the borders, else room]
    #[arg(long, value_name = "KIND", value_parser = one_of::<SceneKind>(SCENES), help_heading = INPUT, hide_short_help = true)]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) scene: Option<SceneKind>,
    /// Where training starts: points matched between the photographs, or random ones [default: the capture's; else of its depth maps; else
    /// matched, or random where too few are found; random for 3dgs on a Blender capture]
    #[arg(long, value_name = "ORIGIN", value_parser = one_of::<PointsChoice>(POINTS), help_heading = INPUT, hide_short_help = true)]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) points: Option<PointsChoice>,
    /// Random points, where training starts from random ones.
    #[arg(skip)]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) n_random_points: Option<usize>,
    /// Folder of images to read, for captures that hold several sizes [default: the only one, or images]
    #[arg(long, value_name = "NAME", help_heading = INPUT, hide_short_help = true)]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) images: Option<String>,
    /// Number of the sparse model to read, for COLMAP captures that hold several [default: the one with the most images]
    #[arg(long, value_name = "N", help_heading = INPUT, hide_short_help = true)]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) model: Option<u32>,
    /// Hold out every N-th view for testing where the capture has no split of its own; 0 holds out none [default: 8]
    #[arg(long, value_name = "N", help_heading = INPUT, hide_short_help = true)]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) test_every: Option<u32>,
}

/// Refuses a number of random points from which nothing can be trained.
///
/// * `said_by`: the option or key that says it.
pub(crate) fn check_random_points(n: usize, said_by: &str) -> Result<()> {
    if !(1..=MOST_RANDOM_POINTS).contains(&n) {
        let most = thousands(MOST_RANDOM_POINTS as f64);
        bail!("{said_by} asks for {n} random points, needed: 1 to {most}; give another number, or leave it out");
    }
    Ok(())
}

impl CaptureOptions {
    /// Refuses what no run can begin with.
    ///
    /// Not for captures that are only looked at: those are loaded without points.
    pub(crate) fn check(&self) -> Result<()> {
        self.n_random_points.map_or(Ok(()), |n| check_random_points(n, "`capture.n_random_points`"))
    }

    /// What is chosen here, and what `other` chooses where nothing is.
    pub(crate) fn or(&self, other: &Self) -> Self {
        // One way to say the size replaces the other.
        let size_said = self.max_resolution.is_some() || self.resolution.is_some();
        let size = if size_said { self } else { other };
        Self {
            max_resolution: size.max_resolution,
            resolution: size.resolution,
            background: self.background.or(other.background),
            scene: self.scene.or(other.scene),
            points: self.points.or(other.points),
            n_random_points: self.n_random_points.or(other.n_random_points),
            images: self.images.clone().or_else(|| other.images.clone()),
            model: self.model.or(other.model),
            test_every: self.test_every.or(other.test_every),
        }
    }
}
