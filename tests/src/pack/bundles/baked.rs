//! Scenes with a section gaussians.

use pocketsplat_format::bundle::Effects;

use super::{ANISOTROPIC, DETAILED, SMALL, anchors, front, in_tiers, inside, off_centre, one_chunk, sample, small};
use crate::pack::sample::{NO_EFFECT, Sample};

/// Scenes with a section gaussians: what section 10 rounds.
pub(super) fn samples() -> Vec<Sample> {
    let effects = Effects { dilation_compensation: true, detail: true, background: true, ..ANISOTROPIC };
    let some = anchors(30, DETAILED, effects, true, 700);
    let mut draft = small(effects, DETAILED, true, 700);
    draft.tiers = in_tiers(&some, &[14, 30], 8);
    draft.max_chunk_anchors = 8;
    draft.gaussians = true;
    draft.count_tables([1.0 / 16.0, 1.0 / 8.0, 1.0 / 16.0]);
    let about = "A section gaussians: opacities, colours, scales and rotations are rounded, and there is no prefilter.";
    let mut all = sample("baked", about, draft, &[]);
    all.views = vec![(1, front()), (2, off_centre()), (2, inside())];
    let mut round = small(Effects { background: true, ..NO_EFFECT }, SMALL, false, 701);
    round.gaussians = true;
    round.tiers = one_chunk(anchors(30, SMALL, NO_EFFECT, false, 701));
    round.max_chunk_anchors = 30;
    round.count_tables([1.0 / 16.0, 1.0 / 8.0, 1.0 / 16.0]);
    vec![all, sample("baked-isotropic", "The same of isotropic Gaussians.", round, &[front(), inside()])]
}
