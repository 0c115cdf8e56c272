//! From axes x right, y down, z forward to x right, y up, z back, and back: half a turn about x.

/// Signs of the harmonics beyond the first where y and z change theirs.
///
/// Of degree 1: y, z, x; of degree 2: xy, yz, 2z²−x²−y², xz, x²−y²; of degree 3: y(3x²−y²), xyz, y(4z²−x²−y²), z(2z²−3x²−3y²),
/// x(4z²−x²−y²), z(x²−y²), x(x²−3y²).
const HARMONIC_SIGNS: [f32; 15] = [-1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, -1.0, 1.0, -1.0, 1.0];

/// A centre, turned.
pub(crate) fn turn_centre([x, y, z]: [f32; 3]) -> [f32; 3] {
    [x, -y, -z]
}

/// A rotation (w, x, y, z) between turned axes: S·R·S with S = diag(1, −1, −1).
pub(crate) fn turn_rotation([w, x, y, z]: [f32; 4]) -> [f32; 4] {
    [w, x, -y, -z]
}

/// Coefficient `index` of a turned colour, 0 being the constant one.
pub(crate) fn turn_harmonic(index: usize, colour: [f32; 3]) -> [f32; 3] {
    if index == 0 { colour } else { colour.map(|channel| HARMONIC_SIGNS[index - 1] * channel) }
}

#[cfg(test)]
mod tests {
    use super::HARMONIC_SIGNS;

    #[test]
    fn signs_are_those_of_the_polynomials() {
        let basis = |[x, y, z]: [f32; 3]| {
            let (xx, yy, zz) = (x * x, y * y, z * z);
            [
                y,
                z,
                x,
                x * y,
                y * z,
                2.0 * zz - xx - yy,
                x * z,
                xx - yy,
                y * (3.0 * xx - yy),
                x * y * z,
                y * (4.0 * zz - xx - yy),
                z * (2.0 * zz - 3.0 * xx - 3.0 * yy),
                x * (4.0 * zz - xx - yy),
                z * (xx - yy),
                x * (xx - 3.0 * yy),
            ]
        };
        let (here, turned) = (basis([0.3, 0.5, 0.8]), basis([0.3, -0.5, -0.8]));
        for index in 0..15 {
            assert_eq!(turned[index], HARMONIC_SIGNS[index] * here[index], "harmonic {}", index + 1);
        }
    }
}
