//! N explicit Gaussians, in the number type of the operations.

use pocketsplat_gaussians::{Degree, Gaussians};

use pocketsplat_kernels::ops::image::explicit_gaussians::Stored;
use pocketsplat_kernels::ops::image::spherical_harmonics::MOST;
use pocketsplat_kernels::real::Real;

/// As [`Gaussians`] has them: rows of all arrays in the same order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cloud<R> {
    /// Degree that is drawn; more coefficients may be stored.
    pub degree: Degree,
    /// Whether opacities are scaled by what the dilation adds to a splat's area (Yu et al. 2024, Mip-Splatting).
    pub compensation: bool,
    /// Coefficients that are stored of each colour channel.
    pub n_coefficients: usize,
    /// `[N]`, normalised frame.
    pub centres: Vec<[R; 3]>,
    /// `[N]` ln of the deviations.
    pub log_scales: Vec<[R; 3]>,
    /// `[N]` quaternions (w, x, y, z) of any length.
    pub rotations: Vec<[R; 4]>,
    /// `[N]`.
    pub opacity_logits: Vec<R>,
    /// `[N · n_coefficients]`, RGB each.
    pub harmonics: Vec<[R; 3]>,
}

impl<R: Real> Cloud<R> {
    /// Nothing yet, of a degree that is stored and drawn.
    pub fn empty(degree: Degree) -> Self {
        Self { degree, n_coefficients: degree.n_coefficients(), ..Self::default() }
    }

    /// N.
    pub fn len(&self) -> usize {
        self.centres.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.centres.is_empty()
    }

    /// What is stored of Gaussian `index` besides its colour.
    #[inline(always)]
    pub fn stored(&self, index: usize) -> Stored<R> {
        Stored {
            centre: self.centres[index],
            log_scale: self.log_scales[index],
            rotation: self.rotations[index],
            opacity_logit: self.opacity_logits[index],
        }
    }

    /// The coefficients of Gaussian `index`.
    #[inline(always)]
    pub fn harmonics_of(&self, index: usize) -> &[[R; 3]] {
        &self.harmonics[index * self.n_coefficients..][..self.n_coefficients]
    }

    /// Appends one.
    ///
    /// * `harmonics`: as many as there are stored of each.
    pub fn push(&mut self, stored: &Stored<R>, harmonics: &[[R; 3]]) {
        self.centres.push(stored.centre);
        self.log_scales.push(stored.log_scale);
        self.rotations.push(stored.rotation);
        self.opacity_logits.push(stored.opacity_logit);
        self.harmonics.extend_from_slice(&harmonics[..self.n_coefficients]);
    }
}

impl Cloud<f32> {
    /// Gaussians with room for coefficients of degree 3, as [`CloudOptimiser`](super::optimiser::CloudOptimiser) takes them; those
    /// beyond their own degree are 0.
    pub fn with_room(gaussians: &Gaussians) -> Self {
        let drawn = Self::from(gaussians);
        let mut cloud = Self { degree: drawn.degree, ..Self::empty(Degree::Three) };
        for i in 0..drawn.len() {
            let mut harmonics = [[0.0; 3]; MOST];
            harmonics[..drawn.n_coefficients].copy_from_slice(drawn.harmonics_of(i));
            cloud.push(&drawn.stored(i), &harmonics);
        }
        cloud
    }
}

impl From<&Gaussians> for Cloud<f32> {
    fn from(gaussians: &Gaussians) -> Self {
        let Gaussians { degree, centres, log_scales, rotations, opacity_logits, harmonics } = gaussians.clone();
        let n_coefficients = degree.n_coefficients();
        Self { degree, compensation: false, n_coefficients, centres, log_scales, rotations, opacity_logits, harmonics }
    }
}

impl From<Cloud<f32>> for Gaussians {
    /// All coefficients that are stored, drawn or not.
    fn from(cloud: Cloud<f32>) -> Self {
        let Cloud { n_coefficients, centres, log_scales, rotations, opacity_logits, harmonics, .. } = cloud;
        let degree = Degree::with_coefficients(n_coefficients).expect("as many as a degree has");
        Self { degree, centres, log_scales, rotations, opacity_logits, harmonics }
    }
}
