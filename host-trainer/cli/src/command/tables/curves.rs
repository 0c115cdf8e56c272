//! Measured runs as curves: by dataset and size of the images, scene, method, rate and seed, in the order of the plan.

use pocketsplat_metrics::RatePoint;

use super::finished::FinishedRun;
use crate::command::workflow::{Place, Plan};
use crate::plot::{ResultRow, unique};
use crate::program;

/// A dataset at one size of its images.
pub(super) struct Group<'a> {
    pub(super) dataset: &'a str,
    pub(super) size: &'a str,
    /// All that the plan has, measured or not.
    pub(super) scenes: Vec<SceneCurves<'a>>,
}

/// A scene of a group.
pub(super) struct SceneCurves<'a> {
    pub(super) name: &'a str,
    pub(super) methods: Vec<Curve<'a>>,
}

/// A method on a scene.
pub(super) struct Curve<'a> {
    pub(super) method: &'a str,
    pub(super) rates: Vec<Rate<'a>>,
}

/// A rate of a curve.
pub(super) struct Rate<'a> {
    pub(super) name: &'a str,
    /// Seed and run of those that are measured; there may be none.
    pub(super) seeds: Vec<(u64, &'a FinishedRun<'a>)>,
}

/// The plan's groups, with what is measured.
pub(super) fn groups<'a>(plan: &'a Plan, runs: &'a [FinishedRun<'a>]) -> Vec<Group<'a>> {
    let mut groups: Vec<Group<'a>> = Vec::new();
    for place in plan.runs.iter().map(|run| &run.place) {
        let group = found(
            &mut groups,
            |g| (g.dataset, g.size) == (&place.dataset, &place.size),
            || Group { dataset: &place.dataset, size: &place.size, scenes: Vec::new() },
        );
        let scene = found(
            &mut group.scenes,
            |s| s.name == place.scene,
            || SceneCurves { name: &place.scene, methods: Vec::new() },
        );
        let curve = found(
            &mut scene.methods,
            |c| c.method == place.method,
            || Curve { method: &place.method, rates: Vec::new() },
        );
        let rate = found(&mut curve.rates, |r| r.name == place.rate, || Rate { name: &place.rate, seeds: Vec::new() });
        let measured = runs.iter().find(|run: &&FinishedRun<'_>| std::ptr::eq::<Place>(run.place, place));
        rate.seeds.extend(measured.map(|run| (place.seed, run)));
    }
    groups
}

/// The item that is meant, at its first mention put at the end.
fn found<T>(items: &mut Vec<T>, is_it: impl Fn(&T) -> bool, new: impl FnOnce() -> T) -> &mut T {
    let at = items.iter().position(is_it).unwrap_or_else(|| {
        items.push(new());
        items.len() - 1
    });
    &mut items[at]
}

impl Group<'_> {
    /// Sizes of the images that were measured, in pixels, as one text.
    pub(super) fn sizes_px(&self) -> String {
        let rates = self.scenes.iter().flat_map(|scene| &scene.methods).flat_map(|curve| &curve.rates);
        let mut sizes: Vec<[u32; 2]> = rates.flat_map(|rate| &rate.seeds).map(|(_, run)| run.size_px()).collect();
        sizes.sort_unstable();
        sizes.dedup();
        sizes.iter().map(|[width, height]| format!("{width}×{height}")).collect::<Vec<_>>().join(" and ")
    }

    /// What files of the group are called.
    pub(super) fn name(&self) -> String {
        if self.size.is_empty() { self.dataset.to_owned() } else { format!("{}-{}px", self.dataset, self.size) }
    }

    /// How many of these scenes the plan has.
    pub(super) fn n_of(&self, names: &[&str]) -> usize {
        names.iter().filter(|name| self.scenes.iter().any(|scene| scene.name == **name)).count()
    }

    /// The methods of the plan, in its order.
    pub(super) fn methods(&self) -> Vec<&str> {
        unique(self.scenes.iter().flat_map(|scene| &scene.methods).map(|curve| curve.method))
    }
}

impl Curve<'_> {
    /// The curves of single seeds, of those that are measured at every rate.
    pub(super) fn of_seeds(&self) -> Vec<Vec<RatePoint>> {
        let Some(first) = self.rates.first() else { return Vec::new() };
        let of_seed = |seed: u64| {
            let points = self.rates.iter().map(|rate| rate.seeds.iter().find(|(other, _)| *other == seed));
            points.map(|run| run.map(|(_, run)| point(run))).collect::<Option<Vec<_>>>()
        };
        first.seeds.iter().filter_map(|(seed, _)| of_seed(*seed)).collect()
    }
}

impl Rate<'_> {
    /// Means over the seeds that are measured; none without any.
    pub(super) fn mean(&self) -> Option<ResultRow> {
        let rows: Vec<ResultRow> = self.seeds.iter().map(|(_, run)| row(self.name, run)).collect();
        mean(self.name, &rows)
    }
}

fn point(run: &FinishedRun<'_>) -> RatePoint {
    RatePoint { size_bytes: run.evaluation.bundle_bytes as f64, psnr_db: run.evaluation.psnr_db }
}

/// A run as a row of results.
pub(super) fn row(rate: &str, run: &FinishedRun<'_>) -> ResultRow {
    run.evaluation.result_row(rate.to_owned())
}

/// Means of rows; of LPIPS where all have it. None without rows.
pub(super) fn mean(name: &str, rows: &[ResultRow]) -> Option<ResultRow> {
    let average = |value: fn(&ResultRow) -> Option<f64>| {
        let values = rows.iter().map(value).collect::<Option<Vec<f64>>>()?;
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    };
    Some(ResultRow {
        submethod: name.to_owned(),
        psnr_db: average(|row| Some(row.psnr_db))?,
        ssim: average(|row| row.ssim),
        lpips: average(|row| row.lpips),
        size_bytes: average(|row| Some(row.size_bytes))?,
        n_gaussians: average(|row| row.n_gaussians),
        program: Some(program::of_all(rows.iter().filter_map(|row| row.program.as_deref()))),
    })
}
