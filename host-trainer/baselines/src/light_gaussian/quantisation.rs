//! Numbers of few bits: places on a lattice, halves, and a codebook for the colours of Gaussians that matter least.

use half::f16;
use pocketsplat_gaussians::{Degree, Gaussians};
use pocketsplat_kernels::ops::image::explicit_gaussians::Stored;
use pocketsplat_kernels::ops::image::spherical_harmonics::MOST;
use pocketsplat_trainer::explicit::Cloud;
use pocketsplat_trainer::explicit::optimiser::CloudOptimiser;
use pocketsplat_trainer::explicit::step::CloudGradients;
use pocketsplat_trainer::train::TrainError;

use super::significance::{least_significant, significance};
use crate::k_means::k_means;
use crate::packed::halved;
use crate::tuning::{Tuning, picked};
use crate::voxels::Lattice;

/// Share of the Gaussians whose colours the codebook has.
const CODED_SHARE: f64 = 0.6;

/// Codes.
const N_CODES: usize = 8192;

/// Rounds of k-means.
const ROUNDS: usize = 10;

/// Steps that move the codes, beside a run of 30,000.
const STEPS: u32 = 5_000;

/// Numbers of a shape: log-scales, quaternion, opacity logit.
pub(super) const SHAPE: usize = 8;

/// Numbers of a colour: the coefficients of degree 2.
pub(super) const COLOUR: usize = 3 * Degree::Two.n_coefficients();

/// N Gaussians as their file has them, in the order of their voxels.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantised {
    pub(super) lattice: Lattice,
    /// `[N]` Morton codes, ascending.
    pub(super) voxels: Vec<u64>,
    /// `[N]`.
    pub(super) shapes: Vec<[f16; SHAPE]>,
    /// `[N]` the codes of those that have one.
    pub(super) code_of: Vec<Option<u16>>,
    /// `[n_codes]`.
    pub(super) codebook: Vec<[f16; COLOUR]>,
    /// The colours of those without a code.
    pub(super) kept: Vec<[f16; COLOUR]>,
}

impl Quantised {
    /// The Gaussians.
    pub fn gaussians(&self) -> Gaussians {
        let mut gaussians = Gaussians { degree: Degree::Two, ..Gaussians::default() };
        let mut kept = self.kept.iter();
        for ((voxel, shape), code) in self.voxels.iter().zip(&self.shapes).zip(&self.code_of) {
            let [x, y, z, rotation @ .., opacity_logit] = shape.map(f16::to_f32);
            gaussians.centres.push(self.lattice.middle_of(*voxel));
            gaussians.log_scales.push([x, y, z]);
            gaussians.rotations.push(rotation);
            gaussians.opacity_logits.push(opacity_logit);
            let colour = code.map_or_else(|| kept.next(), |code| self.codebook.get(usize::from(code)));
            let colour = colour.expect("codes and kept colours were counted").map(f16::to_f32);
            gaussians.harmonics.extend(colour.as_chunks().0);
        }
        gaussians
    }
}

