//! Which frames of a film are taken: sharp ones, at an even overlap.
//!
//! The film is cut into slots of equal motion, not of equal time: where the camera hurries there are more frames, where it stands there
//! are few. Of each slot the sharpest frame is taken, of those in its middle where there are some, so that two of them never are
//! neighbours.

use std::cmp::Ordering;

/// Side of the thumbnails that motion is measured on, px.
const THUMBNAIL_PX: usize = 64;
/// Grey levels by which thumbnails of a camera that stands still may differ: noise.
const NOISE: f64 = 0.5;
/// Grey levels between two frames that are worth two photographs.
const LEAST_MOTION: f64 = 1.0;
/// The middle of a slot, as shares of it.
const MIDDLE: std::ops::Range<f64> = 0.2..0.8;

/// What is measured of a candidate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate {
    /// Variance of the Laplacian, grey levels squared.
    pub(super) sharpness: f64,
    /// How much of the picture changed since the candidate before: mean difference of thumbnails, grey levels.
    pub(super) motion: f64,
}

/// Measures candidates one after another.
#[derive(Debug, Default)]
pub(super) struct Measure {
    before: Option<Vec<f64>>,
}

impl Measure {
    /// * `grey`: `[height, width]`, 8 bit.
    pub(super) fn next(&mut self, grey: &[u8], width: usize) -> Candidate {
        let thumbnail = thumbnail(grey, width);
        let motion = self.before.as_ref().map_or(0.0, |before| {
            let differences = before.iter().zip(&thumbnail).map(|(a, b)| (a - b).abs());
            (differences.sum::<f64>() / thumbnail.len() as f64 - NOISE).max(0.0)
        });
        self.before = Some(thumbnail);
        Candidate { sharpness: sharpness(grey, width), motion }
    }
}

/// Variance of the Laplacian (of the four neighbours): blur takes away high frequencies, which it measures.
fn sharpness(grey: &[u8], width: usize) -> f64 {
    let height = grey.len() / width.max(1);
    let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for y in 1..height.saturating_sub(1) {
        for x in 1..width.saturating_sub(1) {
            let at = |x: usize, y: usize| f64::from(grey[y * width + x]);
            let value = at(x - 1, y) + at(x + 1, y) + at(x, y - 1) + at(x, y + 1) - 4.0 * at(x, y);
            (n, sum, squares) = (n + 1.0, sum + value, squares + value * value);
        }
    }
    if n == 0.0 { 0.0 } else { squares / n - (sum / n) * (sum / n) }
}

/// Means over the cells of a grid, less the mean of all: exposure that changes is no motion.
fn thumbnail(grey: &[u8], width: usize) -> Vec<f64> {
    let height = grey.len() / width.max(1);
    let (columns, rows) = (width.min(THUMBNAIL_PX), height.min(THUMBNAIL_PX));
    let mut cells = vec![(0.0, 0.0); columns * rows];
    for y in 0..height {
        for x in 0..width {
            let cell = &mut cells[y * rows / height * columns + x * columns / width];
            *cell = (cell.0 + f64::from(grey[y * width + x]), cell.1 + 1.0);
        }
    }
    let means: Vec<f64> = cells.iter().map(|(sum, n)| sum / n).collect();
    let mean = means.iter().sum::<f64>() / means.len().max(1) as f64;
    means.iter().map(|value| value - mean).collect()
}

