//! Changes to the anchors of a run: growth, pruning, and the changes that modules return.

use super::learned::Learned;
use super::trainer::Trainer;
use crate::train::config::{Backbone, Densification};
use crate::train::density::{Visibility, densify};
use crate::train::error::TrainError;
use crate::train::limits::Fit;
use crate::train::modules::AnchorChange;
use crate::train::streams;

impl Trainer<'_> {
    /// Statistics of the step, and growth and pruning when they are due.
    pub(super) fn densify(&mut self, on_device: bool) -> Result<(), TrainError> {
        let settings = self.setup.config.densification;
        let until = self.setup.config.iteration_at(settings.until);
        let from = self.setup.config.iteration_at(settings.statistics_from);
        if self.state.iteration >= until
            || self.state.iteration <= from
            || self.setup.config.pauses_at(self.state.iteration)
        {
            return Ok(());
        }
        if on_device {
            self.count_on_device()?;
        } else {
            self.state.learned.statistics.add(&self.machine.device.workspace, self.setup.config.shape.n_offsets);
        }
        let due = self.state.iteration.is_multiple_of(settings.interval);
        if due && self.state.iteration > self.setup.config.iteration_at(settings.from) {
            self.take_back()?;
            let coarsest_cells = self.setup.config.coarsest_cells_for(self.setup.capture);
            let luck = streams::growth(self.setup.config.seed, self.state.iteration);
            let Learned { scene, optimiser, statistics, .. } = &mut self.state.learned;
            densify::grow(scene, optimiser, statistics, &settings, coarsest_cells, luck);
            densify::prune(scene, optimiser, statistics, &settings);
            self.weigh_views();
        }
        Ok(())
    }

    /// Whether growth ends with this iteration; the first one where there is no growth.
    pub(super) fn ends_growth(&self) -> bool {
        self.state.iteration == self.setup.config.iteration_at(self.setup.config.densification.until).max(1)
    }

    /// When growth ends: drops all but the anchors that contribute most to the training views, where a number is set.
    pub(super) fn keep_the_best(&mut self) {
        let Densification { kept_anchors, .. } = self.setup.config.densification;
        let Some(most) = kept_anchors.filter(|most| *most < self.scene().anchors.len()) else { return };
        if self.ends_growth() {
            let Visibility { contribution, .. } = self.view().visibility(true);
            let mut order: Vec<usize> = (0..contribution.len()).collect();
            order.sort_by(|a, b| contribution[*b].total_cmp(&contribution[*a]));
            let mut keep = vec![false; contribution.len()];
            order[..most].iter().for_each(|anchor| keep[*anchor] = true);
            self.keep_anchors(&keep);
        }
    }

    /// When growth ends: where anchors follow anchors, they do so inside the tiers that the bundle will have.
    pub(super) fn rank_for_levels(&mut self) -> Result<(), TrainError> {
        let is_contextgs = self.setup.config.backbone == Backbone::ContextGs;
        if self.ends_growth() && is_contextgs && self.scene().anchors.prune_rank.is_empty() {
            let importance = self.probe(self.scene()).importance()?;
            let mut order: Vec<usize> = (0..importance.len()).collect();
            order.sort_by(|a, b| importance[*a].total_cmp(&importance[*b]));
            let mut ranks = vec![0.0; order.len()];
            for (place, anchor) in order.iter().enumerate() {
                ranks[*anchor] = place as f32 / order.len() as f32;
            }
            self.state.learned.scene.anchors.prune_rank = ranks;
        }
        Ok(())
    }

    /// Applies the change of a module; returns how the scene fits its limits, where the module made it fit.
    pub(super) fn change_anchors(&mut self, change: AnchorChange) -> Option<Fit> {
        match change {
            AnchorChange::Keep(keep) => self.keep_anchors(&keep),
            AnchorChange::Mask(offsets) => self.mask_offsets(&offsets),
            AnchorChange::Rank(ranks) => self.state.learned.scene.anchors.prune_rank = ranks,
            AnchorChange::Fit { masked, found } => {
                self.mask_offsets(&masked);
                self.state.learned.lambda = found.lambda;
                return Some(found);
            }
        }
        None
    }

    /// Switches offsets off, counted through all anchors', and drops the anchors that have none left.
    fn mask_offsets(&mut self, offsets: &[usize]) {
        self.state.learned.scene.anchors.mask(offsets);
        let keep: Vec<bool> = (0..self.scene().anchors.len()).map(|a| self.scene().anchors.has_drawn(a)).collect();
        self.keep_anchors(&keep);
    }

    /// Drops the anchors that `keep` does not mark.
    pub fn keep_anchors(&mut self, keep: &[bool]) {
        let Learned { scene, optimiser, statistics, .. } = &mut self.state.learned;
        densify::retain(scene, optimiser, statistics, keep);
    }
}