/// Rounds places and shapes, gives the least significant a code each for their colours, and lets the codes learn what the rounding cost.
///
/// * `cloud`: of degree 2 at most.
pub(super) fn quantised(tuning: &mut Tuning<'_>, cloud: &Cloud<f32>) -> Result<Quantised, TrainError> {
    let lattice = Lattice::around(&cloud.centres);
    let mut order: Vec<_> = cloud.centres.iter().map(|place| lattice.voxel_of(*place)).zip(0usize..).collect();
    order.sort_unstable();
    let voxels: Vec<u64> = order.iter().map(|(voxel, _)| *voxel).collect();
    let mut cloud = picked(cloud, order.into_iter().map(|(_, row)| row));
    let shapes: Vec<_> = (0..cloud.len()).map(|i| shape_of(&cloud.stored(i))).collect();
    for (i, (voxel, shape)) in voxels.iter().zip(&shapes).enumerate() {
        let [x, y, z, rotation @ .., opacity_logit] = shape.map(f16::to_f32);
        cloud.centres[i] = lattice.middle_of(*voxel);
        (cloud.log_scales[i], cloud.rotations[i], cloud.opacity_logits[i]) = ([x, y, z], rotation, opacity_logit);
    }
    for value in cloud.harmonics.as_flattened_mut() {
        *value = halved(*value).to_f32();
    }

    let significance = significance(tuning.level, &cloud, &tuning.cameras);
    let is_coded = least_significant(&significance, CODED_SHARE);
    let coded: Vec<usize> = (0..cloud.len()).filter(|i| is_coded[*i]).collect();
    let colours: Vec<_> = coded.iter().map(|i| colour_of(&cloud, *i)).collect();
    let weights: Vec<f64> = coded.iter().map(|i| significance[*i]).collect();
    let (codes, nearest) = k_means(&colours, &weights, N_CODES, ROUNDS, &mut tuning.random());
    let codebook = tuned(tuning, cloud.clone(), &coded, &nearest, &codes)?;
    let mut code_of = vec![None; cloud.len()];
    for (i, code) in coded.iter().zip(&nearest) {
        code_of[*i] = Some(u16::try_from(*code).expect("fewer codes than 2¹⁶"));
    }
    let kept = (0..cloud.len()).filter(|i| !is_coded[*i]).map(|i| colour_of(&cloud, i).map(halved)).collect();
    let codebook = codebook.into_iter().map(|code| code.map(halved)).collect();
    Ok(Quantised { lattice, voxels, shapes, code_of, codebook, kept })
}

/// The codes after steps on the photographs that move nothing else: a code's gradient is the sum of its Gaussians'.
///
/// * `coded`: the Gaussians with a code. * `code_of`: of each of these.
fn tuned(
    tuning: &mut Tuning<'_>,
    mut cloud: Cloud<f32>,
    coded: &[usize],
    code_of: &[usize],
    codes: &[[f32; COLOUR]],
) -> Result<Vec<[f32; COLOUR]>, TrainError> {
    // A Gaussian for each code, of which nothing but the colour ever has a gradient.
    let mut book = Cloud { degree: cloud.degree, ..Cloud::empty(Degree::Three) };
    for code in codes {
        let mut harmonics = [[0.0; 3]; MOST];
        harmonics.as_flattened_mut()[..COLOUR].copy_from_slice(code);
        book.push(&Stored::default(), &harmonics);
    }
    let mut row_of = vec![None; cloud.len()];
    coded.iter().zip(code_of).for_each(|(i, code)| row_of[*i] = Some(*code));
    let mut optimiser = CloudOptimiser::new(book.len());
    let spread = |book: &Cloud<f32>, cloud: &mut Cloud<f32>| {
        for (i, code) in coded.iter().zip(code_of) {
            cloud.harmonics[i * MOST..][..MOST].copy_from_slice(book.harmonics_of(*code));
        }
    };
    spread(&book, &mut cloud);
    tuning.stage(STEPS, |turn, _| {
        let gradients = turn.gradients(&cloud)?;
        let cause = turn.apply(&mut optimiser, &mut book, &summed(&gradients, &row_of, codes.len()));
        spread(&book, &mut cloud);
        Ok(cause)
    })?;
    Ok((0..book.len()).map(|code| colour_of(&book, code)).collect())
}

/// Gradients of the codes, in the order of the Gaussians.
fn summed(gradients: &CloudGradients<f32>, row_of: &[Option<usize>], n_codes: usize) -> CloudGradients<f32> {
    let mut harmonics = vec![[[0.0; 3]; MOST]; n_codes];
    for (index, d_colour) in gradients.drawn.iter().zip(&gradients.harmonics) {
        if let Some(code) = row_of[*index as usize] {
            let sum = harmonics[code].as_flattened_mut();
            sum.iter_mut().zip(d_colour.as_flattened()).for_each(|(sum, d)| *sum += d);
        }
    }
    CloudGradients {
        loss: gradients.loss,
        squared_error: gradients.squared_error,
        drawn: (0u32..).take(n_codes).collect(),
        stored: vec![Stored::default(); n_codes],
        harmonics,
        screen: vec![0.0; n_codes],
    }
}

