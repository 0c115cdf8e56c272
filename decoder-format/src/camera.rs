//! The pinhole camera of a frame.

mod rotation;

pub(crate) use rotation::MOST_OFF;
pub use rotation::Rotation;

use crate::error::{DecodeError, Field, in_range};
use crate::math::sin_cos;

/// A pinhole camera in the normalised frame of a bundle: x right, y down, z forward (OpenCV).
///
/// `(x, y, z) = R·p + t`, `u = fx·x/z + cx`, `v = fy·y/z + cy`; the centre of pixel `(i, j)` is `(i + 0.5, j + 0.5)`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Camera {
    /// World to camera rotation.
    pub rotation: Rotation,
    /// World to camera translation, normalised units.
    pub translation: [f32; 3],
    /// Focal lengths `[fx, fy]`, pixels.
    pub focal_px: [f32; 2],
    /// Principal point `[cx, cy]`, pixels from the outer corner of the first pixel.
    pub principal_px: [f32; 2],
    /// Frame width, pixels.
    pub width_px: u16,
    /// Frame height, pixels.
    pub height_px: u16,
}

impl Camera {
    /// The largest angle, in size, that [`Camera::orbited`] turns by, radians: [`sin_cos`] is exact up to it.
    pub const MAX_ANGLE: f32 = 8192.0;

    /// The same camera with its frame scaled to `width_px × height_px`.
    ///
    /// ```
    /// # use pocketsplat_format::{Camera, Rotation};
    /// let camera = Camera {
    ///     rotation: Rotation::IDENTITY,
    ///     translation: [0.0; 3],
    ///     focal_px: [100.0, 100.0],
    ///     principal_px: [40.0, 30.0],
    ///     width_px: 80,
    ///     height_px: 60,
    /// };
    /// assert_eq!(camera.resized(160, 120).focal_px, [200.0, 200.0]);
    /// ```
    #[must_use]
    pub fn resized(&self, width_px: u16, height_px: u16) -> Self {
        let x_scale = f32::from(width_px) / f32::from(self.width_px);
        let y_scale = f32::from(height_px) / f32::from(self.height_px);
        let [fx, fy] = self.focal_px;
        let [cx, cy] = self.principal_px;
        Self {
            focal_px: [fx * x_scale, fy * y_scale],
            principal_px: [cx * x_scale, cy * y_scale],
            width_px,
            height_px,
            ..*self
        }
    }

    /// Where the camera stands, normalised frame: −Rᵀ·t.
    #[must_use]
    pub fn centre(&self) -> [f32; 3] {
        let [[r00, r01, r02], [r10, r11, r12], [r20, r21, r22]] = self.rotation.rows();
        let [x, y, z] = self.translation;
        [-(r00 * x + r10 * y + r20 * z), -(r01 * x + r11 * y + r21 * z), -(r02 * x + r12 * y + r22 * z)]
    }

    /// The camera carried around the scene by `angle`, radians; from above it moves counter-clockwise.
    ///
    /// With Q the turn by `angle` about the axis and p a point of it, R' = R·Qᵀ and t' = t + R·p − R'·p. The axis is that
    /// coordinate axis of the normalised frame to which the camera's up is nearest, either way round; p is the point of the
    /// camera's line of sight nearest to the origin, which the training cameras surround. Distance, height and what is in
    /// the middle of the image stay: of cameras that look at one point it is the circle that the manifest's orbit takes.
    /// Sine and cosine are [`sin_cos`]'s, so every machine gets the same bits. Angles are at most [`Camera::MAX_ANGLE`] in size.
    ///
    /// ```
    /// # use pocketsplat_format::{Camera, Rotation};
    /// // At (0, -3, 0), looking along y, z up.
    /// let camera = Camera {
    ///     rotation: Rotation::new([1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0])?,
    ///     translation: [0.0, 0.0, 3.0],
    ///     focal_px: [100.0, 100.0],
    ///     principal_px: [40.0, 30.0],
    ///     width_px: 80,
    ///     height_px: 60,
    /// };
    /// let [x, y, z] = camera.orbited(core::f32::consts::FRAC_PI_2).centre();
    /// assert!((x - 3.0).abs() < 1e-6 && y.abs() < 1e-6 && z == 0.0);
    /// # Ok::<(), pocketsplat_format::DecodeError>(())
    /// ```
    #[must_use]
    pub fn orbited(&self, angle: f32) -> Self {
        let [right, down, forward] = self.rotation.rows();
        let ([y0, y1, y2], [z0, z1, z2]) = (down, forward);
        let (axis, sign) = nearest_axis([-y0, -y1, -y2]);
        let [sin, cos] = sin_cos(angle);
        let sin = sign * sin;
        let eye = self.centre();
        let ([e0, e1, e2], along) = (eye, dot(eye, forward));
        let pivot = [e0 - along * z0, e1 - along * z1, e2 - along * z2];
        let [right_after, down_after, forward_after] = [right, down, forward].map(|row| turned(row, axis, sin, cos));
        let shifted = |t: f32, row, row_after| t + (dot(row, pivot) - dot(row_after, pivot));
        let ([a0, a1, a2], [b0, b1, b2], [c0, c1, c2]) = (right_after, down_after, forward_after);
        let [t0, t1, t2] = self.translation;
        Self {
            rotation: Rotation::new_unchecked([a0, a1, a2, b0, b1, b2, c0, c1, c2]),
            translation: [
                shifted(t0, right, right_after),
                shifted(t1, down, down_after),
                shifted(t2, forward, forward_after),
            ],
            ..*self
        }
    }

