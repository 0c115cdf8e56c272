//! Rotations as quaternions, of which q, −q and any multiple turn the same way.

/// The quaternion of length 1 and with w ≥ 0 that turns the same way.
pub(crate) fn upright(rotation: &[f32; 4]) -> [f32; 4] {
    let length = rotation.iter().map(|q| q * q).sum::<f32>().sqrt();
    let factor = if rotation[0] < 0.0 { -1.0 } else { 1.0 } / length.max(f32::MIN_POSITIVE);
    if length > 0.0 { rotation.map(|q| q * factor) } else { *rotation }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_of_either_sign_are_one() {
        assert_eq!(upright(&[-2.0, 0.0, 0.0, 0.0]), [1.0, -0.0, -0.0, -0.0]);
        assert_eq!(upright(&[0.0; 4]), [0.0; 4]);
    }
}
