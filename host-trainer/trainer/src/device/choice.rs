//! The model that a device affords.

use std::fmt;

use pocketsplat_core::ScratchShape;
use pocketsplat_instructions::Processor;

use super::Limits;

/// Feature widths F and offsets K, widest first, and the splats that an anchor of them draws in the fullest view.
///
/// Splats are measured for two, three and four offsets with features of 16 on lego at 120×120 pixels
/// (`docs/experiments/2026-11-21-bundles-for-a-device.md`), where fewer offsets and more anchors gain, and carried on to five; a frame
/// filled with photographs has a quarter more. Since every offset starts with a positive opacity, an anchor of three draws 1.95 there. The numbers stay:
/// they only say which width is tried and how far a scene grows; how much of it fits is measured on its bundle.
const MODELS: [Model; 4] = [
    Model { feature_dim: 32, n_offsets: 5, splats_per_anchor: 2.8 },
    Model { feature_dim: 24, n_offsets: 4, splats_per_anchor: 2.4 },
    Model { feature_dim: 16, n_offsets: 3, splats_per_anchor: 1.55 },
    Model { feature_dim: 8, n_offsets: 2, splats_per_anchor: 1.0 },
];
/// Anchors without which a wider model is of no use.
const ENOUGH_ANCHORS: usize = 4_000;
/// Fewer than these show nothing.
const FEWEST_ANCHORS: usize = 64;
/// Share of a frame's splats that the fuller of two strips has, and below how often the heads then run for an anchor: lego's.
const SHARE_OF_TWO_STRIPS: f64 = 0.78;
const HEAD_PASSES: f64 = 1.6;
/// Instructions of a Cortex-M4 for a multiply-add of the heads and for a symbol, before a frame is there to predict from.
const PER_MAC: f64 = 2.5;
const PER_SYMBOL: f64 = 64.0;
/// Share of a frame's instructions that goes into anchors; the rest projects, sorts and blends.
const SHARE_OF_ANCHORS: f64 = 0.5;
/// Bytes of a bundle besides its anchors, for features of width 16.
const FIXED_FLASH: f64 = 10_000.0;
/// Weights λ of the rate, and the bits that a channel then takes; the second where flash would decide with the first.
const RATES: [RateWeight; 2] = [RateWeight { lambda: 0.001, bits: 4.0 }, RateWeight { lambda: 0.004, bits: 2.8 }];

/// What a weight of the bits comes to.
#[derive(Clone, Copy)]
struct RateWeight {
    lambda: f64,
    bits: f64,
}

/// The limit that caps the number of anchors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BindingLimit {
    /// Scratch memory.
    Ram,
    /// Bytes of the bundle.
    Flash,
    /// Instructions of a frame.
    Instructions,
    /// No limit is given.
    Nothing,
}

impl fmt::Display for BindingLimit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Ram => "RAM",
            Self::Flash => "flash",
            Self::Instructions => "a frame's instructions",
            Self::Nothing => "nothing",
        })
    }
}

/// Widths of a model.
#[derive(Clone, Copy)]
struct Model {
    feature_dim: u16,
    n_offsets: u16,
    splats_per_anchor: f64,
}

/// The widths and the number of anchors that a device affords.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelChoice {
    /// Feature width F.
    pub feature_dim: usize,
    /// Offsets K of an anchor.
    pub n_offsets: usize,
    /// Anchors at most.
    pub max_anchors: usize,
    /// Weight of a value's bits in the loss.
    pub lambda: f64,
    /// The limit that caps the anchors.
    pub binding: BindingLimit,
}

/// No model fits.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "no scene worth drawing keeps the limit of {available} for {binding}; the smallest, of {FEWEST_ANCHORS} anchors, takes \
     about {needed}"
)]
pub struct Infeasible {
    /// Which limit.
    pub binding: BindingLimit,
    /// What it is.
    pub available: u64,
    /// The nearest that would do.
    pub needed: u64,
}

/// The widest model with anchors enough that fits, or the narrowest.
///
/// All of its anchors are to be drawn in two strips, decoded in every frame, so that a device of these limits gets the
/// whole scene, and a smaller one some tiers of it.
///
/// # Errors
/// [`Infeasible`] with the nearest limit that would do.
pub fn choose(limits: &Limits) -> Result<ModelChoice, Infeasible> {
    let [good, small] = RATES;
    let choice = choose_at(limits, good)?;
    if choice.binding == BindingLimit::Flash { choose_at(limits, small) } else { Ok(choice) }
}

fn choose_at(limits: &Limits, rate: RateWeight) -> Result<ModelChoice, Infeasible> {
    let of_models = MODELS.map(|model| (model, model.most_anchors(limits, rate)));
    let enough = of_models.iter().find(|(_, (n, _))| *n >= ENOUGH_ANCHORS);
    let [.., narrowest] = &of_models;
    let (model, (max_anchors, binding)) = *enough.unwrap_or(narrowest);
    if max_anchors < FEWEST_ANCHORS {
        return Err(model.infeasible(limits, rate, binding));
    }
    let Model { feature_dim, n_offsets, .. } = model;
    let RateWeight { lambda, .. } = rate;
    Ok(ModelChoice { feature_dim: feature_dim.into(), n_offsets: n_offsets.into(), max_anchors, lambda, binding })
}

