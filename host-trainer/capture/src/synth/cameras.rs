//! Where the cameras of synthetic captures stand: spread over an upper hemisphere, all looking at the origin.

use std::f64::consts::TAU;

use glam::DVec3;

use super::texture::unit_hash;

/// Horizontal field of view, radians, as in Synthetic-NeRF.
pub(super) const CAMERA_ANGLE_X: f64 = 0.691_111_207;
/// Distance of the cameras from the origin, as in Synthetic-NeRF.
const RADIUS: f64 = 4.031;
/// Range of the sine of the cameras' elevation: nothing is seen edge-on, and no camera stands straight above, where
/// "up" has no direction.
const SIN_ELEVATION: (f64, f64) = (0.2, 0.97);

/// A camera by its centre and axes in the world, OpenGL convention: it looks along −`backward`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pose {
    pub(super) centre: DVec3,
    pub(super) right: DVec3,
    pub(super) up: DVec3,
    pub(super) backward: DVec3,
}

impl Pose {
    /// Stands at `centre`, looks at the origin, z is up.
    fn looking_at_origin(centre: DVec3) -> Self {
        let backward = centre.normalize();
        let right = DVec3::Z.cross(backward).normalize();
        Self { centre, right, up: backward.cross(right), backward }
    }

    /// The 4 × 4 matrix of the transforms files, by rows.
    pub(super) fn camera_to_world(&self) -> [[f64; 4]; 4] {
        let [r, u, b, c] = [self.right, self.up, self.backward, self.centre].map(|axis| axis.to_array());
        [0, 1, 2, 3].map(|i| if i < 3 { [r[i], u[i], b[i], c[i]] } else { [0.0, 0.0, 0.0, 1.0] })
    }
}

/// Cameras to train from.
pub(super) fn train(n: u32, seed: u64) -> Vec<Pose> {
    spiral(n, unit_hash(0, 0, 0, seed))
}

/// Cameras to test from: a spiral of their own, turned against the other.
pub(super) fn test(n: u32, seed: u64) -> Vec<Pose> {
    spiral(n, unit_hash(1, 0, 0, seed))
}

/// Even spread by area: heights in even steps, each camera turned by the golden ratio of a turn from the last.
fn spiral(n: u32, start_turns: f64) -> Vec<Pose> {
    let golden_turns = (5.0_f64.sqrt() - 1.0) / 2.0;
    let (lowest, highest) = SIN_ELEVATION;
    (0..n)
        .map(|i| {
            let sin_elevation = lowest + (highest - lowest) * (f64::from(i) + 0.5) / f64::from(n);
            let cos_elevation = (1.0 - sin_elevation * sin_elevation).sqrt();
            let (sin, cos) = (TAU * (start_turns + golden_turns * f64::from(i)).fract()).sin_cos();
            Pose::looking_at_origin(RADIUS * DVec3::new(cos_elevation * cos, cos_elevation * sin, sin_elevation))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_are_rotations_that_look_at_the_origin() {
        for pose in train(60, 1) {
            assert!((pose.right.cross(pose.up) - pose.backward).length() < 1e-12, "right-handed");
            assert!((pose.centre - RADIUS * pose.backward).length() < 1e-12, "looks at the origin");
            assert!(pose.up.z > 0.0 && pose.centre.z > 0.0, "upright, above the ground");
        }
    }

    #[test]
    fn train_cameras_keep_apart_and_test_cameras_are_others() {
        let train = train(60, 1);
        let nearest = |pose: &Pose, others: &[Pose]| {
            others.iter().map(|o| o.centre.distance(pose.centre)).filter(|&d| d > 0.0).fold(f64::MAX, f64::min)
        };
        // 60 cameras on 0.77·2π·4² of sphere have 1.3 square units each.
        assert!(train.iter().all(|pose| nearest(pose, &train) > 0.5), "spread");
        assert!(test(12, 1).iter().all(|pose| nearest(pose, &train) > 0.05), "others");
    }
}