    /// The index of the first float that is not within its limits, in the order of the fields.
    pub(crate) fn first_unusable(&self) -> Option<u32> {
        let mut first = 0_u32;
        let parts: [(&[f32], f32, f32); 4] = [
            (self.rotation.numbers(), f32::MIN, ROTATION_END),
            (&self.translation, f32::MIN, END),
            (&self.focal_px, POSITIVE, END),
            (&self.principal_px, f32::MIN, END),
        ];
        for (floats, least, end) in parts {
            if let Some(index) = first_outside(floats, least, end) {
                return Some(first.wrapping_add(index));
            }
            first = first.wrapping_add(floats.len() as u32);
        }
        None
    }

    /// Checks that every float is of a magnitude below 10¹⁵, and one of the rotation's below 1000; that focal lengths are positive and the
    /// frame is not empty. That the rotation is one was checked when it was [made](Rotation::new).
    ///
    /// Within these limits no distance overflows f32, so that every sum of the heads is a number and every target draws the same frame.
    ///
    /// # Errors
    /// [`DecodeError::BadFloat`] or [`DecodeError::OutOfRange`] naming the field.
    pub fn check(&self) -> Result<(), DecodeError> {
        if let Some(index) = self.first_unusable() {
            let (field, first) = match index {
                ..12 => (Field::CameraPose, 0),
                12 | 13 => (Field::CameraFocal, 12),
                _ => (Field::CameraPrincipal, 14),
            };
            return Err(DecodeError::BadFloat { field, index: index.wrapping_sub(first) });
        }
        in_range(Field::FrameWidth, self.width_px.into(), 1, u32::MAX)?;
        in_range(Field::FrameHeight, self.height_px.into(), 1, u32::MAX)
    }
}

/// The number of the coordinate axis nearest to a direction, and its sign.
fn nearest_axis([x, y, z]: [f32; 3]) -> (u8, f32) {
    let [size_x, size_y, size_z] = [x.abs(), y.abs(), z.abs()];
    let (axis, component) = if size_z >= size_x && size_z >= size_y {
        (2, z)
    } else if size_y >= size_x {
        (1, y)
    } else {
        (0, x)
    };
    (axis, if component < 0.0 { -1.0 } else { 1.0 })
}

/// A vector turned about a coordinate axis.
fn turned([x, y, z]: [f32; 3], axis: u8, sin: f32, cos: f32) -> [f32; 3] {
    match axis {
        0 => [x, cos * y - sin * z, sin * y + cos * z],
        1 => [cos * x + sin * z, y, cos * z - sin * x],
        _ => [cos * x - sin * y, sin * x + cos * y, z],
    }
}

fn dot([a0, a1, a2]: [f32; 3], [b0, b1, b2]: [f32; 3]) -> f32 {
    a0 * b0 + a1 * b1 + a2 * b2
}

/// No number of a camera is as large.
const END: f32 = 1e15;
/// Nor is one of a matrix that takes the place of its rotation.
const ROTATION_END: f32 = 1000.0;
/// The least positive number.
const POSITIVE: f32 = f32::from_bits(1);

/// The index of the first float that is below `least`, or not of a magnitude below `end`.
fn first_outside(floats: &[f32], least: f32, end: f32) -> Option<u32> {
    (0..).zip(floats).find(|(_, x)| !(least <= **x && x.abs() < end)).map(|(index, _)| index)
}

#[cfg(test)]
mod tests {
    use core::f32::consts::TAU;

    use super::{Camera, Rotation, dot};
    use crate::error::{DecodeError, Field};