impl Model {
    /// Anchors that keep all limits, and the binding one.
    fn most_anchors(&self, limits: &Limits, rate: RateWeight) -> (usize, BindingLimit) {
        let of_ram = limits.ram_bytes.map(|ram| self.anchors_in(ram));
        let of_flash =
            limits.flash_bytes.map(|flash| ((flash as f64 - FIXED_FLASH) / self.flash_per_anchor(rate)) as usize);
        let of_work = limits.processor.map(|processor| {
            (processor.frame_instructions() as f64 * SHARE_OF_ANCHORS / self.instructions_per_anchor()) as usize
        });
        let all = [(of_ram, BindingLimit::Ram), (of_flash, BindingLimit::Flash), (of_work, BindingLimit::Instructions)];
        let given = all.into_iter().filter_map(|(n, binding)| Some((n?, binding)));
        given.min_by_key(|(n, _)| *n).unwrap_or((usize::MAX, BindingLimit::Nothing))
    }

    /// Scratch memory of a decoder that draws `n` anchors in two strips.
    fn scratch_len(&self, n: usize) -> u64 {
        let splats = n as f64 * self.splats_per_anchor * SHARE_OF_TWO_STRIPS;
        let mut shape = ScratchShape::most(self.feature_dim, self.n_offsets);
        shape.model.n_geometry_inputs = 3;
        shape.model.n_colour_inputs = 3;
        shape.model.colour_hidden = self.feature_dim;
        shape.model.detail_hidden = 0;
        // A sixteenth more than measured, as plans have it.
        shape.frame.max_splats = (splats * 17.0 / 16.0) as u32;
        shape.scratch_len() as u64
    }

    /// The most anchors whose decoder takes at most `ram` bytes.
    fn anchors_in(&self, ram: u64) -> usize {
        let (mut fits, mut too_many) = (0_usize, 1 << 24);
        while too_many - fits > 1 {
            let middle = fits.midpoint(too_many);
            if self.scratch_len(middle) <= ram {
                fits = middle;
            } else {
                too_many = middle;
            }
        }
        fits
    }

    fn channels(&self) -> f64 {
        f64::from(self.feature_dim) + 6.0 + 3.0 * self.splats_per_anchor
    }

    fn flash_per_anchor(&self, rate: RateWeight) -> f64 {
        // A position takes as much as five channels.
        rate.bits * (self.channels() + 5.0) / 8.0
    }

    fn instructions_per_anchor(&self) -> f64 {
        let [f, k] = [self.feature_dim, self.n_offsets].map(f64::from);
        let macs = 3.0 * f * (f + 3.0) + f * k + 10.0 * f * self.splats_per_anchor;
        PER_MAC * macs * HEAD_PASSES + PER_SYMBOL * 2.0 * (self.channels() + 10.0)
    }

    /// The limit that leaves too few anchors, and what it would have to be.
    fn infeasible(&self, limits: &Limits, rate: RateWeight, binding: BindingLimit) -> Infeasible {
        let n = FEWEST_ANCHORS as f64;
        let (available, needed) = match binding {
            BindingLimit::Ram => (limits.ram_bytes, self.scratch_len(FEWEST_ANCHORS)),
            BindingLimit::Flash => (limits.flash_bytes, (FIXED_FLASH + self.flash_per_anchor(rate) * n).ceil() as u64),
            _ => {
                let needed = self.instructions_per_anchor() * n / SHARE_OF_ANCHORS;
                (limits.processor.map(Processor::frame_instructions), needed.ceil() as u64)
            }
        };
        Infeasible { binding, available: available.unwrap_or_default(), needed }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_chosen_model_keeps_its_limits_and_what_does_not_do_is_named(
            ram in 0_u64..4_000_000, flash in 0_u64..2_000_000,
            processor in prop::sample::select(Processor::ALL.to_vec())
        ) {
            let limits = Limits { ram_bytes: Some(ram), flash_bytes: Some(flash), processor: Some(processor), level: None };
            match choose(&limits) {
                Ok(choice) => {
                    let model = MODELS.into_iter().find(|m| usize::from(m.feature_dim) == choice.feature_dim).unwrap();
                    prop_assert!(choice.max_anchors >= FEWEST_ANCHORS);
                    prop_assert!(model.scratch_len(choice.max_anchors) <= ram);
                }
                Err(Infeasible { binding, available, needed }) => {
                    prop_assert!(needed > available);
                    let mut enough = limits;
                    match binding {
                        BindingLimit::Ram => enough.ram_bytes = Some(needed + 1),
                        BindingLimit::Flash => enough.flash_bytes = Some(needed + 1),
                        _ => prop_assert!(false, "every processor has time for the smallest scene: {needed}"),
                    }
                    let again = choose(&enough);
                    prop_assert!(again.as_ref().err().is_none_or(|error| error.binding != binding), "{again:?}");
                }
            }
        }

        #[test]
        fn more_memory_never_means_fewer_anchors_of_the_same_model(ram in 20_000_u64..2_000_000, more in 0_u64..500_000) {
            let of = |ram| choose(&Limits { ram_bytes: Some(ram), ..Limits::default() });
            if let (Ok(less), Ok(more)) = (of(ram), of(ram + more)) {
                prop_assert!(more.feature_dim > less.feature_dim || more.max_anchors >= less.max_anchors);
            }
        }
    }

    #[test]
    fn without_limits_the_widest_model_has_no_cap() {
        let choice = choose(&Limits::default()).unwrap();
        assert_eq!((choice.feature_dim, choice.max_anchors, choice.binding), (32, usize::MAX, BindingLimit::Nothing));
    }
}
