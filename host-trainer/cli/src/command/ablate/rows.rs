//! The rows of an ablation.

use anyhow::Result;
use pocketsplat_trainer::train::module::Detail;

use crate::command::run_config::RunConfig;

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
    modules: &'static [&'static str],
    /// Keys of the configuration by which it differs.
    keys: Vec<String>,
}

impl Row {
    /// `base` as the row has it.
    pub(super) fn applied_to(&self, base: &RunConfig) -> Result<RunConfig> {
        let mut config = base.clone();
        for module in self.modules {
            config.train.modules.attach(module);
        }
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

/// All rows: the curves, then the options of each module.
pub(super) fn rows() -> Vec<Row> {
    let curve =
        |name, what, modules, with_seeds| Row { name, what, at_all_rates: true, with_seeds, modules, keys: vec![] };
    let mut rows = vec![
        curve("none", "the backbone alone", &[][..], true),
        curve("all", "all three modules", &["distribution", "pruning", "detail"], true),
        curve("distribution", "distribution regularisation alone", &["distribution"], false),
        curve("pruning", "hard pruning of 30 % alone", &["pruning"], false),
        curve("detail", "detail compensation alone", &["detail"], false),
    ];
    let distribution: &[_] = &[("distribution-strong", "both weights 0.01", "divergence=0.01 spread=0.01")];
    let pruning: &[_] = &[
        ("pruning-lowest", "the lowest 30 % instead of a random choice", "choice=lowest"),
        ("pruning-contribution", "ranked by contribution to the images", "rank=contribution"),
        ("pruning-no-target", "without the opacity target", "weight=0"),
        ("pruning-target", "the opacity target at the paper's weight", "weight=1e-5"),
        ("pruning-10", "10 %", "rate=0.1"),
        ("pruning-20", "20 %", "rate=0.2"),
        ("pruning-40", "40 %", "rate=0.4"),
        (
            "tiered",
            "tiers to 40 %, nothing deleted, by contribution",
            "form=tiered rate=0.4 rank=contribution choice=lowest",
        ),
        ("tiered-random", "the same with the random choice", "form=tiered rate=0.4 rank=contribution"),
        ("tiered-opacity", "the same, ranked by opacity", "form=tiered rate=0.4"),
        ("tiered-80", "tiers to 80 %", "form=tiered rate=0.8 rank=contribution choice=lowest"),
    ];
    let detail: &[_] = &[("detail-free", "taught by the image's loss alone", "weight=0")];
    for (module, options) in [("distribution", distribution), ("pruning", pruning), ("detail", detail)] {
        for (name, what, settings) in options {
            let modules: &'static [&'static str] = match module {
                "distribution" => &["distribution"],
                "pruning" => &["pruning"],
                _ => &["detail"],
            };
            let mut keys: Vec<String> =
                settings.split(' ').map(|setting| format!("train.modules.{module}.{setting}")).collect();
            if *name == "tiered-80" {
                keys.push("encoding.tiers=[0.8, 0.6, 0.4, 0.2, 0.1, 0.0]".to_owned());
            }
            rows.push(Row { name, what, at_all_rates: false, with_seeds: false, modules, keys });
        }
    }
    rows.push(Row {
        name: WIDE,
        what: "no detail head, a colour head with as many more parameters",
        at_all_rates: false,
        with_seeds: false,
        modules: &[],
        keys: vec![],
    });
    rows
}
