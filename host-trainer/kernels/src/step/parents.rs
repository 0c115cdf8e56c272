//! Which anchors follow which, and what those that are followed give (Wang et al. 2024, ContextGS, section 4).

use pocketsplat_format::bundle::MAX_LATTICE_BITS;
use pocketsplat_format::context::{
    Context, FEATURE_ONE, GridFrame, Group, N_LEVELS, Network, PARENT_UNITS, Place, Steps, Trail,
};
use rayon::prelude::*;

use crate::ops::rate::file_order::{self, CHUNK_ANCHORS, PRUNING_RATES};
use crate::ops::rate::perturb;
use crate::real::Real;
use crate::scene::{Anchors, ModelShape, Scene};

/// The levels of the anchors of a scene; empty where its context is a grid.
#[derive(Clone, Debug, Default)]
pub struct Parents<R> {
    /// `[n]` as a decoder finds them, of the tiers that are written by default if the anchors are ranked, else of one; invisible
    /// anchors stand apart at level 2.
    places: Vec<Place>,
    /// `[n]` the anchor that each follows.
    parents: Vec<u32>,
    /// `[n, F + log-scales]` inputs that an anchor is to those that follow it, a share of [`PARENT_UNITS`] base steps each; of no
    /// meaning at level 0.
    given: Vec<R>,
    /// What the places were computed from: lattice cells, whether anything of an anchor is drawn, and ranks.
    known: (Vec<[i32; 3]>, Vec<bool>, Vec<f32>),
}

impl<R: Real> Parents<R> {
    /// Finds the places where anchors or masks have changed.
    ///
    /// Cost: sorts the anchors.
    pub fn update(&mut self, shape: &ModelShape, anchors: &Anchors<R>, shifts: [u8; N_LEVELS], frame: &GridFrame) {
        let n = anchors.len();
        let drawn: Vec<bool> = (0..n).map(|a| anchors.has_drawn(a)).collect();
        if self.known.0 == anchors.lattice && self.known.1 == drawn && self.known.2 == anchors.prune_rank {
            return;
        }
        self.given.clear();
        self.given.resize(n * (shape.feature_dim + shape.n_log_scales()), R::ZERO);
        self.places = vec![Place { level: N_LEVELS - 1, ..Place::default() }; n];
        self.parents = (0..).take(n).collect();
        for chunk in chunks(anchors, &drawn, shifts) {
            let mut trail = Trail::default();
            // The anchors that began the current cells of levels 1 and 2.
            let mut begun = [0; 2];
            for a in chunk {
                let anchor = u32::try_from(a).expect("fewer than 2³² anchors");
                let place = trail.next(shifts, frame, anchors.lattice[a]);
                self.places[a] = place;
                match place.level {
                    0 => self.parents[a] = begun[0],
                    1 => (self.parents[a], begun[0]) = (begun[1], anchor),
                    _ => begun = [anchor; 2],
                }
            }
        }
        self.known = (anchors.lattice.clone(), drawn, anchors.prune_rank.clone());
    }

    /// The level of an anchor; 0 where the context is a grid.
    pub fn level(&self, anchor: u32) -> usize {
        self.places.get(anchor as usize).map_or(0, |place| place.level)
    }

    /// Where each anchor stands, and the one that it follows.
    pub fn places(&self) -> impl Iterator<Item = (Place, u32)> {
        self.places.iter().copied().zip(self.parents.iter().copied())
    }

    /// The visible anchors of a level, ascending.
    pub fn of_level(&self, level: usize) -> Vec<u32> {
        let at = (0u32..).zip(&self.places).zip(&self.known.1);
        at.filter(|((_, place), drawn)| place.level == level && **drawn).map(|((a, _), _)| a).collect()
    }

    /// What anchor `anchor` gives.
    pub fn given_mut(&mut self, anchor: u32) -> &mut [R] {
        let width = self.given.len() / self.places.len().max(1);
        &mut self.given[anchor as usize * width..][..width]
    }

    /// What the parent of `anchor` gives.
    fn of_parent(&self, anchor: u32) -> &[R] {
        let width = self.given.len() / self.places.len().max(1);
        &self.given[self.parents[anchor as usize] as usize * width..][..width]
    }

    /// Appends the inputs of the float network of its level for an anchor.
    pub fn push_inputs(&self, anchor: u32, inputs: &mut Vec<R>) {
        let place = self.places[anchor as usize];
        inputs.extend(place.position.map(|part| R::real(f64::from(part) / f64::from(FEATURE_ONE))));
        if place.level + 1 < N_LEVELS {
            inputs.extend_from_slice(self.of_parent(anchor));
        }
    }

