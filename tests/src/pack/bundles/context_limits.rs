//! Contexts whose numbers are at their limits.

use pocketsplat_format::context::LevelKind;

use super::contexts::{frame, shape_of, with_context};
use super::{SMALL, front, sample};
use crate::pack::contexts::{ContextDraft, level};
use crate::pack::sample::{NO_EFFECT, Sample};

/// A context whose outputs reach their limits: means of 512 base steps, scales and steps beyond their ranges.
pub(super) fn limits() -> Sample {
    let shape = shape_of(SMALL, NO_EFFECT, 3);
    let mut context = ContextDraft::grid(shape, frame(), vec![level(LevelKind::Volume, 2, 8)], 0, 220);
    let network = &mut context.networks[0];
    // Hidden units: always 32767, always 0, and what the grid says, unshifted.
    network.shift1 = vec![0, 31, 0];
    network.b1 = vec![1 << 29, -(1 << 29), 0];
    network.w1 = [[127; 4], [-128; 4], [1, -1, 2, -2]].concat();
    let c = shape.channels;
    for output in 0..2 * c + 3 {
        network.w2[3 * output..][..3].copy_from_slice(&[0, 0, 1]);
        network.shift2[output] = 14;
        network.b2[output] = 0;
    }
    // Means of ±512 base steps, scales of ±32767 eighths of an octave, and steps from the smallest to the largest.
    for (output, bias, shift) in
        [(0, 1 << 29, 0), (1, -(1 << 29), 0), (2, 1 << 29, 31), (c, 1 << 29, 0), (c + 1, -(1 << 29), 0)]
    {
        (network.b2[output], network.shift2[output]) = (bias, shift);
    }
    network.w2[3 * (2 * c)..][..9].copy_from_slice(&[[0, 0, 40], [0, 0, 2], [-128, -128, 127]].concat());
    // In the middle of the scene's log-scales.
    for output in 4..8 {
        network.b2[output] = -(16 * 64) << 14;
    }
    let mut draft = with_context(NO_EFFECT, SMALL, false, 24, &context, 220);
    for (anchor, at) in draft.tiers[0][0].iter_mut().zip(0..) {
        // Near the means where the step is the smallest: ±4096.
        anchor.symbols[0] = 4090 + at;
        anchor.symbols[1] = -4101 + at;
    }
    let about = "Outputs of the context at their limits: biases of 2²⁹, shifts of 0 and 31, steps from −24 to 7, scales from 0 to 63.";
    sample("context-limits", about, draft, &[front()])
}

/// A context with a mean and a deviation that are known, and symbols at all distances from them.
pub(super) fn near_and_far() -> Sample {
    let shape = shape_of(SMALL, NO_EFFECT, 1);
    let mut context = ContextDraft::grid(shape, frame(), vec![level(LevelKind::Xy, 2, 4)], 0, 221);
    let network = &mut context.networks[0];
    let c = shape.channels;
    network.w2.fill(0);
    network.shift2.fill(0);
    network.b2.fill(0);
    // Means of −4/8 to 3/8 of a step, deviations of 1/16: D is 3.
    for (channel, bias) in network.b2[..c].iter_mut().enumerate() {
        *bias = 8 * (channel as i32 % 8 - 4);
    }
    for bias in &mut network.b2[4..8] {
        *bias -= 16 * 64;
    }
    network.b2[c..2 * c].fill(-32);
    let distances = [0, 3, -3, 4, -4, 130, -130, 131, -131, 5, -6, 60, -77];
    let far = [i16::MIN, i16::MAX, 256, -257];
    let mut draft = with_context(NO_EFFECT, SMALL, false, 20, &context, 221);
    for (anchor, at) in draft.tiers[0][0].iter_mut().zip(0..) {
        for (channel, symbol) in anchor.symbols.iter_mut().enumerate() {
            let is_log_scale = (4..8).contains(&channel);
            let pick = at + 3 * channel;
            *symbol = match far.get(pick % 23) {
                Some(&far) if !is_log_scale => far,
                _ if is_log_scale => -16 + [0, 3, -3, 4, -4, 5, -6, 0][pick % 8],
                _ => distances[pick % distances.len()],
            };
        }
    }
    // Both bytes that announce a far symbol.
    draft.recode = Some(|anchor, _, mut usual| {
        if usual.len() == 4 && anchor % 2 == 1 {
            usual[1] = crate::pack::stream::raw(254);
        }
        usual
    });
    let about = "Symbols at all distances from their means: near escapes of both signs on both sides, the nearest and the farthest of \
                 them, far escapes after a byte of 254 and of 255.";
    sample("context-escapes", about, draft, &[front()])
}
