//! The rows of an ablation.

use pocketsplat_kernels::scene::ModelShape;
use pocketsplat_trainer::train::modules::Detail;

/// The row that all others are compared with.
pub(super) const BASELINE: &str = "none";

/// A way to train.
pub(super) struct Row {
    /// Name in tables, and of its folder.
    pub(super) name: &'static str,
    /// What it is, in a few words.
    pub(super) what: &'static str,
    pub(super) extent: Extent,
    /// Keys of the configuration by which it differs, each as `table.key=value`.
    pub(super) overrides: Vec<String>,
}

/// At which rates and seeds a row is trained.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Extent {
    /// At every rate, and with several seeds at one.
    SeededCurve,
    /// At every rate.
    Curve,
    /// At one rate.
    Option,
}

const DISTRIBUTION: &str = "train.modules.distribution={}";
const PRUNING: &str = "train.modules.pruning={}";
/// As `--modules tiered-pruning`.
const TIERED: &str = r#"train.modules.pruning={form="tiered", rate=0.4, rank="contribution", choice="lowest"}"#;
const DETAIL: &str = "train.modules.detail={}";
const RDO: &str = "train.modules.rdo={}";
/// Rates as the published trainers have them: features, log-scales and the covariance head at one rate to the end, the others
/// falling to a hundredth or less.
const PUBLISHED_RATES: [&str; 9] = [
    "train.rates.offset={start=0.01, end=1e-4, from=0}",
    "train.rates.feature.end=0.0075",
    "train.rates.log_scale.end=0.007",
    "train.rates.opacity_head={start=0.002, end=2e-5, from=0}",
    "train.rates.covariance_head.end=0.004",
    "train.rates.colour_head={start=0.008, end=5e-5, from=0}",
    "train.rates.grid={start=0.005, end=1e-5, from=0}",
    "train.rates.context={start=0.005, end=1e-5, from=0}",
    "train.hac.exact_from=0.95",
];

/// All rows: the curves, then the options of each module.
pub(super) fn rows(shape: &ModelShape) -> Vec<Row> {
    use Extent::{Curve, Option, SeededCurve};
    // As many more parameters as the detail head has, in units of the colour head.
    let hidden = Detail::default().hidden;
    let detail = hidden * (shape.feature_dim + 3 + 1) + 3 * (hidden + 1);
    let unit = shape.colour_inputs() + 1 + 3 * shape.n_offsets;
    let wide = format!("train.shape.colour_hidden={}", shape.colour_width() + detail.div_ceil(unit));

    let pruning = |key: &str| vec![PRUNING.to_owned(), format!("train.modules.pruning.{key}")];
    let tiered = |key: &str| vec![TIERED.to_owned(), format!("train.modules.pruning.{key}")];
    let keys = |keys: &[&str]| keys.iter().map(|key| (*key).to_owned()).collect();
    let row = |name, what, extent, overrides| Row { name, what, extent, overrides };
    vec![
        row(BASELINE, "the backbone alone", SeededCurve, vec![]),
        row("all", "all three modules", SeededCurve, keys(&[DISTRIBUTION, PRUNING, DETAIL])),
        row("distribution", "distribution regularisation alone", Curve, keys(&[DISTRIBUTION])),
        row("pruning", "hard pruning of 30 % alone", Curve, keys(&[PRUNING])),
        row("detail", "detail compensation alone", Curve, keys(&[DETAIL])),
        row(
            "rdo",
            "offsets and anchors that are not worth their bits go, in place of masks",
            SeededCurve,
            keys(&[RDO]),
        ),
        row("rdo-detail", "the same with detail compensation", Curve, keys(&[RDO, DETAIL])),
        row("published-rates", "the backbone with learning rates as published", Curve, keys(&PUBLISHED_RATES)),
        row(
            "distribution-strong",
            "both weights 0.01",
            Option,
            keys(&["train.modules.distribution={divergence=0.01, spread=0.01}"]),
        ),
        row("pruning-lowest", "the lowest 30 % instead of a random choice", Option, pruning("choice=lowest")),
        row("pruning-contribution", "ranked by contribution to the images", Option, pruning("rank=contribution")),
        row("pruning-no-target", "without the opacity target", Option, pruning("weight=0")),
        row("pruning-target", "the opacity target at the paper's weight", Option, pruning("weight=1e-5")),
        row("pruning-10", "10 %", Option, pruning("rate=0.1")),
        row("pruning-20", "20 %", Option, pruning("rate=0.2")),
        row("pruning-40", "40 %", Option, pruning("rate=0.4")),
        row("tiered", "tiers to 40 %, nothing deleted, by contribution", Option, keys(&[TIERED])),
        row("tiered-worth", "the same, ranked by error for each bit", Option, tiered("rank=worth")),
        row("tiered-random", "the same with the random choice", Option, tiered("choice=random")),
        row(
            "tiered-opacity",
            "the same, ranked by opacity",
            Option,
            keys(&[r#"train.modules.pruning={form="tiered", rate=0.4}"#]),
        ),
        row(
            "tiered-80",
            "tiers to 80 %",
            Option,
            [tiered("rate=0.8"), keys(&["encoding.tiers=[0.8, 0.6, 0.4, 0.2, 0.1, 0.0]"])].concat(),
        ),
        row("detail-free", "taught by the image's loss alone", Option, keys(&["train.modules.detail={weight=0}"])),
        row("wide-colour", "no detail head, a colour head with as many more parameters", Option, vec![wide]),
    ]
}

#[cfg(test)]
mod tests {
    use pocketsplat_trainer::train::TrainConfig;
    use pocketsplat_trainer::train::config::Backbone;
    use pocketsplat_trainer::train::modules::{Modules, Pruning};

    use super::rows;
    use crate::config::RunConfig;

    #[test]
    fn every_row_can_be_trained_and_tiered_is_the_preset() {
        let base = RunConfig { train: TrainConfig::of(Backbone::Hac), ..RunConfig::default() };
        for row in rows(&base.train.shape) {
            let config = base.with_keys(&row.overrides).unwrap();
            config.check().unwrap();
            assert_eq!(row.name == "none", config.train == base.train, "{}", row.name);
            if row.name == "tiered" {
                let preset = Modules { pruning: Some(Pruning::tiered()), ..Modules::default() };
                assert_eq!(config.train.modules, preset);
            }
        }
    }
}
