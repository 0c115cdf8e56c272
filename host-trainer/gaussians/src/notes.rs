//! What a file says beside its Gaussians.

/// What a file says beside its Gaussians.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Notes {
    /// Whether opacities are to be scaled by what the dilation of 0.3 px² adds to a splat's area (Yu et al. 2024, Mip-Splatting), as
    /// they were in training.
    pub compensation: bool,
    /// Lines of text; of .ply alone.
    pub comments: Vec<String>,
    /// Names of what the file holds and [`Gaussians`](crate::Gaussians) does not; a writer writes none of it.
    pub ignored: Vec<String>,
}
