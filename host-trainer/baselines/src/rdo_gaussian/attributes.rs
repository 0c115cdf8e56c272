//! The attributes that have codebooks: scales, rotations, base colours, and each degree of the harmonics.

use std::ops::Range;

use pocketsplat_gaussians::Degree;
use pocketsplat_trainer::explicit::Cloud;
use pocketsplat_trainer::explicit::step::CloudGradients;
use rand_chacha::ChaCha8Rng;

use super::codebook::Codebook;

/// Numbers of each: log-scales, quaternion, then degrees 0 to 3.
pub(super) const WIDTHS: [usize; 6] = [3, 4, 3, 9, 15, 21];

/// The attributes before degree 1, which every Gaussian has.
pub(super) const ALWAYS: usize = 3;

/// Attributes of Gaussians of a degree.
pub(super) fn n_attributes(degree: Degree) -> usize {
    ALWAYS + degree.number()
}

/// Where a degree's attribute lies among all coefficients of a Gaussian.
fn band(attribute: usize) -> Range<usize> {
    let begin = 3 * (attribute + 1 - ALWAYS).pow(2);
    begin..begin + WIDTHS[attribute]
}

/// One attribute of N Gaussians, and the codes that stand for it.
#[derive(Clone, Debug)]
pub(super) struct Coded {
    pub(super) attribute: usize,
    pub(super) book: Codebook,
    /// `[N]`; those without have the attribute 0.
    pub(super) chosen: Vec<Option<u16>>,
}

impl Coded {
    /// A codebook for all Gaussians.
    ///
    /// * `price`: see [`Codebook::new`].
    pub(super) fn new(attribute: usize, cloud: &Cloud<f32>, price: f32, rng: &mut ChaCha8Rng) -> Self {
        let vectors: Vec<f32> = (0..cloud.len()).flat_map(|i| of_cloud(cloud, i, attribute)).copied().collect();
        let book = Codebook::new(WIDTHS[attribute], &vectors, price, rng);
        let chosen = book.choose(&vectors, price).into_iter().map(Some).collect();
        Self { attribute, book, chosen }
    }

    /// Chooses all codes anew.
    pub(super) fn choose(&mut self, cloud: &Cloud<f32>, price: f32) {
        let vectors: Vec<f32> =
            with_codes(self.attribute, &self.chosen, cloud).flat_map(|(_, vector)| vector).copied().collect();
        let chosen = self.book.choose(&vectors, price);
        self.chosen.iter_mut().flatten().zip(chosen).for_each(|(code, chosen)| *code = chosen);
    }

    /// Makes each code the mean of its vectors.
    pub(super) fn centre(&mut self, cloud: &Cloud<f32>) {
        self.book.centre(|| with_codes(self.attribute, &self.chosen, cloud));
    }

    /// Gradients of the codes `[K, width]`: each the sum of its Gaussians'.
    pub(super) fn d_codes(&self, gradients: &CloudGradients<f32>) -> Vec<f32> {
        let mut d_codes = vec![0.0; self.book.codes.len()];
        for (row, index) in gradients.drawn.iter().enumerate() {
            if let Some(code) = self.chosen[*index as usize] {
                let sum = &mut d_codes[usize::from(code) * self.book.width..];
                sum.iter_mut().zip(of_gradients(gradients, row, self.attribute)).for_each(|(sum, d)| *sum += d);
            }
        }
        d_codes
    }
}

/// Writes codes in place of what they stand for.
///
/// * `codes`: `[K, width]`. * `chosen`: `[N]`; see [`Coded`].
pub(super) fn put(attribute: usize, codes: &[f32], chosen: &[Option<u16>], cloud: &mut Cloud<f32>) {
    let width = WIDTHS[attribute];
    for (i, code) in chosen.iter().enumerate() {
        let values = of_cloud_mut(cloud, i, attribute);
        match code {
            Some(code) => values.copy_from_slice(&codes[usize::from(*code) * width..][..width]),
            None => values.fill(0.0),
        }
    }
}

