//! How many bytes each method takes against the plan's first.

use pocketsplat_metrics::{SeededDifference, bd_rate_over_seeds};
use serde::Serialize;

use super::curves::{Curve, Group, SceneCurves};
use super::finished::rounded;
use crate::plot::unique;

/// The scene of a mean over all.
const ALL: &str = "mean of all";

/// What stands above the lines of bd_rate.csv, where there are none to say it.
pub(super) const HEADER: &str = "dataset,size,scene,method,reference,seeds,reference_seeds,bd_rate_percent,low_percent,high_percent,\
    why_not,program\n";

/// One line of bd_rate.csv.
#[derive(Serialize)]
pub(super) struct BdRateLine<'a> {
    dataset: &'a str,
    size: &'a str,
    scene: &'a str,
    method: &'a str,
    reference: &'a str,
    /// Seeds that are measured at every rate, of the method and of the reference.
    seeds: usize,
    reference_seeds: usize,
    /// More bytes at equal PSNR; negative is better.
    bd_rate_percent: Option<f64>,
    /// Ends of its 95 % interval, where both have two seeds or more.
    low_percent: Option<f64>,
    high_percent: Option<f64>,
    /// Why there is no figure.
    why_not: String,
}

/// Every method but the first on every scene, and its mean where every scene has it, against one method.
pub(super) fn of_group<'a>(group: &Group<'a>) -> Vec<BdRateLine<'a>> {
    let scenes = group.scenes.iter().flat_map(|scene| of_scene(group, scene));
    let mut lines: Vec<BdRateLine<'_>> = scenes.collect();
    if group.scenes.len() > 1 {
        let methods = unique(lines.iter().map(|line| line.method));
        let means: Vec<_> = methods.into_iter().filter_map(|method| mean(group, method, &lines)).collect();
        lines.extend(means);
    }
    lines
}

fn of_scene<'a>(group: &Group<'a>, scene: &SceneCurves<'a>) -> Vec<BdRateLine<'a>> {
    // A method of one rate has no curve.
    let mut curves = scene.methods.iter().filter(|curve| curve.rates.len() > 1);
    let Some(reference) = curves.next() else { return Vec::new() };
    let of_reference = reference.of_seeds();
    let line = |curve: &Curve<'a>| {
        let own = curve.of_seeds();
        let found = bd_rate_over_seeds(&of_reference, &own);
        let why_not = match &found {
            _ if own.is_empty() || of_reference.is_empty() => "not all rates are measured yet".to_owned(),
            Ok(_) => String::new(),
            Err(error) => error.to_string(),
        };
        let found = found.ok();
        let end = |i: usize| found.and_then(|SeededDifference { interval, .. }| Some(rounded(interval?[i])));
        BdRateLine {
            dataset: group.dataset,
            size: group.size,
            scene: scene.name,
            method: curve.method,
            reference: reference.method,
            seeds: own.len(),
            reference_seeds: of_reference.len(),
            bd_rate_percent: found.map(|difference| rounded(difference.percent)),
            low_percent: end(0),
            high_percent: end(1),
            why_not,
        }
    };
    curves.map(line).collect()
}

fn mean<'a>(group: &Group<'a>, method: &'a str, lines: &[BdRateLine<'a>]) -> Option<BdRateLine<'a>> {
    let own: Vec<&BdRateLine<'_>> = lines.iter().filter(|line| line.method == method).collect();
    let rates = own.iter().map(|line| line.bd_rate_percent).collect::<Option<Vec<f64>>>()?;
    let has_one_reference = own.iter().all(|line| line.reference == own[0].reference);
    (rates.len() == group.scenes.len() && has_one_reference).then(|| BdRateLine {
        dataset: group.dataset,
        size: group.size,
        scene: ALL,
        method,
        reference: own[0].reference,
        seeds: own.iter().map(|line| line.seeds).min().unwrap_or(0),
        reference_seeds: own.iter().map(|line| line.reference_seeds).min().unwrap_or(0),
        bd_rate_percent: Some(rounded(rates.iter().sum::<f64>() / rates.len() as f64)),
        low_percent: None,
        high_percent: None,
        why_not: String::new(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(scene: &'static str, reference: &'static str, rate: f64) -> BdRateLine<'static> {
        BdRateLine {
            dataset: "D",
            size: "",
            scene,
            method: "contextgs",
            reference,
            seeds: 2,
            reference_seeds: 3,
            bd_rate_percent: Some(rate),
            low_percent: None,
            high_percent: None,
            why_not: String::new(),
        }
    }

    #[test]
    fn a_mean_is_against_one_method() {
        let scenes = ["a", "b"].map(|name| SceneCurves { name, methods: Vec::new() });
        let group = Group { dataset: "D", size: "", scenes: Vec::from(scenes) };
        let of_hac = [line("a", "hac", 20.0), line("b", "hac", 50.0)];
        assert_eq!(mean(&group, "contextgs", &of_hac).unwrap().bd_rate_percent, Some(35.0));
        assert!(mean(&group, "contextgs", &[line("a", "hac", 20.0), line("b", "hac-plus", 50.0)]).is_none());
        assert!(mean(&group, "contextgs", &of_hac[..1]).is_none(), "a scene lacks it");
    }

    #[test]
    fn the_columns_are_those_of_a_line() {
        let table = crate::command::output::csv_of("0.1.0 r1", [line("a", "hac", 20.0)]).unwrap();
        assert_eq!(table.split_inclusive(|byte| *byte == b'\n').next(), Some(HEADER.as_bytes()));
    }
}
