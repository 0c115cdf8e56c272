//! Explicit Gaussians on their way from the capture's frame, or a file's, to the normalised one.

use glam::DVec3;
use pocketsplat_capture::dataset::Normalisation;
use pocketsplat_gaussians::{Frame, Gaussians};

/// Takes Gaussians to the normalised frame: centres as [`Normalisation::point`], deviations times the scale; directions stay.
#[expect(clippy::cast_possible_truncation, reason = "files and training keep centres and sizes in single precision")]
pub fn to_normalised(gaussians: &mut Gaussians, normalisation: &Normalisation) {
    for centre in &mut gaussians.centres {
        *centre = normalisation.point(DVec3::from(centre.map(f64::from))).to_array().map(|x| x as f32);
    }
    for log_scale in &mut gaussians.log_scales {
        *log_scale = log_scale.map(|s| (f64::from(s) + normalisation.scale.ln()) as f32);
    }
}

/// What takes the numbers of a file to the frame that `normalisation` makes of the scene's.
///
/// * `frame`: where the file's numbers lie in the scene.
pub fn of_file(frame: &Frame, normalisation: &Normalisation) -> Normalisation {
    let centre = (normalisation.centre - DVec3::from(frame.offset)) / frame.scale;
    Normalisation { centre, scale: normalisation.scale * frame.scale }
}

/// What takes the scene to the numbers of a file that lie in it as `frame` says.
pub fn of_scene(frame: &Frame) -> Normalisation {
    Normalisation { centre: DVec3::from(frame.offset), scale: 1.0 / frame.scale }
}

/// What takes the scene to the frame that `normalisation` makes of the numbers of a file: [`of_scene`], then that.
pub fn of_scene_through_file(frame: &Frame, normalisation: &Normalisation) -> Normalisation {
    let centre = DVec3::from(frame.offset) + normalisation.centre * frame.scale;
    Normalisation { centre, scale: normalisation.scale / frame.scale }
}

/// Where numbers of the normalised frame lie in the scene.
pub fn of_normalised(normalisation: &Normalisation) -> Frame {
    Frame { offset: normalisation.centre.to_array(), scale: 1.0 / normalisation.scale }
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
        // As a file of normalised numbers has them.
        let mut again = here.clone();
        to_normalised(&mut again, &of_file(&of_normalised(&normalisation), &normalisation));
        assert_eq!(again, here);
        let millimetres = Frame { offset: [1.0, 0.0, 2.0], scale: 1e-3 };
        let mut file = Gaussians { centres: vec![[1000.0, -2000.0, 0.0]], ..there };
        to_normalised(&mut file, &of_file(&millimetres, &normalisation));
        assert_eq!(file.centres, here.centres);
        let of_numbers = of_file(&millimetres, &normalisation);
        let of_scene_again = of_scene_through_file(&millimetres, &of_numbers);
        let place = DVec3::new(2.0, -2.0, 2.0);
        assert!((of_scene_again.point(place) - normalisation.point(place)).length() < 1e-12);
        assert_eq!(of_scene(&millimetres).point(place), DVec3::new(1000.0, -2000.0, 0.0));
    }
}
