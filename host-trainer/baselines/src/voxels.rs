//! Places on a lattice of 2^[`DEPTH`] voxels a side, numbered along Morton's curve.

use crate::octree::DEPTH;

/// Where the lattice lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lattice {
    /// Its lowest corner, normalised frame.
    pub(crate) corner: [f32; 3],
    /// Side of a voxel, normalised units.
    pub(crate) voxel: f32,
}

impl Lattice {
    /// The smallest cube around `places`.
    #[expect(clippy::cast_possible_truncation, reason = "files keep the lattice in single precision")]
    pub(crate) fn around(places: &[[f32; 3]]) -> Self {
        let least = |axis: usize| places.iter().fold(f32::INFINITY, |least, place| least.min(place[axis]));
        let most = |axis: usize| places.iter().fold(f32::NEG_INFINITY, |most, place| most.max(place[axis]));
        if places.is_empty() {
            return Self { corner: [0.0; 3], voxel: 1.0 };
        }
        let side = [0, 1, 2].map(|axis| f64::from(most(axis)) - f64::from(least(axis))).into_iter().fold(0.0, f64::max);
        // Not 0, by which places would be divided.
        let voxel = ((side / f64::from(1 << DEPTH)) as f32).max(f32::MIN_POSITIVE);
        Self { corner: [0, 1, 2].map(least), voxel }
    }

    /// The voxel of a place.
    pub(crate) fn voxel_of(&self, place: [f32; 3]) -> u64 {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast saturates, and is bounded")]
        let along = |axis: usize| {
            let steps = (f64::from(place[axis]) - f64::from(self.corner[axis])) / f64::from(self.voxel);
            (steps as u64).min((1 << DEPTH) - 1)
        };
        morton([0, 1, 2].map(along))
    }

    /// The middle of a voxel, computed in f64 and rounded once.
    #[expect(clippy::cast_possible_truncation, reason = "the one rounding")]
    pub(crate) fn middle_of(&self, code: u64) -> [f32; 3] {
        let place = unwound(code);
        [0, 1, 2].map(|axis: usize| {
            let steps = place[axis] as f64 + 0.5;
            (f64::from(self.corner[axis]) + steps * f64::from(self.voxel)) as f32
        })
    }
}

/// The places' indices along Morton's curve; those in one voxel in their order.
pub(crate) fn along_the_curve(places: &[[f32; 3]]) -> Vec<usize> {
    let lattice = Lattice::around(places);
    let mut order: Vec<usize> = (0..places.len()).collect();
    order.sort_by_cached_key(|i| lattice.voxel_of(places[*i]));
    order
}

/// The bits of three numbers in turn, x lowest: places of neighbours in a file are neighbours in space (Morton 1966).
pub(crate) fn morton(place: [u64; 3]) -> u64 {
    let bit = |i: u32, axis: u32| (place[axis as usize] >> i & 1) << (3 * i + axis);
    (0..DEPTH).map(|i| bit(i, 0) | bit(i, 1) | bit(i, 2)).sum()
}

/// The reverse of [`morton`].
fn unwound(code: u64) -> [u64; 3] {
    [0, 1, 2].map(|axis| (0..DEPTH).map(|i| (code >> (3 * i + axis) & 1) << i).sum())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_place_moves_by_half_a_voxel_at_most_and_then_stays(
            places in prop::collection::vec(prop::array::uniform3(-40f32..40.0), 1..30)
        ) {
            let lattice = Lattice::around(&places);
            for place in places {
                let code = lattice.voxel_of(place);
                let middle = lattice.middle_of(code);
                // And by the rounding of single precision.
                let most = f64::from(lattice.voxel) * 0.5 + 40.0 * f64::from(f32::EPSILON) * 4.0;
                let moved = (0..3).map(|i| (f64::from(middle[i]) - f64::from(place[i])).abs()).fold(0.0, f64::max);
                prop_assert!(moved <= most, "{moved}, at most {most}");
            }
        }

        #[test]
        fn codes_come_back(code in 0..1u64 << (3 * DEPTH)) {
            prop_assert_eq!(morton(unwound(code)), code);
        }
    }

    #[test]
    fn places_that_coincide_have_a_lattice() {
        let place = [1.0, -2.0, 3.0];
        let lattice = Lattice::around(&[place; 2]);
        assert_eq!(lattice.middle_of(lattice.voxel_of(place)), place);
        assert_eq!(Lattice::around(&[]).voxel, 1.0);
        assert_eq!(morton([1, 0, 1]), 0b101);
        assert_eq!(along_the_curve(&[[9.0, 9.0, 0.0], [0.0; 3], [9.0, 0.0, 0.0], [0.0; 3]]), [1, 3, 2, 0]);
    }
}
