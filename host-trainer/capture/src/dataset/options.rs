//! What the user may choose about loading.

use std::fmt;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::{DatasetError, FrameSize, SceneKind};

/// What stands behind everything: the colour that transparent pixels are composited on.
///
/// Published figures of the anchor-based family are on black; white costs about 0.6 dB on Synthetic-NeRF, so figures on
/// different backgrounds do not compare.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Background {
    /// RGB 0, 0, 0.
    #[default]
    Black,
    /// RGB 255, 255, 255.
    White,
    /// Black for what is transparent; behind the scene whatever colour training finds.
    Learned,
}

impl Background {
    /// The colour as 8-bit RGB.
    pub fn rgb8(self) -> [u8; 3] {
        match self {
            Self::Black | Self::Learned => [0; 3],
            Self::White => [255; 3],
        }
    }

    /// The background of this 8-bit RGB, if it has a name.
    pub fn of_rgb8(rgb8: [u8; 3]) -> Option<Self> {
        [Self::Black, Self::White].into_iter().find(|known| known.rgb8() == rgb8)
    }

    /// The colour as the 8-bit value / 255.
    pub fn rgb(self) -> [f32; 3] {
        self.rgb8().map(|channel| f32::from(channel) / 255.0)
    }
}

impl fmt::Display for Background {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Black => "black",
            Self::White => "white",
            Self::Learned => "learned",
        })
    }
}

/// Decoded photographs stay in memory up to this many bytes in all: 200 of 1600×1066 pixels.
///
/// Half of the 2 GiB that training on any capture is to keep to at that size; the rest is for the step.
pub const MOST_IN_MEMORY_BYTES: u64 = 1 << 30;

/// What a capture's points are to be, whatever it brings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PointsChoice {
    /// Matched between the photographs.
    Matched,
    /// Drawn at random where the cameras look.
    Random,
}

/// Random points that are made at most: a hundred times the published number of explicit Gaussians, a thousand times that of anchors.
pub const MOST_RANDOM_POINTS: usize = 10_000_000;

/// How to load a capture.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadOptions {
    /// Images whose larger side exceeds this many pixels are reduced to it, intrinsics with them; none are enlarged.
    pub max_resolution: Option<u32>,
    /// Images are reduced until they just cover such a frame, and their middle is kept, intrinsics with them; instead of
    /// [`max_resolution`](Self::max_resolution), which then says nothing. Smaller images are left out.
    pub frame: Option<FrameSize>,
    /// What transparent pixels are composited on.
    pub background: Background,
    /// What the capture shows; without it what its photographs look like decides.
    pub scene: Option<SceneKind>,
    /// Where the initial points come from; without it from the capture, else from its depth maps, else matched between the photographs,
    /// else, where too few are found, random.
    pub points: Option<PointsChoice>,
    /// Files in which points may lie that an earlier load made of the same photographs, see [`Capture::made_points`](super::Capture).
    pub made_points: Vec<PathBuf>,
    /// Decides the random initial points of captures that bring none.
    pub seed: u64,
    /// How many random initial points a capture that brings none gets.
    pub n_random_points: usize,
    /// The folder of images to read, for captures that hold several (`images`, `images_2`, …).
    ///
    /// Without it the only one there is, or `images`. Blender captures name each image by its path and ignore it.
    pub images: Option<String>,
    /// The sparse model to read, by its number, for COLMAP captures that hold several; without it the largest.
    pub model: Option<u32>,
    /// Every this many-th view, sorted by name and counted from the first, is held out where the capture gives no
    /// split of its own; 0 holds out none. Views whose image is missing count, so that the split does not depend on
    /// which files are there.
    pub test_every: u32,
    /// Where photographs are kept decoded when they do not stay in memory: a folder, which is made; without one they are
    /// decoded again whenever they are asked for. [`remove_cache`](super::remove_cache) removes it.
    pub cache: Option<PathBuf>,
    /// Photographs that take more bytes than this, decoded, do not stay in memory.
    pub in_memory_bytes: u64,
}

impl Default for LoadOptions {
    fn default() -> Self {
        // 10 000 points is what the anchor-based family starts Synthetic-NeRF scenes from.
        Self {
            max_resolution: None,
            frame: None,
            background: Background::Black,
            scene: None,
            points: None,
            made_points: Vec::new(),
            seed: 42,
            n_random_points: 10_000,
            images: None,
            model: None,
            // As every published figure on COLMAP captures.
            test_every: 8,
            cache: None,
            in_memory_bytes: MOST_IN_MEMORY_BYTES,
        }
    }
}

impl LoadOptions {
    /// Refuses values that no capture can be loaded with.
    pub(super) fn check(&self) -> Result<(), DatasetError> {
        let (found, most) = (self.n_random_points, MOST_RANDOM_POINTS);
        match (self.max_resolution, self.test_every) {
            (Some(0), _) => Err(DatasetError::MaxResolution { found: 0 }),
            (_, 1) => Err(DatasetError::TestEvery { found: 1 }),
            _ if found > most => Err(DatasetError::RandomPoints { found, most }),
            _ => Ok(()),
        }
    }
}