/// The candidates to take, in order: at most `n_wanted`, fewer where the camera hardly moves.
pub(super) fn choose(candidates: &[Candidate], n_wanted: usize) -> Vec<usize> {
    let mut moved = 0.0;
    let places: Vec<f64> = candidates
        .iter()
        .map(|candidate| {
            moved += candidate.motion;
            moved
        })
        .collect();
    let n_slots = n_wanted.min((moved / LEAST_MOTION) as usize).min(candidates.len()).max(1);
    let slot_of = |place: f64| if moved > 0.0 { place / moved * n_slots as f64 } else { 0.0 };
    let mut best: Vec<Option<usize>> = vec![None; n_slots];
    let is_in_middle = |i: usize| MIDDLE.contains(&slot_of(places[i]).fract());
    let better = |i: usize, j: usize| {
        let sharper = candidates[i].sharpness.total_cmp(&candidates[j].sharpness);
        is_in_middle(i).cmp(&is_in_middle(j)).then(sharper) == Ordering::Greater
    };
    for (i, &place) in places.iter().enumerate() {
        // The last candidate ends the last slot.
        let slot = &mut best[(slot_of(place) as usize).min(n_slots - 1)];
        if slot.is_none_or(|other| better(i, other)) {
            *slot = Some(i);
        }
    }
    best.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film(motion: &[f64], sharpness: impl Fn(usize) -> f64) -> Vec<Candidate> {
        let candidate = |(i, &motion): (usize, &f64)| {
            // The first has nothing before it.
            Candidate { sharpness: sharpness(i), motion: if i == 0 { 0.0 } else { motion } }
        };
        motion.iter().enumerate().map(candidate).collect()
    }

    #[test]
    fn the_sharpest_frame_of_each_slot_is_taken() {
        // Five candidates a slot, the third and fourth of which are its middle.
        let even = film(&[2.0; 20], |i| f64::from([3, 7, 13, 17].contains(&(i as i32))));
        assert_eq!(choose(&even, 4), [3, 7, 13, 17]);
        let same = film(&[2.0; 20], |_| 1.0);
        let taken = choose(&same, 4);
        assert_eq!(taken.len(), 4);
        assert!(taken.windows(2).all(|pair| pair[1] - pair[0] >= 3), "{taken:?}");
    }

    #[test]
    fn overlap_is_even_where_the_camera_hurries_and_stands() {
        // Still, then slow, then four times as fast.
        let motion: Vec<f64> = [[0.0; 40], [1.0; 40], [4.0; 40]].concat();
        let taken = choose(&film(&motion, |_| 1.0), 50);
        let within = |range: std::ops::Range<usize>| taken.iter().filter(|i| range.contains(i)).count();
        assert!(within(0..40) <= 1, "{taken:?}");
        assert!(within(40..80).abs_diff(10) <= 2 && within(80..120).abs_diff(40) <= 2, "{taken:?}");
    }

    #[test]
    fn a_film_that_stands_still_gives_few_frames() {
        assert_eq!(choose(&film(&[0.0; 30], |i| i as f64), 10), [29], "the sharpest");
        assert_eq!(choose(&film(&[0.11; 30], |_| 1.0), 10).len(), 3);
        assert_eq!(choose(&film(&[9.0; 3], |_| 1.0), 10), [0, 1, 2], "no more than there are");
    }

    #[test]
    fn blur_lowers_sharpness_and_a_step_is_motion() {
        let stripes = |shift: usize| -> Vec<u8> {
            (0..64 * 48).map(|i| if ((i % 64 + shift) / 4).is_multiple_of(2) { 200 } else { 40 }).collect()
        };
        let blurred: Vec<u8> = {
            let sharp = stripes(0);
            let mean = |i: usize| (0..5).map(|k| u32::from(sharp[(i + k).min(sharp.len() - 1)])).sum::<u32>() / 5;
            (0..sharp.len()).map(|i| mean(i) as u8).collect()
        };
        let mut measure = Measure::default();
        let first = measure.next(&stripes(0), 64);
        assert_eq!(first.motion, 0.0);
        assert_eq!(measure.next(&stripes(0), 64).motion, 0.0, "it stands still");
        assert!(measure.next(&stripes(2), 64).motion > 10.0);
        assert!(sharpness(&blurred, 64) < 0.2 * first.sharpness);
        // Brighter all over is no motion.
        let brighter: Vec<u8> = stripes(2).iter().map(|value| value + 20).collect();
        assert_eq!(measure.next(&brighter, 64).motion, 0.0);
    }
}
