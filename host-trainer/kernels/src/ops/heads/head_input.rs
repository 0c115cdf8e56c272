//! What a head sees of an anchor: its feature, the direction and the distance to it.

use crate::ops::Pinhole;
use crate::real::Real;
use crate::scene::ModelShape;

/// The direction (x_a − c)/‖x_a − c‖ to an anchor, zero at the camera itself, and the distance ‖x_a − c‖ in normalised units.
///
/// * `position`: world frame.
pub fn seen_from<R: Real>(camera: &Pinhole<R>, position: [R; 3]) -> ([R; 3], R) {
    let mut ray = position;
    for (r, c) in ray.iter_mut().zip(camera.centre_world) {
        *r -= c;
    }
    let distance = (ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2]).sqrt();
    let inverse = if distance > R::ZERO { R::ONE / distance } else { R::ZERO };
    (ray.map(|r| r * inverse), distance)
}

/// Writes the input rows `[feature F, distance 1, direction 3]` of some anchors, the last two if a head sees them; one that sees less
/// reads the first of a row.
///
/// Both are those of [`seen_from`] (Lu et al. 2024, Scaffold-GS, section 3.2.1).
///
/// * `features`: `[n, F]`. * `positions`: `[n]`, world frame. * `out`: `[n, shape.head_inputs()]`, overwritten.
pub fn forward<R: Real>(shape: &ModelShape, camera: &Pinhole<R>, features: &[R], positions: &[[R; 3]], out: &mut [R]) {
    let n_in = shape.head_inputs();
    debug_assert_eq!(out.len(), positions.len() * n_in);
    for ((row, feature), position) in
        out.chunks_exact_mut(n_in).zip(features.chunks_exact(shape.feature_dim)).zip(positions)
    {
        let (head, tail) = row.split_at_mut(shape.feature_dim);
        head.copy_from_slice(feature);
        let (direction, distance) = seen_from(camera, *position);
        let (of_distance, of_direction) = tail.split_at_mut(shape.view_distance.into());
        of_distance.fill(distance);
        of_direction.copy_from_slice(&direction[..of_direction.len()]);
    }
}

/// Takes the gradient of the input rows back to the features; anchors do not move, so direction and distance have none.
///
/// * `d_input`: `[n, head_inputs]`. * `d_features`: `[n, F]`, overwritten.
pub fn backward<R: Real>(shape: &ModelShape, d_input: &[R], d_features: &mut [R]) {
    for (row, out) in d_input.chunks_exact(shape.head_inputs()).zip(d_features.chunks_exact_mut(shape.feature_dim)) {
        out.copy_from_slice(&row[..shape.feature_dim]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::finite_difference::{assert_gradient, random};
    use glam::{DMat3, DVec3};
    use pocketsplat_capture::camera::Camera;

    fn camera() -> Pinhole<f64> {
        Pinhole::new(&Camera {
            rotation: DMat3::from_rotation_x(0.3),
            translation: DVec3::new(0.1, 0.2, 3.0),
            focal_px: [50.0; 2],
            principal_px: [16.0; 2],
            width_px: 32,
            height_px: 32,
        })
    }

    fn shape(view_colour: bool, view_distance: bool) -> ModelShape {
        ModelShape { view_colour, view_distance, ..ModelShape::plain(3, 1) }
    }

    #[test]
    fn a_row_is_feature_then_distance_then_direction() {
        let camera = camera();
        let mut position = camera.centre_world;
        position[1] -= 2.0;
        let mut row = [9.0; 7];
        forward(&shape(true, true), &camera, &[1.0, 2.0, 3.0], &[position], &mut row);
        for (found, expected) in row.iter().zip([1.0, 2.0, 3.0, 2.0, 0.0, -1.0, 0.0]) {
            assert!((found - expected).abs() < 1e-12, "{row:?}");
        }
        forward(&shape(true, true), &camera, &[1.0, 2.0, 3.0], &[camera.centre_world], &mut row);
        assert_eq!(row[3..], [0.0; 4], "at the camera itself there is no direction");
    }

    #[test]
    fn backward_agrees_with_finite_differences() {
        let positions = [[0.3, -0.2, 0.9], [1.0, 0.0, 0.1]];
        for (sees_direction, view_distance) in [(false, false), (true, false), (false, true), (true, true)] {
            let shape = shape(sees_direction, view_distance);
            let features = random(1, 6);
            let weights = random(2, 2 * shape.head_inputs());
            let mut d_features = vec![9.0; 6];
            backward(&shape, &weights, &mut d_features);
            assert_gradient("head input", &features, &d_features, |features| {
                let mut rows = vec![0.0; weights.len()];
                forward(&shape, &camera(), features, &positions, &mut rows);
                rows.iter().zip(&weights).map(|(r, w)| r * w).sum()
            });
        }
    }
}
