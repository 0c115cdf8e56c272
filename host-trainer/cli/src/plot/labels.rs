//! Names beside points, where they cover neither each other nor a point.

/// Size of a label's letters, pixels.
pub(super) const LABEL_PX: i32 = 12;
/// Width of a letter, about, in hundredths of its size.
const LETTER_PERCENT: i32 = 56;
/// Half the side of what a point covers, pixels.
const POINT_PX: i32 = 5;

/// A rectangle, pixels: left, top, right, bottom.
type Box = [i32; 4];

/// Where each label's left upper corner goes, relative to its point; none where it finds no room.
///
/// Labels are placed in their order: the first have the choice.
///
/// * `points`: all points of the chart, pixels. * `labels`: index of the point, text. * `frame`: left, top, right, bottom of the chart.
pub(super) fn placed(points: &[(i32, i32)], labels: &[(usize, &str)], frame: Box) -> Vec<Option<(i32, i32)>> {
    let around = |&(x, y): &(i32, i32)| [x - POINT_PX, y - POINT_PX, x + POINT_PX, y + POINT_PX];
    let mut taken: Vec<Box> = points.iter().map(around).collect();
    let mut places = Vec::new();
    for (index, text) in labels {
        let (x, y) = points[*index];
        let width = i32::try_from(text.chars().count()).unwrap_or(i32::MAX / 200) * LABEL_PX * LETTER_PERCENT / 100;
        let offsets = candidates(width);
        let free = offsets.into_iter().find(|(dx, dy)| {
            let label = [x + dx, y + dy, x + dx + width, y + dy + LABEL_PX];
            inside(&label, &frame) && !taken.iter().any(|other| overlap(&label, other))
        });
        if let Some((dx, dy)) = free {
            taken.push([x + dx, y + dy, x + dx + width, y + dy + LABEL_PX]);
        }
        places.push(free);
    }
    places
}

/// Corners to try: right, left, above, below, and the same further off.
fn candidates(width: i32) -> Vec<(i32, i32)> {
    let (half, middle) = (width / 2, LABEL_PX / 2);
    let near = |gap: i32| {
        [
            (gap, -middle),
            (gap, -LABEL_PX - 2),
            (gap, 2),
            (-half, -LABEL_PX - gap),
            (-half, gap),
            (-width - gap, -middle),
            (-width - gap, -LABEL_PX - 2),
            (-width - gap, 2),
        ]
    };
    [8, 14, 22].into_iter().flat_map(near).collect()
}

fn inside([left, top, right, bottom]: &Box, frame: &Box) -> bool {
    *left >= frame[0] && *top >= frame[1] && *right <= frame[2] && *bottom <= frame[3]
}

fn overlap(a: &Box, b: &Box) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Box = [0, 0, 400, 200];

    #[test]
    fn no_label_covers_a_point_or_another_label() {
        let points: Vec<(i32, i32)> = (0..12).map(|i| (40 + 25 * i, 60 + 7 * (i % 5))).collect();
        let labels: Vec<(usize, &str)> = (0..12).map(|i| (i, "a setting")).collect();
        let places = placed(&points, &labels, FRAME);
        let width = 9 * LABEL_PX * LETTER_PERCENT / 100;
        let boxes: Vec<Box> = places
            .iter()
            .zip(&points)
            .filter_map(|(place, (x, y))| place.map(|(dx, dy)| [x + dx, y + dy, x + dx + width, y + dy + LABEL_PX]))
            .collect();
        assert!(boxes.len() >= 6, "most find room: {}", boxes.len());
        for (i, label) in boxes.iter().enumerate() {
            assert!(inside(label, &FRAME) && boxes[..i].iter().all(|other| !overlap(label, other)));
            assert!(points.iter().all(|(x, y)| !overlap(label, &[*x, *y, x + 1, y + 1])));
        }
    }

    #[test]
    fn a_label_without_room_is_left_out() {
        assert_eq!(placed(&[(5, 5)], &[(0, "a name that is far too long for its chart")], [0, 0, 60, 10]), [None]);
        assert_eq!(placed(&[(50, 50)], &[(0, "a")], FRAME)[0], Some((8, -6)));
    }
}
