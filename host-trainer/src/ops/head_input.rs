//! What a head sees of an anchor: its feature, the direction and the distance to it.

use super::{Pinhole, Real};
use crate::scene::ModelShape;

/// Writes the input rows `[feature F, direction 3, distance 1]` of some anchors, the last two if the shape has them.
///
/// direction = (x_a − c)/‖x_a − c‖ (zero at the camera itself), distance = ‖x_a − c‖ in normalised units
/// (Scaffold-GS, section 1.3 of the method notes: the raw distance).
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
        let mut ray = *position;
        for (r, c) in ray.iter_mut().zip(camera.centre_world) {
            *r -= c;
        }
        let distance = (ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2]).sqrt();
        let mut rest = tail;
        if shape.view_direction {
            let inverse = if distance > R::ZERO { R::ONE / distance } else { R::ZERO };
            let (direction, after) = rest.split_at_mut(3);
            for (d, r) in direction.iter_mut().zip(ray) {
                *d = r * inverse;
            }
            rest = after;
        }
        if let Some(last) = rest.first_mut() {
            *last = distance;
        }
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
