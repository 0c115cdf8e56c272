//! Points as a capture brings them or photographs give them.

use glam::DVec3;

/// A point that was made of photographs, and the colour of its pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ColouredPoint {
    pub(super) at: DVec3,
    pub(super) rgb: [u8; 3],
}

/// Points, and their colours where all have one.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Points {
    pub(super) at: Vec<DVec3>,
    /// As many as points, or none.
    pub(super) rgb: Vec<[u8; 3]>,
}

impl Points {
    pub(super) fn len(&self) -> usize {
        self.at.len()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.at.is_empty()
    }

    /// Each with its colour.
    pub(super) fn each(&self) -> impl Iterator<Item = (DVec3, Option<[u8; 3]>)> {
        self.at.iter().enumerate().map(|(i, at)| (*at, self.rgb.get(i).copied()))
    }
}

impl FromIterator<(DVec3, Option<[u8; 3]>)> for Points {
    fn from_iter<I: IntoIterator<Item = (DVec3, Option<[u8; 3]>)>>(points: I) -> Self {
        let (at, rgb): (Vec<_>, Vec<_>) = points.into_iter().unzip();
        Self { at, rgb: rgb.into_iter().collect::<Option<_>>().unwrap_or_default() }
    }
}

/// A colour whose channels are numbers of 0 to 255.
pub(super) fn rgb8(channels: &[f64]) -> Option<[u8; 3]> {
    let channels: [f64; 3] = channels.try_into().ok()?;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in 0..=255")]
    let rounded = channels.map(|channel| channel.round() as u8);
    channels.iter().all(|channel| (0.0..=255.0).contains(channel)).then_some(rounded)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_those_of_all_points_or_of_none() {
        let points: Points = [(DVec3::X, Some([1, 2, 3])), (DVec3::Y, Some([4, 5, 6]))].into_iter().collect();
        assert_eq!((points.len(), &points.rgb[..]), (2, &[[1, 2, 3], [4, 5, 6]][..]));
        assert_eq!(points.each().collect::<Points>(), points);
        let points: Points = [(DVec3::X, Some([1, 2, 3])), (DVec3::Y, None)].into_iter().collect();
        assert_eq!((points.len(), points.rgb.len()), (2, 0));
    }

    #[test]
    fn what_is_no_colour_of_8_bits_is_none() {
        assert_eq!(rgb8(&[0.0, 127.6, 255.0]), Some([0, 128, 255]));
        for faulty in [&[0.0, 1.0][..], &[0.0, -1.0, 3.0], &[0.0, 256.0, 3.0], &[0.0, f64::NAN, 3.0]] {
            assert_eq!(rgb8(faulty), None);
        }
    }
}
