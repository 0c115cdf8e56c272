//! The spherical harmonics nearest to colours seen from some directions.

use pocketsplat_gaussians::Degree;

use pocketsplat_kernels::ops::image::spherical_harmonics::{MOST, basis};

/// What pulls coefficients beyond the constant one to 0, as a share of the sum of the weights: directions that no camera looked from
/// have no say, and a colour must not run away there.
const RIDGE: f64 = 1e-3;

/// Normal equations of one Gaussian: Σ w·Y·Yᵀ, the lower triangle row after row, and Σ w·Y·(c − ½).
#[derive(Clone)]
pub(super) struct Equations {
    matrix: [f32; MOST * (MOST + 1) / 2],
    right: [[f32; 3]; MOST],
    weight: f32,
}

impl Default for Equations {
    fn default() -> Self {
        Self { matrix: [0.0; MOST * (MOST + 1) / 2], right: [[0.0; 3]; MOST], weight: 0.0 }
    }
}

impl Equations {
    /// Adds a colour.
    ///
    /// * `direction`: unit vector from the camera to the centre.
    pub(super) fn add(&mut self, degree: Degree, direction: [f32; 3], colour: [f32; 3], weight: f32) {
        let functions = basis(degree, direction);
        let mut entries = self.matrix.iter_mut();
        for (row, value) in functions[..degree.n_coefficients()].iter().enumerate() {
            // In this order: zip asks its first part first, and must not take an entry beyond the row.
            for (other, entry) in functions[..=row].iter().zip(entries.by_ref()) {
                *entry += weight * value * other;
            }
            for (sum, channel) in self.right[row].iter_mut().zip(colour) {
                *sum += weight * value * (channel - 0.5);
            }
        }
        self.weight += weight;
    }

    /// The coefficients of `degree`, by Cholesky's decomposition.
    pub(super) fn solve(&self, degree: Degree) -> Vec<[f32; 3]> {
        let n = degree.n_coefficients();
        let mut lower = [[0.0f64; MOST]; MOST];
        for row in 0..n {
            for column in 0..=row {
                let ridge = match (row == column, row) {
                    (false, _) => 0.0,
                    // A Gaussian that was seen has a constant colour.
                    (true, 0) => 1e-12,
                    (true, _) => RIDGE,
                };
                let entry = f64::from(self.matrix[row * (row + 1) / 2 + column]) + ridge * f64::from(self.weight);
                let sum = (0..column).fold(entry, |sum, k| sum - lower[row][k] * lower[column][k]);
                lower[row][column] = if row == column {
                    // Rounding of the sums may leave a pivot below what the ridge alone gives.
                    sum.max(ridge * f64::from(self.weight)).max(f64::MIN_POSITIVE).sqrt()
                } else {
                    sum / lower[column][column]
                };
            }
        }
        let mut solution = vec![[0.0f32; 3]; n];
        for channel in 0..3 {
            let mut x = [0.0f64; MOST];
            for row in 0..n {
                let sum = (0..row).fold(f64::from(self.right[row][channel]), |sum, k| sum - lower[row][k] * x[k]);
                x[row] = sum / lower[row][row];
            }
            for row in (0..n).rev() {
                let sum = (row + 1..n).fold(x[row], |sum, k| sum - lower[k][row] * x[k]);
                x[row] = sum / lower[row][row];
                solution[row][channel] = x[row] as f32;
            }
        }
        solution
    }
}

#[cfg(test)]
mod tests {
    use pocketsplat_gaussians::Degree;

    use super::Equations;
    use pocketsplat_kernels::ops::image::spherical_harmonics::forward;

    fn directions() -> impl Iterator<Item = [f32; 3]> {
        (0..200).map(|i| {
            let z = -0.995 + 0.01 * i as f32;
            let (sin, cos) = (2.4 * i as f32).sin_cos();
            let r = (1.0 - z * z).sqrt();
            [r * cos, r * sin, z]
        })
    }

    #[test]
    fn colours_of_a_degree_are_found_again() {
        for degree in Degree::ALL {
            let wave = |i: usize, c: usize| 0.05 * (1.0 + (3 * i + c) as f32).sin();
            let wanted: Vec<[f32; 3]> = (0..degree.n_coefficients()).map(|i| [0, 1, 2].map(|c| wave(i, c))).collect();
            let mut equations = Equations::default();
            for direction in directions() {
                equations.add(degree, direction, forward(degree, direction, &wanted), 2.0);
            }
            for (found, wanted) in equations.solve(degree).as_flattened().iter().zip(wanted.as_flattened()) {
                assert!((found - wanted).abs() < 0.02 * wanted.abs() + 1e-4, "{found} for {wanted}");
            }
        }
    }

    #[test]
    fn one_look_gives_a_colour_that_stays_bounded() {
        let mut equations = Equations::default();
        equations.add(Degree::Three, [0.0, 0.6, 0.8], [0.9, 0.5, 0.1], 1e-4);
        let harmonics = equations.solve(Degree::Three);
        let seen = forward(Degree::Three, [0.0, 0.6, 0.8], &harmonics);
        assert!(seen.iter().zip([0.9, 0.5, 0.1]).all(|(found, wanted)| (found - wanted).abs() < 0.01), "{seen:?}");
        for direction in directions() {
            let colour = forward(Degree::Three, direction, &harmonics);
            assert!(colour.iter().all(|channel| (-0.1..=1.1).contains(channel)), "{colour:?}");
        }
    }
}
