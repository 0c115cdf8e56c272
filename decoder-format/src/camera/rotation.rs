//! A rotation that was checked to be one.

use super::first_outside;
use crate::error::{DecodeError, Field, in_range};

/// Parts into which errors divide a unit.
const PARTS: f32 = 10_000.0;
/// [`Rotation::TOLERANCE`] in such parts.
pub(crate) const MOST_OFF: u32 = 300;

/// A rotation from the normalised frame to a camera's: its rows are the camera's right, down and forward.
///
/// The rows a, b, c have length 1 and each is the cross product of the two before it: c = a × b, a = b × c, b = c × a. The
/// decoder leaves out what a camera does not see, and for this it relies on it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Rotation([f32; 9]);

impl Rotation {
    /// No rotation: looks along z, with y down.
    pub const IDENTITY: Self = Self([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);

    /// How far a matrix of rows a, b, c may be from a rotation: | |a|² − 1 | + | |b|² − 1 | + | a·b | and the components of
    /// | a × b − c |, all added.
    ///
    /// It is for rounded numbers, and for sines and cosines that are wrong by 0.002. What an image may lose by it is the
    /// outermost rim of splats, of an alpha below 1/217.
    pub const TOLERANCE: f32 = MOST_OFF as f32 / PARTS;

    /// Checks that a matrix is a rotation.
    ///
    /// * `rows`: row-major.
    ///
    /// ```
    /// use pocketsplat_format::{DecodeError, Field, Rotation};
    ///
    /// assert!(Rotation::new([0.8, 0.6, 0.0, -0.6, 0.8, 0.0, 0.0, 0.0, 1.0]).is_ok());
    /// let mirrored = Rotation::new([-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    /// assert_eq!(mirrored, Err(DecodeError::OutOfRange { field: Field::CameraRotation, found: 20_000, limit: 300 }));
    /// ```
    ///
    /// # Errors
    /// [`DecodeError::BadFloat`] names the first number that is not finite; [`DecodeError::OutOfRange`] says how far a matrix
    /// is from a rotation, and [the limit](Self::TOLERANCE), in 10 000ths.
    pub fn new(rows: [f32; 9]) -> Result<Self, DecodeError> {
        if let Some(index) = first_outside(&rows, f32::MIN, f32::INFINITY) {
            return Err(DecodeError::BadFloat { field: Field::CameraPose, index });
        }
        let rotation = Self(rows);
        in_range(Field::CameraRotation, rotation.off(), 0, MOST_OFF)?;
        Ok(rotation)
    }

    /// Takes a matrix as it is, for cameras that shear or mirror on purpose: splats near the borders of tiles and of the image
    /// may then be missing.
    ///
    /// * `rows`: row-major. Numbers from 1000 on, and those that are none, are still refused when a frame is drawn.
    #[must_use]
    pub const fn new_unchecked(rows: [f32; 9]) -> Self {
        Self(rows)
    }

    /// The matrix, row-major.
    #[must_use]
    pub const fn to_array(self) -> [f32; 9] {
        self.0
    }

    /// The matrix, row-major.
    pub(super) fn numbers(&self) -> &[f32] {
        &self.0
    }

    /// Right, down and forward.
    pub fn rows(&self) -> [[f32; 3]; 3] {
        let [a0, a1, a2, b0, b1, b2, c0, c1, c2] = self.0;
        [[a0, a1, a2], [b0, b1, b2], [c0, c1, c2]]
    }

    /// How far finite numbers are from a rotation, as [`TOLERANCE`](Self::TOLERANCE) sums it up, in 10 000ths.
    pub(crate) fn off(&self) -> u32 {
        let [a0, a1, a2, b0, b1, b2, c0, c1, c2] = self.0;
        // If this is 0, then |c| = 1, b × c = a and c × a = b as well.
        let of_lengths = (a0 * a0 + a1 * a1 + a2 * a2 - 1.0).abs() + (b0 * b0 + b1 * b1 + b2 * b2 - 1.0).abs();
        let of_angle = (a0 * b0 + a1 * b1 + a2 * b2).abs();
        let of_product =
            (a1 * b2 - a2 * b1 - c0).abs() + (a2 * b0 - a0 * b2 - c1).abs() + (a0 * b1 - a1 * b0 - c2).abs();
        // Products beyond f32 are not a number, which would become 0.
        let parts = (of_lengths + of_angle + of_product) * PARTS;
        if parts < f32::MAX { parts as u32 } else { u32::MAX }
    }
}

#[cfg(test)]
mod tests {
    use super::Rotation;
    use crate::error::{DecodeError, ErrorClass, Field};

