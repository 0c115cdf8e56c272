//! Numbers of files that no renderer can draw as they stand, but that mean something; and those that mean nothing.

use crate::check::{MAX_LOG_SCALE, has_length};
use crate::{Gaussians, Unreadable};

/// The logit that stands for an opacity of 1: in 32 bits its opacity is 1.
const OPAQUE: f32 = 20.0;

/// How much less than the smaller one of its other deviations the ln of a deviation of 0 becomes: about a thousandth.
const FLAT: f32 = 7.0;

impl Gaussians {
    /// What Gaussians of a file mean, and a sentence for each kind of number that does not stand so in the file.
    ///
    /// A logit of +∞ is an opacity of 1, the ln of a deviation of −∞ a flat disk, a rotation of 0 none. Gaussians that cannot be drawn
    /// are left out.
    ///
    /// # Errors
    /// [`Unreadable`] where that is most of them.
    pub(crate) fn meant(mut self) -> Result<(Self, Vec<String>), Unreadable> {
        let n = self.len();
        let (mut n_opaque, mut n_flat, mut n_unturned) = (0, 0, 0);
        for logit in self.opacity_logits.iter_mut().filter(|logit| **logit == f32::INFINITY) {
            *logit = OPAQUE;
            n_opaque += 1;
        }
        for scales in &mut self.log_scales {
            let is_zero = |scale: &f32| *scale < -MAX_LOG_SCALE;
            let others = scales.iter().copied().filter(|scale| !is_zero(scale));
            // One of no extent at all stays as it is, and is left out.
            if let Some(least) = others.min_by(f32::total_cmp).filter(|_| scales.iter().any(is_zero)) {
                *scales = scales.map(|scale| if is_zero(&scale) { (least - FLAT).max(-MAX_LOG_SCALE) } else { scale });
                n_flat += 1;
            }
        }
        for rotation in &mut self.rotations {
            if rotation.iter().all(|part| part.is_finite()) && !has_length(rotation) {
                *rotation = [1.0, 0.0, 0.0, 0.0];
                n_unturned += 1;
            }
        }
        let mut said = Vec::new();
        let mut say = |count: usize, what: &str| {
            if count > 0 {
                said.push(format!("{count} of {n} {what}"));
            }
        };
        say(n_opaque, "opacities have the logit +inf, which is an opacity of 1: they are drawn opaque");
        say(n_flat, "Gaussians have a deviation of 0, as flat disks do: it is drawn as a thousandth of the others");
        say(n_unturned, "rotations are 0: they are taken for none");
        let faults: Vec<usize> = (0..n).filter(|&index| self.fault(index).is_some()).collect();
        let Some((first, fault)) = faults.first().and_then(|&first| Some((first, self.fault(first)?))) else {
            return Ok((self, said));
        };
        if 2 * faults.len() > n {
            return Err(Unreadable::new(format!(
                "cannot be drawn: {} of its {n} Gaussians hold numbers that mean nothing ({}); it is damaged, or its training diverged: \
                 write it again with the program that made it",
                faults.len(),
                fault.of(first)
            )));
        }
        say(faults.len(), &format!("Gaussians are left out, as they cannot be drawn: {}", fault.of(first)));
        let mut faults = faults.into_iter().peekable();
        let kept: Vec<usize> = (0..n).filter(|&index| faults.next_if_eq(&index).is_none()).collect();
        Ok((self.chosen(&kept), said))
    }

    /// The Gaussians of these indices, in their order.
    ///
    /// # Panics
    /// If an index is not below N.
    #[must_use]
    pub fn chosen(&self, indices: &[usize]) -> Self {
        fn pick<T: Copy>(values: &[T], indices: &[usize]) -> Vec<T> {
            indices.iter().map(|&index| values[index]).collect()
        }
        Self {
            degree: self.degree,
            centres: pick(&self.centres, indices),
            log_scales: pick(&self.log_scales, indices),
            rotations: pick(&self.rotations, indices),
            opacity_logits: pick(&self.opacity_logits, indices),
            harmonics: indices.iter().flat_map(|&index| self.harmonics_of(index)).copied().collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::tests::of_degree;
    use crate::{Degree, Gaussians};

    fn changed(change: impl Fn(&mut Gaussians)) -> Gaussians {
        let mut gaussians = of_degree(Degree::One, 10);
        change(&mut gaussians);
        gaussians
    }

    #[test]
    fn infinite_numbers_that_mean_something_are_read_so() {
        let (meant, said) = changed(|g| {
            g.opacity_logits[3] = f32::INFINITY;
            g.log_scales[4] = [-2.0, f32::NEG_INFINITY, -3.0];
            g.log_scales[5] = [f32::NEG_INFINITY, -200.0, -1.0];
            g.rotations[6] = [0.0, -0.0, 1e-40, 0.0];
        })
        .meant()
        .expect("all mean something");
        assert_eq!(meant.check(), Ok(()));
        assert_eq!(meant.opacity_logits[3], 20.0);
        assert_eq!((meant.log_scales[4], meant.log_scales[5]), ([-2.0, -10.0, -3.0], [-8.0, -8.0, -1.0]));
        assert_eq!(meant.rotations[6], [1.0, 0.0, 0.0, 0.0]);
        assert_eq!(said.len(), 3);
        assert!(said[0].starts_with("1 of 10 opacities") && said[1].starts_with("2 of 10 Gaussians"), "{said:?}");
        let (same, said) = of_degree(Degree::Two, 3).meant().expect("whole");
        assert_eq!((same, said.len()), (of_degree(Degree::Two, 3), 0));
    }

    #[test]
    fn what_means_nothing_is_left_out_and_most_of_a_file_is_not() {
        let broken = |n: usize| {
            changed(move |g| {
                g.centres[1][0] = f32::INFINITY;
                g.opacity_logits[2] = f32::NEG_INFINITY;
                g.log_scales[3] = [f32::NEG_INFINITY; 3];
                g.harmonics[4 * 4 + 2][1] = f32::NAN;
                for index in 5..n {
                    g.log_scales[index][0] = f32::INFINITY;
                }
            })
        };
        let (left, said) = broken(6).meant().expect("half is left");
        assert_eq!(left, of_degree(Degree::One, 10).chosen(&[0, 6, 7, 8, 9]));
        assert_eq!(said.len(), 1);
        assert!(said[0].starts_with("5 of 10 Gaussians are left out"), "{said:?}");
        assert!(said[0].ends_with("x of Gaussian 1 is inf, which has to be a finite number"), "{said:?}");
        let error = broken(7).meant().expect_err("most").to_string();
        assert!(error.starts_with("cannot be drawn: 6 of its 10 Gaussians"), "{error}");
    }
}
