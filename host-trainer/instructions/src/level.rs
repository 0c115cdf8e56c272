//! Profiles and levels: which decoder tools a bundle needs, and what a tier takes of a device.
//!
//! [MANIFEST.md](https://docs.rs/pocketsplat-core) defines them; a test holds [`LEVELS`] to its table. A decoder checks neither.

use std::fmt;

use pocketsplat_core::{Budget, Bundle, Plan, Residency, Strips};
use pocketsplat_format::bundle::{Features, ModelCost, STRIPS, TierMeasures};

/// A set of decoder tools.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Profile {
    /// No context.
    Device,
    /// Everything.
    Full,
}

impl Profile {
    /// The profile that a bundle of these features needs.
    pub fn of(features: &Features) -> Self {
        if features.context { Self::Full } else { Self::Device }
    }
}

impl fmt::Display for Profile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Device => "Device",
            Self::Full => "Full",
        })
    }
}

/// What a level bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bound {
    /// Pixels of a frame of the training size.
    Frame,
    /// Bytes of scratch memory.
    Scratch,
    /// Bytes of the file up to the tier's end.
    Flash,
    /// Anchors of the tier and those before it.
    Anchors,
    /// Splats of a frame.
    Splats,
    /// Multiply-adds of the heads in a frame.
    HeadMacs,
    /// Model instructions of a frame.
    Instructions,
}

impl Bound {
    /// All, in the order of [`Level::bounds`].
    pub const ALL: [Self; 7] =
        [Self::Frame, Self::Scratch, Self::Flash, Self::Anchors, Self::Splats, Self::HeadMacs, Self::Instructions];

    /// What is counted, after a number of it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Frame => "pixels of a frame",
            Self::Scratch => "bytes of scratch memory",
            Self::Flash => "bytes of flash",
            Self::Anchors => "anchors",
            Self::Splats => "splats of a frame",
            Self::HeadMacs => "head multiply-adds of a frame",
            Self::Instructions => "model instructions of a frame",
        }
    }
}

/// Bounds on what a tier takes of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level {
    /// 1 to 5.
    pub number: u8,
    /// Width and height of its frame, pixels; only their product counts.
    pub frame_px: [u16; 2],
    /// As [`Bound::ALL`] orders them.
    pub bounds: [u64; 7],
}

const fn level(number: u8, frame_px: [u16; 2], others: [u64; 6]) -> Level {
    let [scratch, flash, anchors, splats, head_macs, instructions] = others;
    let frame = frame_px[0] as u64 * frame_px[1] as u64;
    Level { number, frame_px, bounds: [frame, scratch, flash, anchors, splats, head_macs, instructions] }
}

const KIB: u64 = 1024;
/// What the example firmware takes of RAM beside the scratch memory: 8 KiB of stack, 3 of everything else.
const FIRMWARE: u64 = 11 * KIB;

/// The levels there are, least first; each bound is at least that of the level before.
pub const LEVELS: [Level; 5] = [
    level(1, [128, 96], [64 * KIB - FIRMWARE, 32 * KIB, 4_000, 2_000, 1_000_000, 40_000_000]),
    level(2, [128, 128], [128 * KIB - FIRMWARE, 64 * KIB, 8_000, 4_000, 2_000_000, 70_000_000]),
    level(3, [160, 120], [256 * KIB - FIRMWARE, 96 * KIB, 16_000, 8_000, 10_000_000, 100_000_000]),
    level(4, [320, 240], [1024 * KIB - FIRMWARE, 1024 * KIB, 60_000, 32_000, 50_000_000, 320_000_000]),
    level(5, [640, 480], [8192 * KIB, 4096 * KIB, 200_000, 200_000, 500_000_000, 4_000_000_000]),
];

/// What a tier takes of a bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Need {
    /// Which bound.
    pub bound: Bound,
    /// What the tier takes.
    pub needed: u64,
    /// What the level allows.
    pub most: u64,
}

impl Need {
    /// Whether the bound is kept.
    pub fn is_kept(&self) -> bool {
        self.needed <= self.most
    }

    /// Part of the bound that is taken; above 1 it is not kept.
    pub fn share(&self) -> f64 {
        self.needed as f64 / self.most as f64
    }
}

impl fmt::Display for Need {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { bound, needed, most } = *self;
        let share = 100.0 * self.share();
        write!(f, "{needed} {}, {share:.1} % of {most}", bound.name())
    }
}

