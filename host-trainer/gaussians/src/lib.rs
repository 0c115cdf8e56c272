//! Explicit Gaussians with spherical harmonics, as 3D Gaussian Splatting has them (Kerbl et al. 2023), and their files.
//!
//! [`Gaussians`] is what every file holds and what the trainer draws, trains and makes of a bundle.

mod degree;

pub use degree::Degree;

/// N Gaussians; every slice has its rows in the same order.
///
/// A scene's frame is that of whoever made it: x right, y down, z forward for what this project trains.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gaussians {
    /// Degree of the colours' spherical harmonics.
    pub degree: Degree,
    /// Centres `[N]`, scene units.
    pub centres: Vec<[f32; 3]>,
    /// ln of the deviations along the Gaussian's axes `[N]`, scene units.
    pub log_scales: Vec<[f32; 3]>,
    /// Rotations `[N]`, quaternions (w, x, y, z), not necessarily of length 1.
    pub rotations: Vec<[f32; 4]>,
    /// ln(o / (1 − o)) of the opacities `[N]`.
    pub opacity_logits: Vec<f32>,
    /// Coefficients `[N · degree.n_coefficients()]`, RGB each: a colour is max(0, 1/2 + Σ Yᵢ(direction)·cᵢ), where the direction goes
    /// from the camera to the centre.
    pub harmonics: Vec<[f32; 3]>,
}

impl Gaussians {
    /// N.
    pub fn len(&self) -> usize {
        self.centres.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.centres.is_empty()
    }

    /// The coefficients of Gaussian `index`.
    ///
    /// # Panics
    /// If `index` is not below N.
    pub fn harmonics_of(&self, index: usize) -> &[[f32; 3]] {
        let n = self.degree.n_coefficients();
        &self.harmonics[index * n..(index + 1) * n]
    }
}
