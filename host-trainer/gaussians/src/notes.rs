//! What a file says beside its Gaussians, and what there is to say of it.

use crate::Frame;
use crate::axes::SpzAxes;

/// What a file says beside its Gaussians, and what there is to say of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Notes {
    /// Whether opacities are to be scaled by what the dilation of 0.3 px² adds to a splat's area (Yu et al. 2024, Mip-Splatting), as
    /// they were in training.
    pub compensation: bool,
    /// Where the file's numbers lie in the scene.
    pub frame: Frame,
    /// Lines of text; of .ply alone.
    pub comments: Vec<String>,
    /// How the axes of a .spz were taken, and how a writer of .spz writes them; `None` for every other file, and for a .spz whose record
    /// names yet other axes.
    pub spz_axes: Option<SpzAxes>,
    /// Names of what the file holds and [`Gaussians`](crate::Gaussians) does not; a writer writes none of it.
    pub ignored: Vec<String>,
    /// What was not read as it stands, a sentence each; a writer writes none of it.
    pub warnings: Vec<String>,
    /// What was decided in reading, a sentence each; a writer writes none of it.
    pub remarks: Vec<String>,
}
