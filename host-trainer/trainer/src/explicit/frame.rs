//! Explicit Gaussians between the capture's frame, in which files have them, and the normalised frame.

use glam::DVec3;
use pocketsplat_capture::dataset::Normalisation;
use pocketsplat_gaussians::Gaussians;

/// Takes Gaussians to the normalised frame: centres as [`Normalisation::point`], deviations times the scale; directions stay.
pub fn to_normalised(gaussians: &mut Gaussians, normalisation: &Normalisation) {
    map(gaussians, normalisation.scale, |centre| normalisation.point(centre));
}

/// The reverse of [`to_normalised`].
pub fn to_capture(gaussians: &mut Gaussians, normalisation: &Normalisation) {
    let Normalisation { centre, scale } = *normalisation;
    map(gaussians, 1.0 / scale, |point| point / scale + centre);
}

#[expect(clippy::cast_possible_truncation, reason = "files and training keep centres and sizes in single precision")]
fn map(gaussians: &mut Gaussians, scale: f64, point: impl Fn(DVec3) -> DVec3) {
    for centre in &mut gaussians.centres {
        *centre = point(DVec3::from(centre.map(f64::from))).to_array().map(|x| x as f32);
    }
    for log_scale in &mut gaussians.log_scales {
        *log_scale = log_scale.map(|s| (f64::from(s) + scale.ln()) as f32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back_is_the_same_place() {
        let normalisation = Normalisation { centre: DVec3::new(1.0, -2.0, 3.0), scale: 2.0 };
        let there =
            Gaussians { centres: vec![[2.0, -2.0, 2.0]], log_scales: vec![[0.0, -1.0, 2.0]], ..Gaussians::default() };
        let mut here = there.clone();
        to_normalised(&mut here, &normalisation);
        assert_eq!(here.centres, [[2.0, 0.0, -2.0]]);
        assert!((here.log_scales[0][1] - (2f32.ln() - 1.0)).abs() < 1e-6);
        to_capture(&mut here, &normalisation);
        assert_eq!(here.centres, there.centres);
        assert!((here.log_scales[0][2] - 2.0).abs() < 1e-6);
    }
}
