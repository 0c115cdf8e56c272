//! Which anchors of a view its rate is taken over.

use crate::ops::rate::noise::Stream;

/// Number of the draw that decides; channels are fewer.
pub const SAMPLE_DRAW: u32 = u32::MAX;

/// Whether an anchor is in the sample: with probability `share` times its weight, at most 1.
///
/// * `stream`: of the iteration. * `view_weights`: [of all anchors](crate::scene::Anchors::view_weights), or empty: 1 each.
pub fn holds(stream: Stream, anchor: u32, share: f64, view_weights: &[f32]) -> bool {
    #[expect(clippy::cast_possible_truncation, reason = "a share; a device multiplies in f32, too")]
    let share = share as f32 * view_weights.get(anchor as usize).copied().unwrap_or(1.0);
    stream.branch(anchor).uniform(SAMPLE_DRAW) < share
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rare_anchors_are_sampled_more_often() {
        let view_weights = [0.5, 1.0, 4.0, 100.0];
        let n_sampled = |anchor: u32, view_weights: &[f32]| {
            (0..10_000).filter(|i| holds(Stream::of_run(5).branch(*i), anchor, 0.05, view_weights)).count()
        };
        // Three standard deviations are 65 of 500.
        for (anchor, expected) in (0..).zip([250, 500, 2000, 10_000]) {
            assert!(n_sampled(anchor, &view_weights).abs_diff(expected) < 130, "anchor {anchor}");
            assert!(n_sampled(anchor, &[]).abs_diff(500) < 65, "nothing counted");
        }
    }
}