/// Rounded; the quaternion of length 1.
fn shape_of(stored: &Stored<f32>) -> [f16; SHAPE] {
    let [x, y, z] = stored.log_scale;
    let length = stored.rotation.iter().map(|q| q * q).sum::<f32>().sqrt();
    let [w, i, j, k] = stored.rotation.map(|q| if length > 0.0 { q / length } else { q });
    [x, y, z, w, i, j, k, stored.opacity_logit].map(halved)
}

fn colour_of(cloud: &Cloud<f32>, i: usize) -> [f32; COLOUR] {
    let harmonics = cloud.harmonics_of(i).as_flattened();
    std::array::from_fn(|at| harmonics[at])
}

#[cfg(test)]
mod tests {
    use pocketsplat_kernels::ops::Pinhole;
    use pocketsplat_trainer::explicit::render::Renderer;

    use super::*;
    use crate::baseline::TrainedScene;
    use crate::test_scenes::{capture_of, gaussians, short_config};

    #[test]
    fn the_codebook_has_the_colours_of_those_that_matter_least() {
        let gaussians = gaussians(50).reduced_to(Degree::Two);
        let (capture, config) = (capture_of(&gaussians, 4), short_config());
        let scene = TrainedScene { gaussians: &gaussians, capture: &capture, config: &config };
        let mut tuning = Tuning::new(&scene).unwrap();
        let cloud = tuning.cloud();
        let quantised = quantised(&mut tuning, &cloud).unwrap();
        assert_eq!((quantised.codebook.len(), quantised.kept.len()), (30, 20), "no more codes than colours");
        let rounded = quantised.gaussians();
        let cameras: Vec<_> = capture.train.iter().map(|view| Pinhole::new(&view.camera)).collect();
        let significance = significance(tuning.level, &Cloud::from(&rounded), &cameras);
        let mean = |coded| {
            let of: Vec<f64> =
                (0..50).filter(|i| quantised.code_of[*i].is_some() == coded).map(|i| significance[i]).collect();
            of.iter().sum::<f64>() / of.len() as f64
        };
        assert!(mean(true) < 0.5 * mean(false), "{} and {}", mean(true), mean(false));
        assert!(quantised.voxels.is_sorted());
        // Each has a code of its own, so that only rounding and a few steps lie between the pictures.
        let camera = &capture.train[1].camera;
        let [before, after] = [&gaussians, &rounded].map(|g| Renderer::new(g).planes(camera, [0.0; 3]));
        let most = before.iter().zip(&after).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(most > 0.0 && most < 0.05, "{most}");
    }

    #[test]
    fn steps_on_the_photographs_make_up_for_few_codes() {
        let gaussians = gaussians(50).reduced_to(Degree::Two);
        let (capture, mut config) = (capture_of(&gaussians, 4), short_config());
        config.iterations = 3000;
        let scene = TrainedScene { gaussians: &gaussians, capture: &capture, config: &config };
        let mut tuning = Tuning::new(&scene).unwrap();
        let cloud = tuning.cloud();
        let all: Vec<usize> = (0..50).collect();
        let colours: Vec<_> = all.iter().map(|i| colour_of(&cloud, *i)).collect();
        let (codes, nearest) = k_means(&colours, &[1.0; 50], 6, ROUNDS, &mut tuning.random());
        let tuned = tuned(&mut tuning, cloud.clone(), &all, &nearest, &codes).unwrap();
        let error = |codes: &[[f32; COLOUR]]| -> f64 {
            let mut coded = gaussians.clone();
            coded.harmonics = nearest.iter().flat_map(|code| codes[*code].as_chunks().0.to_vec()).collect();
            let of = |camera| {
                let [a, b] = [&gaussians, &coded].map(|g| Renderer::new(g).planes(camera, [0.0; 3]));
                a.iter().zip(&b).map(|(a, b)| f64::from((a - b).abs())).sum::<f64>()
            };
            capture.train.iter().map(|view| of(&view.camera)).sum()
        };
        assert!(error(&tuned) < 0.9 * error(&codes), "{} of {}", error(&tuned), error(&codes));
    }
}
