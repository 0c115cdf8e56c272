//! What the Gaussians of a grid have, as planes: a number of each cell's.

use pocketsplat_gaussians::{Degree, Gaussians};
use pocketsplat_kernels::ops::image::explicit_gaussians::Stored;
use pocketsplat_kernels::ops::image::spherical_harmonics::MOST;
use pocketsplat_trainer::explicit::Cloud;
use pocketsplat_trainer::explicit::step::CloudGradients;
use rayon::prelude::*;
use std::ops::Range;

pub(super) const CENTRE: Range<usize> = 0..3;
pub(super) const LOG_SCALE: Range<usize> = 3..6;
pub(super) const ROTATION: Range<usize> = 6..10;
pub(super) const OPACITY: Range<usize> = 10..11;
/// Of degree 0.
pub(super) const COLOUR: Range<usize> = 11..14;

/// The planes of all degrees above 0.
pub(super) fn bands(degree: Degree) -> Range<usize> {
    COLOUR.end..COLOUR.start + 3 * degree.n_coefficients()
}

/// All planes of a cloud, to the degree that is drawn.
pub(super) fn planes(cloud: &Cloud<f32>) -> Vec<Vec<f32>> {
    let plane = |of: usize| -> Vec<f32> {
        let numbers = (0..cloud.len()).map(|i| match of {
            0..3 => cloud.centres[i][of],
            3..6 => cloud.log_scales[i][of - LOG_SCALE.start],
            6..10 => cloud.rotations[i][of - ROTATION.start],
            10 => cloud.opacity_logits[i],
            _ => cloud.harmonics_of(i).as_flattened()[of - COLOUR.start],
        });
        numbers.collect()
    };
    (0..bands(cloud.degree).end).into_par_iter().map(plane).collect()
}

/// The Gaussians of planes.
pub(super) fn gaussians(planes: &[Vec<f32>], degree: Degree) -> Gaussians {
    let mut gaussians = Gaussians { degree, ..Gaussians::default() };
    let row = |i: usize, first: usize| [planes[first][i], planes[first + 1][i], planes[first + 2][i]];
    for i in 0..planes[0].len() {
        gaussians.centres.push(row(i, CENTRE.start));
        gaussians.log_scales.push(row(i, LOG_SCALE.start));
        gaussians.rotations.push(std::array::from_fn(|at| planes[ROTATION.start + at][i]));
        gaussians.opacity_logits.push(planes[OPACITY.start][i]);
        gaussians.harmonics.extend((COLOUR.start..bands(degree).end).step_by(3).map(|first| row(i, first)));
    }
    gaussians
}

/// Gradients of all Gaussians: those of a view's, and of planes from `first` on.
pub(super) fn with_planes(gradients: CloudGradients<f32>, first: usize, planes: &[Vec<f32>]) -> CloudGradients<f32> {
    let n = planes[0].len();
    let (mut stored, mut harmonics) = (vec![Stored::default(); n], vec![[[0.0; 3]; MOST]; n]);
    for ((index, seen), colour) in gradients.drawn.iter().zip(gradients.stored).zip(gradients.harmonics) {
        (stored[*index as usize], harmonics[*index as usize]) = (seen, colour);
    }
    stored.par_iter_mut().zip(harmonics.par_iter_mut()).enumerate().for_each(|(i, (stored, harmonics))| {
        for (of, plane) in (first..).zip(planes) {
            let d = match of {
                0..3 => &mut stored.centre[of],
                3..6 => &mut stored.log_scale[of - LOG_SCALE.start],
                6..10 => &mut stored.rotation[of - ROTATION.start],
                10 => &mut stored.opacity_logit,
                _ => &mut harmonics.as_flattened_mut()[of - COLOUR.start],
            };
            *d += plane[i];
        }
    });
    // Density control, which asks for it, is over.
    let screen = vec![0.0; n];
    CloudGradients { drawn: (0u32..).take(n).collect(), stored, harmonics, screen, ..gradients }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scenes;

    #[test]
    fn planes_are_the_gaussians_and_gradients_go_to_the_numbers_that_they_are_of() {
        let before = test_scenes::gaussians(7);
        let cloud = Cloud::from(&before);
        let planes = planes(&cloud);
        assert_eq!(planes.len(), 59);
        assert_eq!(gaussians(&planes, Degree::Three), before);
        let none = CloudGradients {
            loss: 1.0,
            squared_error: 0.0,
            drawn: vec![2],
            stored: vec![Stored { opacity_logit: 5.0, ..Stored::default() }],
            harmonics: vec![[[0.0; 3]; MOST]],
            screen: vec![1.0],
        };
        let found = with_planes(none, LOG_SCALE.start, &planes[LOG_SCALE.start..]);
        for (i, d) in found.stored.iter().enumerate() {
            let seen = if i == 2 { 5.0 } else { 0.0 };
            let expected =
                Stored { centre: [0.0; 3], opacity_logit: before.opacity_logits[i] + seen, ..cloud.stored(i) };
            assert_eq!(*d, expected);
            assert_eq!(found.harmonics[i], before.harmonics[i * MOST..][..MOST]);
        }
    }
}
