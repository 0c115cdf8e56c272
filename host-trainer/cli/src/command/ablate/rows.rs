//! The rows of an ablation.

use anyhow::Result;
use pocketsplat_trainer::train::module::{Detail, Distribution, Modules, Pruning};

use crate::config::RunConfig;

/// A way to train.
pub(super) struct Row {
    /// Name in tables, and of its folder.
    pub(super) name: &'static str,
    /// What it is, in a few words.
    pub(super) what: &'static str,
    /// A curve, not a point.
    pub(super) at_all_rates: bool,
    /// Trained with several seeds at one rate.
    pub(super) with_seeds: bool,
    modules: Modules,
    /// Keys of the configuration by which it differs.
    keys: Vec<String>,
}

impl Row {
    /// `base` as the row has it.
    pub(super) fn applied_to(&self, base: &RunConfig) -> Result<RunConfig> {
        let mut config = base.clone();
        config.train.modules = self.modules;
        let hidden = Detail::default().hidden;
        if self.name == WIDE {
            // As many more parameters as the detail head has, in units of the colour head.
            let shape = config.train.shape;
            let detail = hidden * (shape.feature_dim + 3 + 1) + 3 * (hidden + 1);
            let unit = shape.colour_inputs() + 1 + 3 * shape.n_offsets;
            config.train.shape.colour_hidden = shape.colour_width() + detail.div_ceil(unit);
        }
        if self.keys.is_empty() { Ok(config) } else { config.with_keys(&self.keys) }
    }
}

/// The control of the detail head.
const WIDE: &str = "wide-colour";
/// Tiers that the bundle has too.
const TIERED_80: &str = "tiered-80";

/// All rows: the curves, then the options of each module.
pub(super) fn rows() -> Vec<Row> {
    let none = Modules::default();
    let distribution = Modules { distribution: Some(Distribution::default()), ..none };
    let pruning = Modules { pruning: Some(Pruning::default()), ..none };
    let tiered = Modules { pruning: Some(Pruning::tiered()), ..none };
    let detail = Modules { detail: Some(Detail::default()), ..none };
    let all = Modules { pruning: pruning.pruning, detail: detail.detail, ..distribution };
    let curve =
        |name, what, modules, with_seeds| Row { name, what, at_all_rates: true, with_seeds, modules, keys: vec![] };
    let mut rows = vec![
        curve("none", "the backbone alone", none, true),
        curve("all", "all three modules", all, true),
        curve("distribution", "distribution regularisation alone", distribution, false),
        curve("pruning", "hard pruning of 30 % alone", pruning, false),
        curve("detail", "detail compensation alone", detail, false),
    ];
    let options: &[(&str, &str, Modules, &[&str])] = &[
        (
            "distribution-strong",
            "both weights 0.01",
            distribution,
            &["distribution.divergence=0.01", "distribution.spread=0.01"],
        ),
        ("pruning-lowest", "the lowest 30 % instead of a random choice", pruning, &["pruning.choice=lowest"]),
        ("pruning-contribution", "ranked by contribution to the images", pruning, &["pruning.rank=contribution"]),
        ("pruning-no-target", "without the opacity target", pruning, &["pruning.weight=0"]),
        ("pruning-target", "the opacity target at the paper's weight", pruning, &["pruning.weight=1e-5"]),
        ("pruning-10", "10 %", pruning, &["pruning.rate=0.1"]),
        ("pruning-20", "20 %", pruning, &["pruning.rate=0.2"]),
        ("pruning-40", "40 %", pruning, &["pruning.rate=0.4"]),
        ("tiered", "tiers to 40 %, nothing deleted, by contribution", tiered, &[]),
        ("tiered-random", "the same with the random choice", tiered, &["pruning.choice=random"]),
        ("tiered-opacity", "the same, ranked by opacity", tiered, &["pruning.choice=random", "pruning.rank=opacity"]),
        (TIERED_80, "tiers to 80 %", tiered, &["pruning.rate=0.8"]),
        ("detail-free", "taught by the image's loss alone", detail, &["detail.weight=0"]),
        (WIDE, "no detail head, a colour head with as many more parameters", none, &[]),
    ];
    for (name, what, modules, settings) in options {
        let mut keys: Vec<String> = settings.iter().map(|setting| format!("train.modules.{setting}")).collect();
        if *name == TIERED_80 {
            keys.push("encoding.tiers=[0.8, 0.6, 0.4, 0.2, 0.1, 0.0]".to_owned());
        }
        rows.push(Row { name, what, at_all_rates: false, with_seeds: false, modules: *modules, keys });
    }
    rows
}
