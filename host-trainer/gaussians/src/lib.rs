//! Explicit Gaussians with spherical harmonics, as 3D Gaussian Splatting has them (Kerbl et al. 2023), and their files.
//!
//! [`Gaussians`] is what every file holds and what the trainer draws, trains and makes of a bundle. [`read`] tells the format by the
//! bytes. Writers keep the scene's own numbers where the format holds them; else [`Frame`] says how the file's numbers lie in the scene.

mod account;
mod axes;
mod check;
mod degree;
mod error;
mod file;
mod fit;
mod format;
mod frame;
pub mod glb;
mod meaning;
mod notes;
mod opacity;
pub mod ply;
pub mod sog;
pub mod splat;
pub mod spz;
mod written;

pub use account::{Account, Part};
pub use axes::SpzAxes;
pub use degree::Degree;
pub use error::{FileError, Unreadable};
pub use file::{account, is_one, read};
pub use format::Format;
pub use frame::Frame;
pub use notes::Notes;
pub use written::Written;

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

    /// The same with harmonics of `degree` at most; colours then follow the view less.
    #[must_use]
    pub fn reduced_to(&self, degree: Degree) -> Self {
        let degree = degree.min(self.degree);
        let harmonics = (0..self.len()).flat_map(|index| &self.harmonics_of(index)[..degree.n_coefficients()]);
        Self { degree, harmonics: harmonics.copied().collect(), ..self.clone() }
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

#[cfg(test)]
pub(crate) mod tests {
    use super::{Degree, Gaussians};

    /// Three Gaussians of degree 3 whose numbers all differ.
    pub(crate) fn example() -> Gaussians {
        of_degree(Degree::Three, 3)
    }

    /// `n` Gaussians whose numbers all differ and lie where scenes have theirs.
    pub(crate) fn of_degree(degree: Degree, n: usize) -> Gaussians {
        let wave = |index: usize, phase: f32| (index as f32 * 0.7 + phase).sin();
        Gaussians {
            degree,
            centres: (0..n).map(|i| [3.0 * wave(i, 0.1), 2.0 * wave(i, 1.3), 4.0 * wave(i, 2.9)]).collect(),
            log_scales: (0..n).map(|i| [0.1, 0.5, 0.9].map(|phase| -4.0 + 2.0 * wave(i, phase))).collect(),
            rotations: (0..n).map(|i| [0.2, 1.2, 2.2, 3.2].map(|phase| wave(i, phase))).collect(),
            opacity_logits: (0..n).map(|i| 3.0 * wave(i, 0.4)).collect(),
            harmonics: (0..n * degree.n_coefficients())
                .map(|i| [0.3, 0.6, 1.9].map(|phase| 0.8 * wave(i, phase)))
                .collect(),
        }
    }
}
