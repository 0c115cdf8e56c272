//! Each feature alone, and all but the context together.

use pocketsplat_format::bundle::Effects;

use super::{ALL_EFFECTS, DETAILED, SMALL, anchors, front, in_tiers, inside, off_centre, sample, small};
use crate::pack::draft::{Draft, HeadCoding};
use crate::pack::sample::{NO_EFFECT, Sample};

/// Each feature alone, then all together.
pub(super) fn samples() -> Vec<Sample> {
    let none = NO_EFFECT;
    let alone = [
        ("plain", "No feature: isotropic Gaussians on black, tables, plain heads.", none),
        ("view-colour", "Feature 0 alone: the colour head sees the direction.", Effects { view_colour: true, ..none }),
        ("view-distance", "Feature 1 alone: three heads see the distance.", Effects { view_distance: true, ..none }),
        ("dilation", "Feature 2 alone: dilation compensation.", Effects { dilation_compensation: true, ..none }),
        ("anisotropy", "Feature 7 alone: three deviations and a rotation.", Effects { anisotropic: true, ..none }),
        ("background", "Feature 8 alone: a colour behind the scene.", Effects { background: true, ..none }),
        (
            "view-geometry",
            "Feature 10 alone: the opacity and the covariance head see the direction.",
            Effects { view_geometry: true, ..none },
        ),
    ];
    let mut samples: Vec<Sample> = alone
        .into_iter()
        .zip(100..)
        .map(|((name, about, effects), seed)| sample(name, about, small(effects, SMALL, false, seed), &[front()]))
        .collect();
    let masks = small(none, SMALL, true, 110);
    samples.push(sample(
        "masks",
        "Feature 3 alone: offsets that are not drawn, all of an anchor's too.",
        masks,
        &[front()],
    ));
    let coded = Draft { head_coding: HeadCoding::Counted, ..small(none, SMALL, false, 111) };
    samples.push(sample("coded-heads", "Feature 5 alone: matrices of the heads are coded.", coded, &[front()]));
    let detail = small(Effects { detail: true, ..none }, DETAILED, false, 112);
    samples.push(sample("detail", "Feature 6 alone: a fourth head adds to colours.", detail, &[front(), off_centre()]));
    let mut wide = small(ALL_EFFECTS, DETAILED, true, 113);
    wide.head_coding = HeadCoding::Counted;
    wide.tiers = in_tiers(&anchors(40, DETAILED, ALL_EFFECTS, true, 113), &[12, 25, 40], 8);
    wide.max_chunk_anchors = 8;
    wide.count_tables([1.0 / 16.0, 1.0 / 8.0, 1.0 / 16.0]);
    let mut all = sample("everything-tables", "All features but the context, in three tiers.", wide, &[]);
    all.views = vec![(1, front()), (2, off_centre()), (3, front()), (3, off_centre()), (3, inside())];
    samples.push(all);
    samples
}