/// Code and vector of each Gaussian that has them.
fn with_codes<'a>(
    attribute: usize,
    chosen: &'a [Option<u16>],
    cloud: &'a Cloud<f32>,
) -> impl Iterator<Item = (u16, &'a [f32])> {
    let of = move |(i, code): (usize, &Option<u16>)| code.map(|code| (code, of_cloud(cloud, i, attribute)));
    chosen.iter().enumerate().filter_map(of)
}

/// An attribute of Gaussian `index`.
pub(super) fn of_cloud(cloud: &Cloud<f32>, index: usize, attribute: usize) -> &[f32] {
    match attribute {
        0 => &cloud.log_scales[index],
        1 => &cloud.rotations[index],
        _ => &cloud.harmonics_of(index).as_flattened()[band(attribute)],
    }
}

fn of_cloud_mut(cloud: &mut Cloud<f32>, index: usize, attribute: usize) -> &mut [f32] {
    match attribute {
        0 => &mut cloud.log_scales[index],
        1 => &mut cloud.rotations[index],
        _ => {
            let n = cloud.n_coefficients;
            &mut cloud.harmonics[index * n..][..n].as_flattened_mut()[band(attribute)]
        }
    }
}

/// An attribute's gradient in row `row`.
pub(super) fn of_gradients(gradients: &CloudGradients<f32>, row: usize, attribute: usize) -> &[f32] {
    match attribute {
        0 => &gradients.stored[row].log_scale,
        1 => &gradients.stored[row].rotation,
        _ => &gradients.harmonics[row].as_flattened()[band(attribute)],
    }
}

#[cfg(test)]
mod tests {
    use pocketsplat_kernels::finite_difference::random;
    use pocketsplat_kernels::ops::image::explicit_gaussians::Stored;
    use pocketsplat_kernels::ops::image::spherical_harmonics::MOST;
    use rand::SeedableRng;

    use super::*;
    use crate::test_scenes::gaussians;

    #[test]
    #[expect(clippy::cast_possible_truncation, reason = "any numbers")]
    fn a_code_has_the_gradients_of_its_gaussians() {
        let cloud = Cloud::from(&gaussians(200));
        let numbers: Vec<f32> = random(4, 7 * 55).into_iter().map(|x| x as f32).collect();
        let row = |row: usize| &numbers[55 * row..][..55];
        let gradients = CloudGradients {
            loss: 0.0,
            squared_error: 0.0,
            drawn: (0..7).map(|row| 23 * row).collect(),
            stored: (0..7)
                .map(|i| Stored {
                    log_scale: std::array::from_fn(|at| row(i)[at]),
                    rotation: std::array::from_fn(|at| row(i)[at + 3]),
                    ..Stored::default()
                })
                .collect(),
            harmonics: (0..7)
                .map(|i| std::array::from_fn(|k: usize| std::array::from_fn(|c| row(i)[7 + 3 * k + c])))
                .collect(),
            screen: vec![0.0; 7],
        };
        let mut n_numbers = 0;
        for attribute in 0..n_attributes(cloud.degree) {
            let mut coded = Coded::new(attribute, &cloud, 0.0, &mut ChaCha8Rng::seed_from_u64(1));
            coded.chosen[46] = None;
            let found = coded.d_codes(&gradients);
            let loss = |book: &Codebook| -> f32 {
                let mut drawn = cloud.clone();
                put(attribute, &book.codes, &coded.chosen, &mut drawn);
                let of = |row: usize| {
                    let values = of_cloud(&drawn, gradients.drawn[row] as usize, attribute);
                    values.iter().zip(of_gradients(&gradients, row, attribute)).map(|(x, d)| x * d).sum::<f32>()
                };
                (0..7).map(of).sum()
            };
            for (at, found) in found.iter().enumerate() {
                let at = |by: f32| {
                    let mut moved = coded.book.clone();
                    moved.codes[at] += by;
                    loss(&moved)
                };
                let difference = (at(0.25) - at(-0.25)) / 0.5;
                assert!((found - difference).abs() < 1e-4, "{attribute}: {found}, expected {difference}");
            }
            n_numbers += WIDTHS[attribute];
        }
        assert_eq!(n_numbers, 7 + 3 * MOST, "all but centre and opacity");
    }
}