    /// The integer network that an anchor has, and its inputs.
    ///
    /// * `inputs`: `[n_inputs]`, filled.
    pub fn enter<'c, 'a>(
        &self,
        context: &'c Context<'a>,
        anchor: u32,
        cell: [i32; 3],
        inputs: &mut [i16],
    ) -> Network<'c, 'a> {
        if context.level_shifts().is_none() {
            context.features(cell, inputs);
            return context.network(0);
        }
        let place = self.places[anchor as usize];
        #[expect(clippy::cast_possible_truncation, reason = "integers of 2⁻¹⁴ up to one")]
        let integer = |share: &R| ((*share).into() * f64::from(FEATURE_ONE)).round() as i16;
        let parent: Vec<i16> = self.of_parent(anchor).iter().map(integer).collect();
        context.follow(&place, &parent, inputs);
        context.network(place.level)
    }

    /// Fills what anchors give, as the integers have it.
    pub fn of_integers(scene: &Scene<R>, context: &Context<'_>) -> Self {
        let mut parents = Self::default();
        let Some(shifts) = context.level_shifts() else { return parents };
        parents.update(&scene.shape, &scene.anchors, shifts, &context.frame());
        for level in (1..N_LEVELS).rev() {
            let anchors = parents.of_level(level);
            let given: Vec<Vec<R>> = anchors
                .par_iter()
                .map(|anchor| {
                    let steps = parents.steps(context, scene, *anchor);
                    let (f, s) = (scene.shape.feature_dim, scene.shape.n_log_scales());
                    let a = *anchor as usize;
                    let values = [&scene.anchors.features[a * f..][..f], &scene.anchors.log_scales[a * s..][..s]];
                    let mut given = Vec::with_capacity(f + s);
                    for (group, values) in [Group::Feature, Group::LogScale].into_iter().zip(values) {
                        give_symbols(&steps, group, values, &mut given);
                    }
                    given
                })
                .collect();
            for (anchor, given) in anchors.into_iter().zip(given) {
                parents.given_mut(anchor).copy_from_slice(&given);
            }
        }
        parents
    }

    /// The steps of an anchor as the integers have them; after [`Self::of_integers`].
    pub fn steps(&self, context: &Context<'_>, scene: &Scene<R>, anchor: u32) -> Steps {
        let (mut inputs, mut hidden) = (vec![0; context.n_inputs()], vec![0; context.n_hidden()]);
        let network = self.enter(context, anchor, scene.anchors.lattice[anchor as usize], &mut inputs);
        network.hidden(&inputs, &mut hidden);
        network.steps(&hidden)
    }
}

/// Appends what values give that are rounded by the steps of the integers.
pub(super) fn give_symbols<R: Real>(steps: &Steps, group: Group, values: &[R], given: &mut Vec<R>) {
    let step = R::real(steps.value(group).into());
    let limit = R::real(f64::from(i16::MAX));
    given.extend(values.iter().map(|value| {
        let symbol: f64 = perturb::symbol(*value, step).smaller(limit).larger(-limit).into();
        #[expect(clippy::cast_possible_truncation, reason = "an i16")]
        let input = steps.of(group).parent_input(group, symbol as i32);
        R::real(f64::from(input) / f64::from(FEATURE_ONE))
    }));
}

/// Appends what values give that are not rounded.
pub(super) fn give_values<R: Real>(base_step: f32, group: usize, values: &[R], given: &mut Vec<R>) {
    let unit = R::real(f64::from(base_step) * f64::from(PARENT_UNITS[group]));
    given.extend(values.iter().map(|value| (*value / unit).smaller(R::ONE).larger(-R::ONE)));
}

/// The visible anchors chunk by chunk, as they are written by default.
fn chunks<R>(anchors: &Anchors<R>, drawn: &[bool], [_, shift, _]: [u8; N_LEVELS]) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..anchors.len()).filter(|a| drawn[*a]).collect();
    let along = |axis: usize| order.iter().map(move |a| anchors.lattice[*a][axis]);
    let min: [i32; 3] = std::array::from_fn(|axis| file_order::aligned(along(axis).min().unwrap_or_default(), shift));
    let code = |a: &usize| {
        let cell = anchors.lattice[*a];
        file_order::code(std::array::from_fn(|axis| cell[axis].abs_diff(min[axis])), MAX_LATTICE_BITS.into())
    };
    let mut ends = vec![order.len()];
    if !anchors.prune_rank.is_empty() {
        order.sort_by_cached_key(code);
        file_order::sort_by_importance(&mut order, &anchors.prune_rank);
        ends = file_order::tier_ends(order.len(), &PRUNING_RATES);
    }
    let (chunks, _) = file_order::cut(&mut order, &ends, CHUNK_ANCHORS.into(), code);
    chunks.into_iter().map(|chunk| order[chunk].to_vec()).collect()
}