impl Level {
    /// The level of this number, if there is one.
    pub fn numbered(number: u8) -> Option<&'static Self> {
        LEVELS.iter().find(|level| level.number == number)
    }

    /// What the level allows.
    pub fn most(&self, bound: Bound) -> u64 {
        self.bounds[bound as usize]
    }

    /// What the scene up to tier number `tier` takes of each bound; `None` where the manifest is not measured or the file does not hold
    /// the tier.
    ///
    /// Scratch memory and instructions are those of the fewest strips whose memory the level allows, or of those that take least.
    pub fn needs(&self, bundle: &Bundle<'_>, tier: u8) -> Option<[Need; 7]> {
        let measures = bundle.measures(tier).filter(|measures| measures.n_cameras > 0 && tier < bundle.n_tiers())?;
        let content = bundle.tier(tier)?;
        let [width_px, height_px] = bundle.header().training_px;
        let budget = Budget::for_frame(width_px, height_px).with_tiers(tier + 1).with_residency(Residency::Streamed);
        let scratch_of = |n_strips| {
            let plan = Plan::new(bundle, &budget.with_strips(Strips::Exactly(n_strips)));
            plan.map_or(u64::MAX, |plan| plan.scratch_len() as u64)
        };
        let strips = STRIPS.map(|n_strips| (scratch_of(n_strips), n_strips));
        let fits = strips.into_iter().find(|(scratch, _)| *scratch <= self.most(Bound::Scratch));
        let (scratch, n_strips) = fits.or(strips.into_iter().min()).unwrap_or((u64::MAX, 1));
        let chunks_start = bundle.sections().last().map_or(0, |section| section.offset);
        let taken = [
            u64::from(width_px) * u64::from(height_px),
            scratch,
            u64::from(chunks_start) + u64::from(content.end),
            content.n_anchors.into(),
            measures.max_splats.into(),
            head_macs(&measures),
            instructions(bundle, &measures, n_strips),
        ];
        let mut needs = Bound::ALL.map(|bound| Need { bound, needed: 0, most: self.most(bound) });
        for (need, taken) in needs.iter_mut().zip(taken) {
            need.needed = taken;
        }
        Some(needs)
    }

    /// The least level whose every bound the scene up to tier number `tier` keeps; 0 where it keeps none or is not measured.
    pub fn least(bundle: &Bundle<'_>, tier: u8) -> u8 {
        let keeps = |level: &&Self| level.needs(bundle, tier).is_some_and(|needs| needs.iter().all(Need::is_kept));
        LEVELS.iter().find(keeps).map_or(0, |level| level.number)
    }
}

fn head_macs(measures: &TierMeasures) -> u64 {
    1024 * u64::from(measures.max_head_kilo_macs)
}

/// Model instructions of a frame in `n_strips` strips.
fn instructions(bundle: &Bundle<'_>, measures: &TierMeasures, n_strips: u8) -> u64 {
    let [width_px, height_px] = bundle.header().training_px.map(u64::from);
    let [decoded, visible, splats, pairs, kilo_pixels] = [
        measures.max_decoded_anchors,
        measures.max_visible_anchors,
        measures.max_splats,
        measures.max_strip_pairs[0],
        measures.max_kilo_pixels,
    ]
    .map(u64::from);
    let strip_splats = STRIPS.into_iter().zip(measures.max_strip_splats).find(|(n, _)| *n == n_strips);
    let strip_splats = u64::from(strip_splats.map_or(0, |(_, splats)| splats));
    let n_strips = u64::from(n_strips);
    let tile_rows = height_px.div_ceil(16).div_ceil(n_strips);
    let of = |n: u64, each: u32| n * u64::from(each);
    let anchors = of(decoded, bundle.model_cost().decoded)
        + of(visible, ModelCost::VISIBLE)
        + of(head_macs(measures), ModelCost::HEAD_MAC)
        + of(splats, ModelCost::GAUSSIAN);
    let sorting = strip_splats * (125 + 17 * tile_rows);
    let blending = of(pairs, ModelCost::PAIR)
        + of(1024 * kilo_pixels, ModelCost::PIXEL)
        + of(width_px * height_px, ModelCost::FRAME_PIXEL);
    n_strips * (anchors + sorting) + blending
}

#[cfg(test)]
mod tests {
    use super::{Bound, LEVELS, Level};

    #[test]
    fn each_level_allows_all_that_the_one_before_does() {
        for (number, level) in (1..).zip(&LEVELS) {
            assert_eq!((level.number, Level::numbered(number)), (number, Some(level)));
            assert_eq!(level.most(Bound::Frame), level.frame_px.map(u64::from).iter().product());
        }
        for pair in LEVELS.windows(2) {
            assert!(pair[0].bounds.iter().zip(pair[1].bounds).all(|(less, more)| *less <= more), "{pair:?}");
        }
        assert_eq!([0, 6].map(Level::numbered), [None, None]);
    }
}
