//! Which axis of the splats' frame points up.

use std::fmt;
use std::str::FromStr;

use glam::{DMat3, DVec3};
use pocketsplat_capture::camera::Camera;

/// A coordinate axis, either way round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Up {
    axis: usize,
    negative: bool,
}

const NAMES: [&str; 3] = ["x", "y", "z"];

impl Up {
    /// Up where y points down, as in COLMAP's frames and those of most programs that train splats.
    pub const MINUS_Y: Self = Self { axis: 1, negative: true };
    /// Up in Blender's frames.
    pub const PLUS_Z: Self = Self { axis: 2, negative: false };
    /// All six.
    pub const NAMES: [&str; 6] = ["+x", "-x", "+y", "-y", "+z", "-z"];

    /// The unit vector.
    pub fn vector(self) -> DVec3 {
        DVec3::AXES[self.axis] * if self.negative { -1.0 } else { 1.0 }
    }

    /// The axis nearest to the mean of the cameras' own up; `None` without cameras.
    pub fn of_cameras<'a>(cameras: impl Iterator<Item = &'a Camera>) -> Option<Self> {
        let sum: DVec3 = cameras.map(|camera| -camera.rotation.row(1)).sum();
        let axis = [0, 1, 2].into_iter().max_by(|a: &usize, b: &usize| sum[*a].abs().total_cmp(&sum[*b].abs()))?;
        (sum.length() > 0.0).then_some(Self { axis, negative: sum[axis] < 0.0 })
    }

    /// What a file's comment on its vertical axis says: `y` alone is COLMAP's, which points down, other axes point up, and a sign decides.
    pub fn of_comment(axis: &str) -> Option<Self> {
        match axis.trim() {
            "y" | "Y" => Some(Self::MINUS_Y),
            other => other.parse().ok(),
        }
    }

    /// How a comment says it, so that [`Self::of_comment`] reads it again.
    pub fn comment(self) -> String {
        let sign = match (self.axis, self.negative) {
            (1, false) => "+",
            (0 | 2, true) => "-",
            _ => "",
        };
        format!("{sign}{}", NAMES[self.axis])
    }

    /// Columns: right, front and up of someone who stands upright.
    pub(super) fn upright(self) -> DMat3 {
        let up = self.vector();
        let front = DVec3::AXES[(self.axis + 1) % 3];
        DMat3::from_cols(front.cross(up), front, up)
    }
}

impl fmt::Display for Up {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", if self.negative { "-" } else { "+" }, NAMES[self.axis])
    }
}

impl FromStr for Up {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (negative, name) = match text.strip_prefix('-') {
            Some(name) => (true, name),
            None => (false, text.strip_prefix('+').unwrap_or(text)),
        };
        let axis = NAMES.iter().position(|known| known.eq_ignore_ascii_case(name));
        axis.map(|axis| Self { axis, negative })
            .ok_or_else(|| format!("`{text}` is no axis; choose one of {}", Self::NAMES.join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_they_are_written() {
        for name in Up::NAMES {
            let up: Up = name.parse().unwrap();
            assert_eq!((up.to_string().as_str(), Up::of_comment(&up.comment())), (name, Some(up)));
            let upright = up.upright();
            assert!((upright.determinant() - 1.0).abs() < 1e-12 && upright.z_axis == up.vector(), "{name}");
        }
        assert_eq!("Z".parse(), Ok(Up::PLUS_Z));
        assert!("down".parse::<Up>().unwrap_err().contains("+x, -x"));
        assert_eq!((Up::of_comment(" y "), Up::of_comment("north")), (Some(Up::MINUS_Y), None));
    }

    #[test]
    fn cameras_say_what_is_up_by_how_they_are_held() {
        let lens = Camera {
            rotation: DMat3::IDENTITY,
            translation: DVec3::ZERO,
            focal_px: [50.0; 2],
            principal_px: [8.0; 2],
            width_px: 16,
            height_px: 16,
        };
        assert_eq!(Up::of_cameras([&lens].into_iter()), Some(Up::MINUS_Y));
        let around: Vec<Camera> = (0..12)
            .map(|i| {
                let (sin, cos) = f64::from(i).sin_cos();
                lens.looking_at(DVec3::new(3.0 * cos, 3.0 * sin, 2.0), DVec3::ZERO, DVec3::Z)
            })
            .collect();
        assert_eq!(Up::of_cameras(around.iter()), Some(Up::PLUS_Z));
        assert_eq!(Up::of_cameras([].into_iter()), None);
    }
}
