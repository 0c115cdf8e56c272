//! A bundle of the pack as its author has it.

use pocketsplat_format::Camera;
use pocketsplat_format::bundle::Effects;

use super::models::Anchor;

/// Nothing at all: isotropic Gaussians on black.
pub const NO_EFFECT: Effects = Effects {
    view_colour: false,
    view_geometry: false,
    view_distance: false,
    dilation_compensation: false,
    detail: false,
    anisotropic: false,
    background: false,
};

/// A bundle of the pack and the views that are drawn of it.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Its file's name without an ending.
    pub name: String,
    /// What it is for, in a sentence.
    pub about: String,
    /// Its file.
    pub bytes: Vec<u8>,
    /// What was put into it, in file order; of a file that was cut what is left.
    pub anchors: Vec<Anchor>,
    /// Tiers and camera of each frame.
    pub views: Vec<(u8, Camera)>,
}
