//! Whether Gaussians can be drawn: every number finite, every shape one.

use crate::{Gaussians, Unreadable};

/// Largest |ln| of a deviation: e⁸⁰ and e⁻⁸⁰ are numbers in 32 bits, and so are their products with anything a scene has.
pub(crate) const MAX_LOG_SCALE: f32 = 80.0;

/// A number that no renderer can draw.
pub(crate) struct Fault {
    /// As a .ply calls it.
    property: String,
    value: f32,
    needed: &'static str,
}

impl Fault {
    /// With the Gaussian `index` whose it is.
    pub(crate) fn of(&self, index: usize) -> String {
        format!("{} of Gaussian {index} is {}, which has to be {}", self.property, self.value, self.needed)
    }
}

impl Gaussians {
    /// Refuses what no renderer can draw: numbers that are not finite, deviations beyond 32 bits, rotations of length 0.
    ///
    /// # Errors
    /// [`Unreadable`] names the first such Gaussian and its property.
    pub fn check(&self) -> Result<(), Unreadable> {
        match (0..self.len()).find_map(|index| Some((index, self.fault(index)?))) {
            Some((index, fault)) => Err(Unreadable::new(format!("cannot be drawn: {}", fault.of(index)))),
            None => Ok(()),
        }
    }

    /// What is wrong with Gaussian `index`.
    pub(crate) fn fault(&self, index: usize) -> Option<Fault> {
        let fault = |property: &str, value: f32, needed| Some(Fault { property: property.to_owned(), value, needed });
        let finite = |values: &[f32]| values.iter().position(|value| !value.is_finite());
        if let Some(axis) = finite(&self.centres[index]) {
            return fault(["x", "y", "z"][axis], self.centres[index][axis], "a finite number");
        }
        let scales = &self.log_scales[index];
        if let Some(axis) = scales.iter().position(|value| !(value.abs() <= MAX_LOG_SCALE)) {
            return fault(&format!("scale_{axis}"), scales[axis], "a logarithm from −80 to 80");
        }
        let rotation = &self.rotations[index];
        if let Some(part) = finite(rotation) {
            return fault(&format!("rot_{part}"), rotation[part], "a finite number");
        }
        if !has_length(rotation) {
            return fault("the length of rot_0 to rot_3", 0.0, "above 0");
        }
        if !self.opacity_logits[index].is_finite() {
            return fault("opacity", self.opacity_logits[index], "a finite number (the file keeps its logit)");
        }
        self.harmonics_of(index).iter().enumerate().find_map(|(coefficient, colour)| {
            let channel = finite(colour)?;
            let name = if coefficient == 0 {
                format!("f_dc_{channel}")
            } else {
                format!("f_rest_{}", channel * (self.degree.n_coefficients() - 1) + coefficient - 1)
            };
            fault(&name, colour[channel], "a finite number")
        })
    }
}

/// Whether a quaternion can be brought to length 1.
pub(crate) fn has_length(rotation: &[f32; 4]) -> bool {
    let length = rotation.iter().map(|part| f64::from(*part).powi(2)).sum::<f64>().sqrt();
    length >= f64::from(f32::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use crate::tests::example;

    #[test]
    fn the_first_fault_is_named() {
        assert_eq!(example().check(), Ok(()));
        let found = |change: fn(&mut crate::Gaussians)| {
            let mut gaussians = example();
            change(&mut gaussians);
            gaussians.check().expect_err("broken").to_string()
        };
        assert!(found(|g| g.centres[1][2] = f32::NAN).starts_with("cannot be drawn: z of Gaussian 1 is NaN"));
        assert!(
            found(|g| g.log_scales[0][1] = 90.0).contains("scale_1 of Gaussian 0 is 90, which has to be a logarithm")
        );
        assert!(found(|g| g.rotations[2] = [0.0; 4]).contains("the length of rot_0 to rot_3 of Gaussian 2 is 0"));
        assert!(found(|g| g.opacity_logits[0] = f32::INFINITY).contains("opacity of Gaussian 0 is inf"));
        assert!(found(|g| g.harmonics[16][1] = f32::NAN).contains("f_dc_1 of Gaussian 1"));
        // Channel-major: the second channel's 15 begin at 15.
        assert!(found(|g| g.harmonics[17][1] = f32::NAN).contains("f_rest_15 of Gaussian 1"));
    }
}
