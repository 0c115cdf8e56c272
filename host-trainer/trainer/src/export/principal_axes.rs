//! Deviations and rotation of a Gaussian from its covariance.

use glam::{DMat3, DQuat};

/// Sweeps of Jacobi's method; three dimensions take about five.
const SWEEPS: usize = 12;

/// Variances along the principal axes, and the rotation (w, x, y, z) whose columns they are.
///
/// Jacobi's method: planes are turned until what is beside the diagonal vanishes (Golub and Van Loan 2013, section 8.5).
pub(super) fn principal_axes(covariance: DMat3) -> ([f64; 3], [f64; 4]) {
    let (mut a, mut axes) = (covariance, DMat3::IDENTITY);
    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let (app, aqq, apq) = (a.col(p)[p], a.col(q)[q], a.col(q)[p]);
            if apq == 0.0 {
                continue;
            }
            let theta = (aqq - app) / (2.0 * apq);
            let tangent = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let cos = 1.0 / (tangent * tangent + 1.0).sqrt();
            let sin = tangent * cos;
            let mut turn = DMat3::IDENTITY;
            turn.col_mut(p)[p] = cos;
            turn.col_mut(q)[q] = cos;
            turn.col_mut(q)[p] = sin;
            turn.col_mut(p)[q] = -sin;
            a = turn.transpose() * a * turn;
            axes *= turn;
        }
    }
    let rotation = DQuat::from_mat3(&axes).normalize();
    ([0, 1, 2].map(|i| a.col(i)[i].max(0.0)), [rotation.w, rotation.x, rotation.y, rotation.z])
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DQuat, DVec3};

    use super::principal_axes;

    #[test]
    fn variances_and_axes_make_the_covariance_again() {
        for (turn, variances) in [
            (DQuat::from_xyzw(0.1, 0.5, -0.3, 0.8), DVec3::new(4.0, 1.0, 0.01)),
            (DQuat::from_xyzw(0.7, 0.0, 0.0, 0.7), DVec3::new(1.0, 1.0, 1e-8)),
            (DQuat::IDENTITY, DVec3::ZERO),
        ] {
            let axes = DMat3::from_quat(turn.normalize());
            let covariance = axes * DMat3::from_diagonal(variances) * axes.transpose();
            let (found, [w, x, y, z]) = principal_axes(covariance);
            let axes = DMat3::from_quat(DQuat::from_xyzw(x, y, z, w));
            let again = axes * DMat3::from_diagonal(found.into()) * axes.transpose();
            assert!((again - covariance).abs_diff_eq(DMat3::ZERO, 1e-9), "{again:?} for {covariance:?}");
        }
    }
}
