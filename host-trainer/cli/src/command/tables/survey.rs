//! Tables in the columns of the 3DGS compression survey (Bagdasarian et al. 2024, "3DGS.zip"), and their figures.

use std::path::Path;

use anyhow::Result;
use pocketsplat_files::Outputs;
use serde::Serialize;

use super::curves::{Curve, Group, SceneCurves, mean, row};
use super::finished::rounded;
use super::published::{self, PublishedRow, scenes_of};
use crate::command::output;
use crate::command::outputs::{FIGURE, table};
use crate::plot::{Named, ResultRow, SizeAxis, rate_distortion_svg};

/// One line: a method at one rate.
#[derive(Serialize)]
struct SurveyLine<'a> {
    #[serde(rename = "Method")]
    method: &'a str,
    #[serde(rename = "Submethod")]
    submethod: String,
    #[serde(rename = "PSNR")]
    psnr_db: f64,
    #[serde(rename = "SSIM")]
    ssim: Option<f64>,
    #[serde(rename = "LPIPS")]
    lpips: Option<f64>,
    #[serde(rename = "Size [Bytes]")]
    size_bytes: f64,
    #[serde(rename = "#Gaussians")]
    n_gaussians: Option<f64>,
    /// Of each scene, the fewest.
    #[serde(rename = "Seeds")]
    seeds: usize,
    #[serde(rename = "Scenes")]
    scenes: usize,
    program: String,
}

/// Writes the tables and figures of a group: GROUP.csv, means over the scenes where every scene is measured, and GROUP/SCENE.csv.
///
/// Published results in its figures are of the field's usual sizes, whatever ours are. Their means stand beside ours where the plan has all
/// of their scenes.
pub(super) fn write(folder: &Path, group: &Group<'_>, published: &[PublishedRow], outputs: &mut Outputs) -> Result<()> {
    let within = folder.join(group.name());
    for scene in &group.scenes {
        let lines: Vec<SurveyLine<'_>> = scene.methods.iter().flat_map(of_scene).collect();
        let mut named: Vec<Named<Vec<ResultRow>>> = scene.methods.iter().map(of_seeds).collect();
        named.extend(published::curves(published, group.dataset, scene.name));
        write_both(&within.join(format!("{}.csv", scene.name)), &lines, &named, outputs)?;
    }
    let methods = group.methods();
    let lines: Vec<SurveyLine<'_>> = methods.iter().flat_map(|method| of_dataset(group, method)).collect();
    let mut named: Vec<Named<Vec<ResultRow>>> =
        methods.iter().map(|method| Named { name: (*method).to_owned(), what: means(group, method) }).collect();
    let scenes = scenes_of(published, group.dataset);
    if group.n_of(&scenes) == scenes.len() {
        named.extend(published::curves(published, group.dataset, ""));
    }
    write_both(&folder.join(format!("{}.csv", group.name())), &lines, &named, outputs)
}

/// Writes a table and its figure beside it.
fn write_both(
    path: &Path,
    lines: &[SurveyLine<'_>],
    curves: &[Named<Vec<ResultRow>>],
    outputs: &mut Outputs,
) -> Result<()> {
    outputs.file(path, table(&["Method,"]))?.write(&output::csv(lines)?)?;
    let figure = rate_distortion_svg(curves, SizeAxis::Logarithmic)?;
    Ok(outputs.file(&path.with_extension("svg"), FIGURE)?.write(figure.as_bytes())?)
}

impl<'a> SurveyLine<'a> {
    fn new(method: &'a str, row: ResultRow, seeds: usize, scenes: usize) -> Self {
        let ResultRow { submethod, psnr_db, ssim, lpips, size_bytes, n_gaussians, program } = row;
        Self {
            method,
            submethod,
            psnr_db: rounded(psnr_db),
            ssim: ssim.map(rounded),
            lpips: lpips.map(rounded),
            size_bytes: rounded(size_bytes),
            n_gaussians: n_gaussians.map(rounded),
            seeds,
            scenes,
            program: program.unwrap_or_default(),
        }
    }
}

/// A method's measured rates on a scene.
fn of_scene<'a>(curve: &Curve<'a>) -> Vec<SurveyLine<'a>> {
    let line = |rate: &super::curves::Rate<'_>| Some(SurveyLine::new(curve.method, rate.mean()?, rate.seeds.len(), 1));
    curve.rates.iter().filter_map(line).collect()
}

/// Every run by itself: the figure draws the range of seeds.
fn of_seeds(curve: &Curve<'_>) -> Named<Vec<ResultRow>> {
    let rows = curve.rates.iter().flat_map(|rate| rate.seeds.iter().map(|(_, run)| row(rate.name, run)));
    Named { name: curve.method.to_owned(), what: rows.collect() }
}

/// A method's rates that every scene has measured, as means over scenes of means over seeds.
pub(super) fn means(group: &Group<'_>, method: &str) -> Vec<ResultRow> {
    rates(group, method)
        .into_iter()
        .filter_map(|rate| {
            let of_scenes = group.scenes.iter().map(|scene| rate_of(scene, method, rate)?.mean());
            mean(rate, &of_scenes.collect::<Option<Vec<ResultRow>>>()?)
        })
        .collect()
}

fn of_dataset<'a>(group: &Group<'a>, method: &'a str) -> Vec<SurveyLine<'a>> {
    let line = |row: ResultRow| {
        let seeds = |scene| rate_of(scene, method, &row.submethod).map_or(0, |rate| rate.seeds.len());
        let seeds = group.scenes.iter().map(seeds).min().unwrap_or(0);
        SurveyLine::new(method, row, seeds, group.scenes.len())
    };
    means(group, method).into_iter().map(line).collect()
}

/// The names of a method's rates.
fn rates<'a>(group: &Group<'a>, method: &str) -> Vec<&'a str> {
    let curve = group.scenes.iter().flat_map(|scene| &scene.methods).find(|curve| curve.method == method);
    curve.map_or_else(Vec::new, |curve| curve.rates.iter().map(|rate| rate.name).collect())
}

fn rate_of<'a, 'b>(scene: &'b SceneCurves<'a>, method: &str, rate: &str) -> Option<&'b super::curves::Rate<'a>> {
    let curve = scene.methods.iter().find(|curve| curve.method == method)?;
    curve.rates.iter().find(|other| other.name == rate)
}