    const TURNED: [f32; 9] = [0.6, 0.0, 0.8, 0.48, 0.8, -0.36, -0.64, 0.6, 0.48];

    fn off(rows: [f32; 9]) -> Option<u32> {
        match Rotation::new(rows) {
            Ok(_) => None,
            Err(DecodeError::OutOfRange { field: Field::CameraRotation, found, limit: 300 }) => Some(found),
            Err(error) => panic!("another error: {error}"),
        }
    }

    #[test]
    fn rotations_pass_and_what_is_none_is_refused_by_how_far_it_is() {
        let [a0, a1, a2, b0, b1, b2, c0, c1, c2] = TURNED;
        assert_eq!((off(TURNED), off(Rotation::IDENTITY.to_array())), (None, None));
        assert_eq!(off([a0, b0, c0, a1, b1, c1, a2, b2, c2]), None, "the rotation back");
        let near = |rows, expected: u32, what: &str| {
            let found = off(rows).unwrap_or_default();
            assert!(found.abs_diff(expected) <= 2, "{what}: {found}, not {expected}");
        };
        near([0.0; 9], 20_000, "nothing: two lengths");
        near(TURNED.map(|x| -x), 34_400, "a mirror: 2 · (0.64 + 0.6 + 0.48)");
        near(TURNED.map(|x| 0.8 * x), 7200 + 2752, "too short: 2 · (1 − 0.8²) and (0.8 − 0.8²) · 1.72");
        near([a0, a1, a2, a0, a1, a2, c0, c1, c2], 10_000 + 17_200, "two rows alike: their product, and c");
        near([b0, b1, b2, a0, a1, a2, c0, c1, c2], 34_400, "rows out of order");
        near([a0, a1, a2, b0, b1, b2, c0, c1, c2 + 0.04], 400, "one number");
        assert_eq!(off([1e30; 9]), Some(u32::MAX), "products beyond f32");
    }

    #[test]
    fn the_tolerance_lets_approximate_sines_pass() {
        assert_eq!(Rotation::TOLERANCE, 0.03);
        let moved = |by: f32| off([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0 + by]);
        assert_eq!((moved(0.0299), moved(-0.0299)), (None, None));
        assert_eq!((moved(0.0302), moved(-0.0302)), (Some(302), Some(302)));
        // A camera turned about an axis by a sine and a cosine that are wrong by 0.002, as those of `micromath` are.
        let [a, b, c] = Rotation(TURNED).rows();
        for step in 0..64 {
            let (sin, cos) = (step as f32 / 10.0).sin_cos();
            for (sin, cos) in [(sin + 0.002, cos + 0.002), (sin - 0.002, cos + 0.002), (sin - 0.002, cos - 0.002)] {
                let [[a0, a1, a2], [b0, b1, b2], [c0, c1, c2]] =
                    [a, b, c].map(|[x, y, z]| [cos * x - sin * y, sin * x + cos * y, z]);
                assert_eq!(off([a0, a1, a2, b0, b1, b2, c0, c1, c2]), None, "step {step}");
            }
        }
    }

    #[test]
    fn numbers_that_are_none_are_named_and_the_unchecked_way_takes_everything() {
        for x in [f32::NAN, f32::INFINITY] {
            let mut rows = TURNED;
            rows[5] = x;
            let error = Rotation::new(rows).expect_err("no number");
            assert_eq!(error, DecodeError::BadFloat { field: Field::CameraPose, index: 5 });
            assert_eq!(error.class(), ErrorClass::Misuse);
        }
        assert_eq!(Rotation::new_unchecked([2.0; 9]).to_array(), [2.0; 9]);
    }
}
