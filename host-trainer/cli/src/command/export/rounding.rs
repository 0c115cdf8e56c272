//! What the numbers of a file lose of the Gaussians that it was given, and which of them lose most.

use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::Image;
use pocketsplat_gaussians::Gaussians;
use pocketsplat_metrics::psnr_db;
use pocketsplat_trainer::explicit::render::Renderer;
use rayon::prelude::*;

/// Pictures that are the same have this PSNR, dB.
const SAME_DB: f64 = 100.0;
/// Cameras that decide which number loses most.
const N_CAMERAS: usize = 8;

/// Mean over pictures.
pub(super) fn mean_psnr_db(pictures: &[Image], of: &[Image]) -> f64 {
    let sum: f64 = pictures.iter().zip(of).map(|(picture, of)| psnr_db(picture, of).min(SAME_DB)).sum();
    sum / pictures.len().max(1) as f64
}

/// Gaussians before and after a file, in one frame.
pub(super) struct Rounding<'a> {
    pub(super) given: &'a Gaussians,
    pub(super) written: &'a Gaussians,
    /// Which of the given ones each of the written ones is.
    pub(super) sources: &'a [usize],
    pub(super) cameras: &'a [Camera],
    pub(super) background: [f32; 3],
    pub(super) compensation: bool,
}

/// Copies one kind of number from Gaussians to others.
type Copy = fn(&mut Gaussians, &Gaussians);

/// Numbers that may be rounded, by name.
const PARTS: [(&str, Copy); 6] = [
    ("its centres", |to, from| to.centres.clone_from(&from.centres)),
    ("its deviations", |to, from| to.log_scales.clone_from(&from.log_scales)),
    ("its rotations", |to, from| to.rotations.clone_from(&from.rotations)),
    ("its opacities", |to, from| to.opacity_logits.clone_from(&from.opacity_logits)),
    ("its constant colours", |to, from| copy_harmonics(to, from, |number| number == 0)),
    ("its harmonics that follow the view", |to, from| copy_harmonics(to, from, |number| number > 0)),
];

fn copy_harmonics(to: &mut Gaussians, from: &Gaussians, is_copied: impl Fn(usize) -> bool) {
    let n = from.degree.n_coefficients();
    for (at, (to, from)) in to.harmonics.iter_mut().zip(&from.harmonics).enumerate() {
        if is_copied(at % n) {
            *to = *from;
        }
    }
}

impl Rounding<'_> {
    fn pictures(&self, gaussians: &Gaussians, cameras: &[Camera]) -> Vec<Image> {
        let renderer = Renderer::new(gaussians).with_compensation(self.compensation);
        cameras.par_iter().map(|camera| renderer.image(camera, self.background)).collect()
    }

    /// Of the pictures after to those before.
    pub(super) fn psnr_db(&self) -> f64 {
        let of = |gaussians| self.pictures(gaussians, self.cameras);
        mean_psnr_db(&of(self.written), &of(self.given))
    }

    /// Which kind of number loses most by itself, in words.
    pub(super) fn worst(&self) -> String {
        let step = self.cameras.len().div_ceil(N_CAMERAS).max(1);
        let cameras: Vec<Camera> = self.cameras.iter().step_by(step).cloned().collect();
        let before = self.pictures(self.given, &cameras);
        let kept = self.given.chosen(self.sources);
        let psnr = |gaussians: &Gaussians| mean_psnr_db(&self.pictures(gaussians, &cameras), &before);
        let mut found = vec![("what is left out", psnr(&kept))];
        for (name, copy) in PARTS {
            let mut rounded = kept.clone();
            copy(&mut rounded, self.written);
            found.push((name, psnr(&rounded)));
        }
        let (name, psnr_db) =
            found.into_iter().fold(("nothing", SAME_DB), |least, one| if one.1 < least.1 { one } else { least });
        format!("most of it in {name} (alone {psnr_db:.1} dB from the pictures before)")
    }
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};
    use pocketsplat_capture::camera::Camera;
    use pocketsplat_gaussians::{Degree, Gaussians};

    use super::Rounding;

    fn cloud() -> Gaussians {
        // Each at a depth of its own: what lies at one is drawn in the order of the file.
        let place = |i: usize| [(i % 5) as f32 * 0.2 - 0.4, (i / 5) as f32 * 0.2 - 0.4, 3.0 + 0.01 * i as f32];
        Gaussians {
            degree: Degree::One,
            centres: (0..25).map(place).collect(),
            log_scales: vec![[-2.5; 3]; 25],
            rotations: vec![[1.0, 0.0, 0.0, 0.0]; 25],
            opacity_logits: vec![2.0; 25],
            harmonics: (0..100).map(|i| [0.3, 0.1, -0.2].map(|c| if i % 4 == 0 { c } else { 0.1 })).collect(),
        }
    }

    #[test]
    fn what_lost_most_is_named() {
        let given = cloud();
        let camera = Camera {
            rotation: DMat3::IDENTITY,
            translation: DVec3::ZERO,
            focal_px: [60.0; 2],
            principal_px: [20.0; 2],
            width_px: 40,
            height_px: 40,
        };
        let worst = |change: fn(&mut Gaussians), sources: Vec<usize>| {
            let mut written = given.chosen(&sources);
            change(&mut written);
            let cameras = [camera.clone()];
            let rounding = Rounding {
                given: &given,
                written: &written,
                sources: &sources,
                cameras: &cameras,
                background: [0.0; 3],
                compensation: false,
            };
            (rounding.worst(), rounding.psnr_db())
        };
        let all: Vec<usize> = (0..25).collect();
        let (said, same_db) = worst(|_| {}, all.clone());
        assert!(said.contains("nothing") && same_db == 100.0, "{said}");
        // In another order, which is no loss.
        assert_eq!(worst(|_| {}, all.iter().rev().copied().collect()).1, 100.0);
        type Change = fn(&mut Gaussians);
        let cases: [(Change, &str); 5] = [
            (|g| g.centres.iter_mut().for_each(|c| c[0] += 0.1), "centres"),
            (|g| g.log_scales.iter_mut().for_each(|s| s[0] -= 1.0), "deviations"),
            (|g| g.harmonics.iter_mut().step_by(4).for_each(|c| c[1] += 0.5), "constant colours"),
            (|g| g.harmonics.iter_mut().skip(2).step_by(4).for_each(|c| c[1] += 0.9), "harmonics that follow"),
            (|g| g.opacity_logits.iter_mut().for_each(|o| *o = -1.0), "opacities"),
        ];
        for (change, name) in cases {
            let (said, psnr_db) = worst(change, all.clone());
            assert!(said.contains(name) && psnr_db < 40.0, "{name}: {said}");
        }
        let (said, _) = worst(|_| {}, all[..12].to_vec());
        assert!(said.starts_with("most of it in what is left out"), "{said}");
    }
}
