//! Plots of what runs recorded, as SVG that any browser shows.
//!
//! [`Recording`] reads a CSV file and tells by its header what it holds; `cells` refuses numbers that no figure can show. `learning` and
//! `rate_distortion` draw several of a kind into one figure, `cost` compares settings; `exposures` is of one run; `chart`, `marker` and
//! `labels` are what all share. No fonts are needed to draw: text stays text.

mod cells;
mod chart;
mod cost;
mod exposures;
mod labels;
mod learning;
mod marker;
mod names;
mod rate_distortion;
mod recording;
mod results;

pub(crate) use cells::{refuse_infinite, refused};
pub(crate) use chart::thousands;
pub(crate) use cost::{CostPanel, CostPoint, cost_svg};
pub(crate) use exposures::exposures_svg;
pub(crate) use learning::{learning_curve_svg, learning_curves_svg};
pub(crate) use names::names_of;
pub(crate) use rate_distortion::{SizeAxis, rate_distortion_svg};
pub(crate) use recording::{LearningRow, Recording};
pub(crate) use results::ResultRow;

/// Something with the name that a legend gives it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Named<T> {
    /// The name.
    pub name: String,
    /// The thing.
    pub what: T,
}

/// Each item once, in the order of first mention.
pub(crate) fn unique<T: PartialEq>(items: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut all = Vec::new();
    for item in items {
        if !all.contains(&item) {
            all.push(item);
        }
    }
    all
}

/// Items by name, names in the order of their first mention.
pub(crate) fn gathered<T>(items: impl IntoIterator<Item = (String, T)>) -> Vec<Named<Vec<T>>> {
    let mut all: Vec<Named<Vec<T>>> = Vec::new();
    for (name, item) in items {
        match all.iter_mut().find(|named| named.name == name) {
            Some(named) => named.what.push(item),
            None => all.push(Named { name, what: vec![item] }),
        }
    }
    all
}
