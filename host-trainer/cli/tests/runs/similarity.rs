//! How far found cameras are from true ones: what is left when the best similarity has laid one set on the other.

use glam::{DMat3, DQuat, DVec3};

/// A camera: its centre and its rotation, world to camera.
pub(crate) type Pose = (DVec3, DMat3);

/// What is left.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Offsets {
    /// Mean distance of the centres, in units of the largest distance of a true one from their mean.
    pub(crate) centre: f64,
    /// Mean angle between the rotations, degrees.
    pub(crate) degrees: f64,
}

/// What is left between found and true cameras in the same order.
///
/// The similarity is that of the least squares of the centres (Horn 1987, "Closed-form solution of absolute orientation using unit
/// quaternions").
pub(crate) fn offsets(found: &[Pose], truth: &[Pose]) -> Offsets {
    let n = found.len() as f64;
    let mean = |poses: &[Pose]| poses.iter().map(|(centre, _)| *centre).sum::<DVec3>() / n;
    let (from, to) = (mean(found), mean(truth));
    let pairs: Vec<(DVec3, DVec3)> = found.iter().zip(truth).map(|(a, b)| (a.0 - from, b.0 - to)).collect();
    let rotation = rotation_of(&pairs);
    let aligned: f64 = pairs.iter().map(|(a, b)| (rotation * *a).dot(*b)).sum();
    let scale = aligned / pairs.iter().map(|(a, _)| a.length_squared()).sum::<f64>();
    let size = pairs.iter().map(|(_, b)| b.length()).fold(0.0, f64::max);
    let off = pairs.iter().map(|(a, b)| (scale * (rotation * *a)).distance(*b)).sum::<f64>() / n;
    let angle = |(a, b): (&Pose, &Pose)| {
        // From the true world into the found one, and back by the true camera.
        let turn = a.1 * rotation.transpose() * b.1.transpose();
        ((turn.x_axis.x + turn.y_axis.y + turn.z_axis.z - 1.0) / 2.0).clamp(-1.0, 1.0).acos().to_degrees()
    };
    Offsets { centre: off / size, degrees: found.iter().zip(truth).map(angle).sum::<f64>() / n }
}

/// The rotation that lays the first of each pair on the second: the eigenvector of the largest eigenvalue of Horn's matrix, by squaring
/// it until nothing else is left.
fn rotation_of(pairs: &[(DVec3, DVec3)]) -> DMat3 {
    let mut s = [[0.0; 3]; 3];
    for (a, b) in pairs {
        for i in 0..3 {
            for j in 0..3 {
                s[i][j] += a[i] * b[j];
            }
        }
    }
    let n = [
        [s[0][0] + s[1][1] + s[2][2], s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0]],
        [s[1][2] - s[2][1], s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0], s[2][0] + s[0][2]],
        [s[2][0] - s[0][2], s[0][1] + s[1][0], s[1][1] - s[0][0] - s[2][2], s[1][2] + s[2][1]],
        [s[0][1] - s[1][0], s[2][0] + s[0][2], s[1][2] + s[2][1], s[2][2] - s[0][0] - s[1][1]],
    ];
    // Beyond all eigenvalues, so that the largest is that of the largest magnitude.
    let shift = n.iter().flatten().map(|value| value.abs()).sum::<f64>();
    let mut power: [[f64; 4]; 4] =
        std::array::from_fn(|i| std::array::from_fn(|j| n[i][j] + if i == j { shift } else { 0.0 }));
    for _ in 0..40 {
        let largest = power.iter().flatten().fold(0.0_f64, |most, value| most.max(value.abs()));
        let of = power.map(|row| row.map(|value| value / largest));
        power = std::array::from_fn(|i| std::array::from_fn(|j| (0..4).map(|k| of[i][k] * of[k][j]).sum()));
    }
    let column = power.iter().max_by(|a, b| norm(a).total_cmp(&norm(b))).expect("four rows");
    DMat3::from_quat(DQuat::from_xyzw(column[1], column[2], column[3], column[0]).normalize())
}

fn norm(row: &[f64; 4]) -> f64 {
    row.iter().map(|value| value * value).sum()
}

#[test]
fn a_similarity_leaves_nothing() {
    let truth: Vec<Pose> = (0..9)
        .map(|i| {
            let i = f64::from(i);
            let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.3 * i, 1.0 - 0.2 * i, 0.5);
            (DVec3::new(i.sin(), 2.0 * i.cos(), 0.3 * i), DMat3::from_quat(turn))
        })
        .collect();
    let turn = DMat3::from_quat(DQuat::from_euler(glam::EulerRot::XYZ, 2.0, -1.0, 0.7));
    let moved =
        |(centre, rotation): &Pose| (3.0 * (turn * *centre) + DVec3::new(5.0, 6.0, 7.0), *rotation * turn.transpose());
    let found: Vec<Pose> = truth.iter().map(moved).collect();
    let left = offsets(&found, &truth);
    assert!(left.centre < 1e-9 && left.degrees < 1e-3, "{left:?}");
    let off: Vec<Pose> = found.iter().map(|(centre, r)| (*centre, DMat3::from_rotation_z(0.1) * *r)).collect();
    assert!((offsets(&off, &truth).degrees - 0.1_f64.to_degrees()).abs() < 1e-3);
}
