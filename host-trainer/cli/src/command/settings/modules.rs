//! What `--modules` names.

use anyhow::{Result, bail};
use pocketsplat_trainer::train::modules::pruning::Rank;
use pocketsplat_trainer::train::modules::{Distribution, Modules, Pruning, Rdo};

/// A training module as `--modules` names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum TrainingModule {
    /// No module.
    None,
    /// Distribution regularisation: features near a normal distribution.
    Distribution,
    /// Pruning that deletes 30 % of the anchors half-way.
    HardPruning,
    /// Pruning that deletes nothing and trains one scene for every pruning rate up to 40 %.
    TieredPruning,
    /// Pruning of the offsets and anchors that are not worth their bits, in place of learned masks; needs a backbone that is trained
    /// for size.
    RdoPruning,
}

/// Tiers beside the other modules: after the last rate–distortion pruning, ranked by worth.
pub(in crate::command) fn tiers_of(modules: &Modules) -> Pruning {
    let tiered = Pruning::tiered();
    modules.rdo.map_or(tiered, |rdo| Pruning { at: rdo.until, rank: Rank::Worth, ..tiered })
}

/// Attaches these training modules with their defaults in place of those that are attached; effects stay.
pub(super) fn attach(modules: &mut Modules, names: &[TrainingModule]) -> Result<()> {
    let named = |module| names.contains(&module);
    modules.distribution = named(TrainingModule::Distribution).then(Distribution::default);
    modules.rdo = named(TrainingModule::RdoPruning).then(Rdo::default);
    modules.pruning = match (named(TrainingModule::HardPruning), named(TrainingModule::TieredPruning)) {
        (true, true) => bail!("--modules names hard-pruning and tiered-pruning, needs one of the two at most"),
        (true, false) => Some(Pruning::default()),
        (false, true) => Some(tiers_of(modules)),
        (false, false) => None,
    };
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_ranks_tiers_follows_pruning_by_worth() {
        let mut modules = Modules { rdo: None, ..Modules::default() };
        assert_eq!(tiers_of(&modules), Pruning::tiered());
        modules.rdo = Some(Rdo::default());
        let tiers = tiers_of(&modules);
        assert_eq!((tiers.at, tiers.rank), (Rdo::default().until, Rank::Worth));
    }
}
