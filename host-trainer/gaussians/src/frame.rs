//! Where a file's numbers lie in the scene.

use std::fmt;

/// A scene's point is `offset` + `scale` · the file's.
///
/// It is not the identity where a format could not hold the scene's own numbers: far from the origin, or in other units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Of the file's origin, scene units.
    pub offset: [f64; 3],
    /// Scene units in one of the file.
    pub scale: f64,
}

impl Default for Frame {
    fn default() -> Self {
        Self { offset: [0.0; 3], scale: 1.0 }
    }
}

/// Begins the text of a frame.
const TEXT: &str = "scene = file * ";

impl Frame {
    /// Whether the file has the scene's own numbers.
    pub fn is_identity(&self) -> bool {
        *self == Self::default()
    }

    /// The frame of its four numbers: offset and scale. `None` where they are none.
    pub(crate) fn of_numbers([x, y, z, scale]: [f64; 4]) -> Option<Self> {
        let is_one = [x, y, z].iter().all(|part| part.is_finite()) && scale.is_finite() && scale > 0.0;
        is_one.then_some(Self { offset: [x, y, z], scale })
    }

    /// Offset and scale.
    pub(crate) fn numbers(&self) -> [f64; 4] {
        let [x, y, z] = self.offset;
        [x, y, z, self.scale]
    }

    /// Reads what [`fmt::Display`] writes.
    pub(crate) fn of_text(text: &str) -> Option<Self> {
        let (scale, offset) = text.trim().strip_prefix(TEXT)?.split_once(" + (")?;
        let mut parts = offset.strip_suffix(')')?.split(", ").map(str::parse);
        let mut next = || parts.next()?.ok();
        Self::of_numbers([next()?, next()?, next()?, scale.parse().ok()?])
    }
}

impl fmt::Display for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.offset;
        write!(f, "{TEXT}{} + ({x}, {y}, {z})", self.scale)
    }
}

#[cfg(test)]
mod tests {
    use super::Frame;

    #[test]
    fn a_frame_is_read_as_it_is_written() {
        for frame in [Frame::default(), Frame { offset: [5_412_000.0, -0.1, 1e-9], scale: 0.001 }] {
            assert_eq!(Frame::of_text(&frame.to_string()), Some(frame));
        }
        for broken in ["", "scene = file * 1", "scene = file * 0 + (1, 2, 3)", "scene = file * 1 + (1, 2, inf)"] {
            assert_eq!(Frame::of_text(broken), None, "{broken}");
        }
    }
}
