//! What hangs together in the middle of a scene.

use std::collections::BTreeMap;

use glam::DVec3;

use super::percentile;

/// Cells of a median distance, at most; fewer where there are few Gaussians, so that cells of a solid thing have neighbours.
const FINEST: f64 = 8.0;
const COARSEST: f64 = 2.0;
/// Nothing farther than so many median distances hangs together with anything.
const REACH: f64 = 100.0;
/// Cells up to so many apart along each axis hang together.
const GAP: i32 = 2;
/// Cells of less than this share of the typical cell's weight join nothing: mist.
const MIST_SHARE: f64 = 0.02;
/// A part beside the heaviest one belongs to the bulk if it has this share of the weight …
const PART_SHARE: f64 = 0.2;
/// … or this one, and its middle is no more median distances out than …
const NEAR_PART_SHARE: f64 = 0.01;
/// … this.
const NEAR_PART: f64 = 3.0;
/// A place is free if its cell and those beside it weigh less than so many typical cells: a wall has more, floaters have less.
const FREE_CELLS: f64 = 3.0;

/// Which Gaussians make the bulk, and where they are.
pub(super) struct Body {
    pub(super) members: Vec<usize>,
    pub(super) cells: Cells,
}

/// The occupied cells of a bulk.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cells {
    origin: DVec3,
    edge: f64,
    /// Weight of the cell in the middle of all weight.
    typical: f64,
    occupied: BTreeMap<[i32; 3], f64>,
}

impl Body {
    /// Weighted medians say where the middle is and how wide; cells of a part of that width which hang together make the body.
    ///
    /// `None` without weight, or where half of it is in one point.
    pub(super) fn of(centres: &[DVec3], weights: &[f64]) -> Option<Self> {
        let along = |axis: usize| centres.iter().map(|c| c[axis]).collect::<Vec<_>>();
        let origin = DVec3::from([0, 1, 2].map(|axis| percentile(&along(axis), weights, 0.5)));
        let distances: Vec<f64> = centres.iter().map(|c| c.distance(origin)).collect();
        let median = percentile(&distances, weights, 0.5);
        if !(median > 0.0 && median.is_finite()) {
            return None;
        }
        let per_median = ((centres.len() as f64).cbrt() / 1.5).clamp(COARSEST, FINEST);
        let edge = median / per_median;
        let mut cells = Cells { origin, edge, typical: 0.0, occupied: BTreeMap::new() };
        let within: Vec<usize> = (0..centres.len()).filter(|i| distances[*i] <= REACH * median).collect();
        for i in &within {
            *cells.occupied.entry(cells.of(centres[*i])).or_default() += weights[*i];
        }
        cells.clear_mist();
        let parts = cells.parts();
        let total: f64 = weights.iter().sum();
        let heaviest = parts.iter().map(|part| part.weight).fold(0.0, f64::max);
        let belongs = |part: &Part| {
            let near = (part.weighted_sum / part.weight).distance(origin) <= NEAR_PART * median;
            part.weight >= heaviest.min(PART_SHARE * total) || (near && part.weight >= NEAR_PART_SHARE * total)
        };
        cells.occupied = parts.into_iter().filter(belongs).flat_map(|part| part.cells).collect();
        let members = within.into_iter().filter(|i| cells.occupied.contains_key(&cells.of(centres[*i]))).collect();
        Some(Self { members, cells })
    }
}

/// Cells that hang together.
#[derive(Default)]
struct Part {
    cells: Vec<([i32; 3], f64)>,
    weight: f64,
    /// Σ weight · middle of the cell.
    weighted_sum: DVec3,
}

impl Cells {
    #[expect(clippy::cast_possible_truncation, reason = "within REACH · FINEST cells of the origin, else saturated")]
    fn of(&self, point: DVec3) -> [i32; 3] {
        ((point - self.origin) / self.edge).floor().to_array().map(|cell| cell as i32)
    }

    fn clear_mist(&mut self) {
        let cell_weights: Vec<f64> = self.occupied.values().copied().collect();
        self.typical = percentile(&cell_weights, &cell_weights, 0.5);
        let least = MIST_SHARE * self.typical;
        self.occupied.retain(|_, weight| *weight >= least);
    }

    fn parts(&self) -> Vec<Part> {
        let mut left = self.occupied.clone();
        let mut parts = Vec::new();
        while let Some(first) = left.pop_first() {
            let mut part = Part::default();
            let mut open = vec![first];
            while let Some((cell, weight)) = open.pop() {
                part.cells.push((cell, weight));
                part.weight += weight;
                let middle = self.origin + (DVec3::from(cell.map(f64::from)) + 0.5) * self.edge;
                part.weighted_sum += weight * middle;
                open.extend(around(cell, GAP).filter_map(|near| left.remove_entry(&near)));
            }
            parts.push(part);
        }
        parts
    }

    pub(super) fn is_free(&self, place: DVec3) -> bool {
        let weight = around(self.of(place), 1).filter_map(|near| self.occupied.get(&near)).sum::<f64>();
        weight < FREE_CELLS * self.typical
    }
}

/// A cell and those up to `reach` away along each axis.
fn around([x, y, z]: [i32; 3], reach: i32) -> impl Iterator<Item = [i32; 3]> {
    let span = move |middle: i32| middle.saturating_sub(reach)..=middle.saturating_add(reach);
    span(x).flat_map(move |x| span(y).flat_map(move |y| span(z).map(move |z| [x, y, z])))
}
