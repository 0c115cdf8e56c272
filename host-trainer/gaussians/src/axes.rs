//! Axes of a .spz, and how Gaussians go from one frame to another whose axes point the other way.

use std::str::FromStr;

use crate::Gaussians;

/// What the axes of a .spz are, where its record of them is missing or not to be believed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpzAxes {
    /// x right, y up, z back, as the format's description has them; turned from and to those of a .ply.
    AsDescribed,
    /// Those of the .ply that the file was made of, as splat-transform 3, GaussForge, gsply and the reference's `ply_to_spz` write them.
    AsInPly,
}

impl SpzAxes {
    /// The names of all, for command lines.
    pub const NAMES: [&str; 2] = ["as-described", "as-in-ply"];

    /// The other one.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::AsDescribed => Self::AsInPly,
            Self::AsInPly => Self::AsDescribed,
        }
    }

    /// The name, for command lines.
    pub const fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }

    pub(crate) const fn signs(self) -> Signs {
        match self {
            Self::AsDescribed => Signs([1.0, -1.0, -1.0]),
            Self::AsInPly => Signs([1.0; 3]),
        }
    }
}

impl Gaussians {
    /// The same after half a turn about x, which is what [`SpzAxes`] differ by.
    #[must_use]
    pub fn turned(&self) -> Self {
        let signs = SpzAxes::AsDescribed.signs();
        let n = self.degree.n_coefficients();
        Self {
            centres: self.centres.iter().map(|&centre| signs.centre(centre)).collect(),
            rotations: self.rotations.iter().map(|&rotation| signs.rotation(rotation)).collect(),
            harmonics: self.harmonics.iter().enumerate().map(|(at, &colour)| signs.harmonic(at % n, colour)).collect(),
            ..self.clone()
        }
    }
}

impl FromStr for SpzAxes {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        [Self::AsDescribed, Self::AsInPly]
            .into_iter()
            .find(|axes| axes.name() == name)
            .ok_or_else(|| format!("needs {} or {}", Self::NAMES[0], Self::NAMES[1]))
    }
}

/// Factors of x, y and z, each 1 or −1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Signs(pub(crate) [f32; 3]);

/// Which of x, y and z have odd powers in the harmonics beyond the first.
///
/// Of degree 1: y, z, x; of degree 2: xy, yz, 2z²−x²−y², xz, x²−y²; of degree 3: y(3x²−y²), xyz, y(4z²−x²−y²), z(2z²−3x²−3y²),
/// x(4z²−x²−y²), z(x²−y²), x(x²−3y²).
const ODD: [&[usize]; 15] =
    [&[1], &[2], &[0], &[0, 1], &[1, 2], &[], &[0, 2], &[], &[1], &[0, 1, 2], &[1], &[2], &[0], &[2], &[0]];

impl Signs {
    /// A centre.
    pub(crate) fn centre(self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        let Self([sx, sy, sz]) = self;
        [sx * x, sy * y, sz * z]
    }

    /// A rotation (w, x, y, z): S·R·S with S the diagonal of the signs.
    pub(crate) fn rotation(self, [w, x, y, z]: [f32; 4]) -> [f32; 4] {
        let Self([sx, sy, sz]) = self;
        [w, sy * sz * x, sx * sz * y, sx * sy * z]
    }

    /// Coefficient `index` of a colour, 0 being the constant one.
    pub(crate) fn harmonic(self, index: usize, colour: [f32; 3]) -> [f32; 3] {
        let odd: &[usize] = if index == 0 { &[] } else { ODD[index - 1] };
        let sign: f32 = odd.iter().map(|&axis| self.0[axis]).product();
        colour.map(|channel| sign * channel)
    }
}

#[cfg(test)]
mod tests {
    use super::{Signs, SpzAxes};

    #[test]
    fn signs_are_those_of_the_polynomials() {
        let basis = |[x, y, z]: [f32; 3]| {
            let (xx, yy, zz) = (x * x, y * y, z * z);
            [
                1.0,
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
        for signs in [[1.0, -1.0, -1.0], [-1.0, 1.0, 1.0], [-1.0, -1.0, 1.0], [1.0; 3]].map(Signs) {
            let (here, there) = (basis([0.3, 0.5, 0.8]), basis(signs.centre([0.3, 0.5, 0.8])));
            for index in 0..16 {
                assert_eq!(signs.harmonic(index, [here[index]; 3])[0], there[index], "harmonic {index} by {signs:?}");
            }
        }
    }

    #[test]
    fn a_rotation_turns_with_its_points() {
        let turn = |[w, x, y, z]: [f32; 4], [a, b, c]: [f32; 3]| {
            let cross = |[px, py, pz]: [f32; 3], [qx, qy, qz]: [f32; 3]| {
                [py * qz - pz * qy, pz * qx - px * qz, px * qy - py * qx]
            };
            let t = cross([x, y, z], [a, b, c]).map(|part| 2.0 * part);
            let u = cross([x, y, z], t);
            [a + w * t[0] + u[0], b + w * t[1] + u[1], c + w * t[2] + u[2]]
        };
        let (q, p) = ([0.5, 0.1, -0.7, 0.5], [0.2, -0.4, 1.5]);
        // Turns alone: a mirror turns the other way round, which S·R·S is.
        for signs in [[1.0, -1.0, -1.0], [-1.0, 1.0, 1.0], [-1.0, -1.0, 1.0]].map(Signs) {
            let (a, b) = (signs.centre(turn(q, p)), turn(signs.rotation(q), signs.centre(p)));
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6), "{signs:?}: {a:?}, {b:?}");
        }
    }

    #[test]
    fn names_are_read() {
        for axes in [SpzAxes::AsDescribed, SpzAxes::AsInPly] {
            assert_eq!(axes.name().parse(), Ok(axes));
            assert_ne!(axes, axes.other());
        }
        assert!("up".parse::<SpzAxes>().is_err());
    }
}
