//! The parameters of decoder-core, each by itself, and those of quality together.

use super::ArithmeticChoice;
use pocketsplat_core::{Budget, Bundle, Plan, Quality, Residency, Strips};

/// One way to draw a bundle.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// Which parameter varies; `quality` for several at once, `level` for those that have a name.
    pub parameter: &'static str,
    /// Its value, in words.
    pub name: String,
    /// Accuracy.
    pub quality: Quality,
    /// Tiers that are drawn at most.
    pub tiers: u8,
    /// Share of the anchors that this leaves out.
    pub pruning_rate: f64,
    /// Where anchors wait.
    pub residency: Residency,
    /// Parts of a frame.
    pub strips: Strips,
    /// What it is computed with.
    pub arithmetic: ArithmeticChoice,
}

impl Setting {
    /// As trained, and as the budget plans it.
    pub fn exact(arithmetic: ArithmeticChoice) -> Self {
        Self {
            parameter: "level",
            name: "exact".to_owned(),
            quality: Quality::EXACT,
            tiers: u8::MAX,
            pruning_rate: 0.0,
            residency: Residency::Auto,
            strips: Strips::Auto,
            arithmetic,
        }
    }

    /// Whether a plan has the tiers, the strips and the sums that are asked for: in little memory a plan leaves out more anchors, draws in
    /// more strips, or keeps no sums.
    pub fn is_kept_by(&self, plan: &Plan) -> bool {
        let has_tiers = self.tiers == u8::MAX || self.tiers == plan.n_tiers();
        let has_strips = match self.strips {
            Strips::Exactly(n) => n == plan.n_strips(),
            _ => true,
        };
        has_tiers && has_strips && (self.residency != Residency::AutoWithSums || plan.keeps_sums())
    }

    /// `budget` with these parameters.
    pub fn of(&self, budget: Budget) -> Budget {
        budget.with_tiers(self.tiers).with_quality(self.quality).with_residency(self.residency).with_strips(self.strips)
    }
}

/// Alphas to cut at, 255ths.
const ALPHA_CUTS: [u8; 5] = [2, 3, 4, 6, 8];

/// The share of the anchors that the first `tiers` tiers leave out.
pub(super) fn pruning_rate(bundle: &Bundle<'_>, tiers: u8) -> Option<f64> {
    let tier = bundle.tier(tiers.checked_sub(1)?)?;
    Some(1.0 - f64::from(tier.n_anchors) / f64::from(bundle.n_anchors().max(1)))
}

/// Each parameter by itself, [exact](Setting::exact) first.
pub fn parameters(bundle: &Bundle<'_>, arithmetic: ArithmeticChoice) -> Vec<Setting> {
    let exact = Setting::exact(arithmetic);
    let mut all = vec![exact.clone()];
    for (name, quality) in [("balanced", Quality::BALANCED), ("draft", Quality::DRAFT)] {
        all.push(Setting { parameter: "level", name: name.to_owned(), quality, ..exact.clone() });
    }
    for alpha_cut in ALPHA_CUTS {
        let quality = Quality { alpha_cut, ..Quality::EXACT };
        all.push(Setting { parameter: "alpha cut", name: format!("{alpha_cut}/255"), quality, ..exact.clone() });
    }
    if bundle.header().detail_hidden > 0 {
        let quality = Quality { detail: false, ..Quality::EXACT };
        all.push(Setting { parameter: "detail head", name: "off".to_owned(), quality, ..exact.clone() });
    }
    for tiers in (1..bundle.n_tiers()).rev() {
        let Some(pruning_rate) = pruning_rate(bundle, tiers) else { continue };
        let name = format!("{:.0} %", 100.0 * pruning_rate);
        all.push(Setting { parameter: "pruning rate", name, tiers, pruning_rate, ..exact.clone() });
    }
    let baked = bundle.n_gaussians(0).map(|_| ("baked", Residency::Baked));
    let anchors =
        [("with sums", Residency::AutoWithSums), ("resident", Residency::Resident), ("streamed", Residency::Streamed)];
    for (name, residency) in baked.into_iter().chain(anchors) {
        let strips = Strips::Exactly(1);
        all.push(Setting { parameter: "residency", name: name.to_owned(), residency, strips, ..exact.clone() });
    }
    for n_strips in [2, 4, 8] {
        let strips = Strips::Exactly(n_strips);
        all.push(Setting { parameter: "strips", name: n_strips.to_string(), strips, ..exact.clone() });
    }
    let (name, arithmetic) = match arithmetic {
        ArithmeticChoice::Reference => ("without FPU", ArithmeticChoice::WithoutFpu),
        ArithmeticChoice::WithoutFpu => ("reference", ArithmeticChoice::Reference),
    };
    all.push(Setting { parameter: "arithmetic", name: name.to_owned(), arithmetic, ..exact });
    all
}

/// Alpha cuts, the detail head and the first tiers in all combinations.
pub fn quality_grid(bundle: &Bundle<'_>, arithmetic: ArithmeticChoice) -> Vec<Setting> {
    let details: &[bool] = if bundle.header().detail_hidden > 0 { &[true, false] } else { &[true] };
    let mut all = Vec::new();
    for tiers in (1..=bundle.n_tiers()).rev() {
        let Some(pruning_rate) = pruning_rate(bundle, tiers) else { continue };
        for alpha_cut in [1, 2, 3, 4, 6, 8] {
            for &detail in details {
                let no_detail = if detail { "" } else { ", no detail" };
                let name = format!("{:.0} % pruned, alpha {alpha_cut}/255{no_detail}", 100.0 * pruning_rate);
                let quality = Quality { alpha_cut, detail };
                all.push(Setting {
                    parameter: "quality",
                    name,
                    quality,
                    tiers,
                    pruning_rate,
                    ..Setting::exact(arithmetic)
                });
            }
        }
    }
    all
}