    /// A camera of 16 floats, in the order of its fields.
    fn camera_of(floats: [f32; 16]) -> Camera {
        let [rotation @ .., t0, t1, t2, fx, fy, cx, cy] = floats;
        Camera {
            rotation: Rotation::new_unchecked(rotation),
            translation: [t0, t1, t2],
            focal_px: [fx, fy],
            principal_px: [cx, cy],
            width_px: 60,
            height_px: 40,
        }
    }

    #[test]
    fn numbers_that_overflow_when_squared_are_refused_by_field_and_index() {
        let places = [(Field::CameraPose, 0..12), (Field::CameraFocal, 12..14), (Field::CameraPrincipal, 14..16)];
        for (field, range) in places {
            for place in range.clone() {
                let end: f32 = if place < 9 { 1000.0 } else { 1e15 };
                let with = |number: f32| {
                    let mut floats = [1.0; 16];
                    floats[place] = number;
                    camera_of(floats).check()
                };
                let bad = DecodeError::BadFloat { field, index: (place - range.start) as u32 };
                for number in [end, f32::MAX, f32::INFINITY, f32::NAN, -end, f32::NEG_INFINITY] {
                    assert_eq!(with(number), Err(bad), "{number} in place {place}");
                }
                assert_eq!(with(end.next_down()), Ok(()), "place {place}");
                let negative = with(-end.next_down());
                assert_eq!(negative.is_ok(), field != Field::CameraFocal, "place {place}: {negative:?}");
            }
        }
        // Within the limits, also to the farthest position that a bundle may hold.
        let [large, far] = [1000.0_f32, 1e15].map(f32::next_down);
        let mut floats = [large; 16];
        floats[9..].fill(far);
        let camera = camera_of(floats);
        assert_eq!(camera.check(), Ok(()));
        let position = (1 << 24) as f32 * 1e9;
        let square: f32 = camera.centre().iter().map(|x| (x.abs() + position) * (x.abs() + position)).sum();
        assert!(square.is_finite(), "the distance from {:?}", camera.centre());
    }

    #[test]
    fn an_orbit_keeps_distance_height_and_the_middle_of_the_image() {
        let up_along = |[y0, y1, y2]: [f32; 3], [z0, z1, z2]: [f32; 3]| {
            let right = [y1 * z2 - y2 * z1, y2 * z0 - y0 * z2, y0 * z1 - y1 * z0];
            let [x0, x1, x2] = right;
            [x0, x1, x2, y0, y1, y2, z0, z1, z2]
        };
        // Looking 0.6 down and 0.8 ahead, with each of the axes up.
        for (axis, rotation) in [
            (0, up_along([-0.8, 0.6, 0.0], [-0.6, -0.8, 0.0])),
            (1, up_along([0.0, -0.8, 0.6], [0.0, -0.6, -0.8])),
            (2, up_along([0.6, 0.0, -0.8], [-0.8, 0.0, -0.6])),
            (2, up_along([0.6, 0.0, 0.8], [0.8, 0.0, -0.6])),
        ] {
            let camera = Camera {
                rotation: Rotation::new(rotation).expect("a rotation"),
                translation: [0.1, -0.2, 2.5],
                focal_px: [90.0, 80.0],
                principal_px: [30.0, 20.0],
                width_px: 60,
                height_px: 40,
            };
            let [.., z0, z1, z2] = rotation;
            let eye = camera.centre();
            let along = dot(eye, [z0, z1, z2]);
            let pivot = [eye[0] - along * z0, eye[1] - along * z1, eye[2] - along * z2];
            let to_pivot = |eye: [f32; 3]| [0, 1, 2].map(|i| pivot[i] - eye[i]);
            for step in 0..9 {
                let after = camera.orbited(TAU * step as f32 / 8.0);
                let [x0, x1, x2, y0, y1, y2, z0, z1, z2] = after.rotation.to_array();
                Rotation::new(after.rotation.to_array()).expect("still a rotation");
                let near = |found: f32, expected: f32| {
                    assert!((found - expected).abs() < 1e-5, "axis {axis}, step {step}: {found}, not {expected}");
                };
                let offset = to_pivot(after.centre());
                near(dot(offset, [x0, x1, x2]), 0.0);
                near(dot(offset, [y0, y1, y2]), 0.0);
                near(dot(offset, [z0, z1, z2]), -along);
                near(after.centre()[axis], eye[axis]);
                near(dot([x0, x1, x2], [y0, y1, y2]), 0.0);
            }
            let whole = camera.orbited(TAU).centre();
            assert!([0, 1, 2].iter().all(|&i| (whole[i] - eye[i]).abs() < 1e-5), "a whole turn: {whole:?}, {eye:?}");
            assert!((camera.orbited(0.5).centre()[(axis + 1) % 3] - eye[(axis + 1) % 3]).abs() > 0.1, "it moves");
        }
    }
}
