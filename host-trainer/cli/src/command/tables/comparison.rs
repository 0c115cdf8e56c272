//! Published results and ours in one page, as papers of this field have it.

use super::curves::Group;
use super::published::{PublishedRow, scenes_of};
use super::survey::means;
use crate::plot::{ResultRow, unique};

/// What stands where a plan has no runs.
const NOT_RUN: &str = "not run";
/// What stands where a paper gives nothing.
const NOT_GIVEN: &str = "–";

/// A page with a table of datasets, and one of scenes.
pub(super) fn markdown(groups: &[Group<'_>], published: &[PublishedRow]) -> String {
    let theirs = published.iter().map(|row| row.dataset.as_str());
    let datasets = unique(theirs.chain(groups.iter().map(|group| group.dataset)));
    let mut page =
        "# Published results and ours\n\nPSNR, dB / SSIM / LPIPS / MB (10⁶ bytes). Ours are means over seeds; the \
                    sizes of our images stand beside our methods.\n\n## Datasets\n\n"
            .to_owned();
    let heads = datasets.iter().map(|dataset| (*dataset).to_owned()).collect::<Vec<_>>();
    let theirs = table_of(published.iter().filter(|row| row.scene.is_empty()), &datasets, |row| &row.dataset);
    let ours = groups.iter().flat_map(|group| {
        let methods = group.methods();
        methods.into_iter().flat_map(|method| ours_on_datasets(group, method, &datasets, published)).collect::<Vec<_>>()
    });
    page += &table("method", &heads, theirs.into_iter().chain(ours));
    page += "\n## Scenes\n";
    for dataset in datasets {
        page += &scenes(dataset, groups, published);
    }
    page
}

/// The table of a dataset's scenes, where there is any.
fn scenes(dataset: &str, groups: &[Group<'_>], published: &[PublishedRow]) -> String {
    let here = || published.iter().filter(|row| row.dataset == dataset && !row.scene.is_empty());
    let own = || groups.iter().filter(|group| group.dataset == dataset);
    let own_scenes = own().flat_map(|group| group.scenes.iter().map(|scene| scene.name));
    let names = unique(here().map(|row| row.scene.as_str()).chain(own_scenes));
    if names.is_empty() {
        return String::new();
    }
    let mut rows = table_of(here(), &names, |row| &row.scene);
    for group in own() {
        for method in group.methods() {
            rows.extend(ours_on_scenes(group, method, &names));
        }
    }
    if own().next().is_none() {
        rows.push(("ours".to_owned(), vec![NOT_RUN.to_owned(); names.len()]));
    }
    let heads: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
    format!("\n### {dataset}\n\n{}", table("method", &heads, rows))
}

/// A method of ours over all datasets, a line for each rate; a dataset counts as a whole or not at all.
fn ours_on_datasets(
    group: &Group<'_>,
    method: &str,
    datasets: &[&str],
    published: &[PublishedRow],
) -> Vec<(String, Vec<String>)> {
    let scenes = scenes_of(published, group.dataset);
    let n_planned = group.n_of(&scenes);
    let cell = |dataset: &&str, row: &ResultRow| match *dataset == group.dataset {
        false => NOT_RUN.to_owned(),
        true if n_planned < scenes.len() => format!("{n_planned} of {} scenes", scenes.len()),
        true => figures(row.psnr_db, row.ssim, row.lpips, Some(row.size_bytes)),
    };
    let line = |row: ResultRow| {
        (called(group, method, &row.submethod), datasets.iter().map(|dataset| cell(dataset, &row)).collect())
    };
    means(group, method).into_iter().map(line).collect()
}

/// A method of ours over the scenes of its dataset, a line for each rate.
fn ours_on_scenes(group: &Group<'_>, method: &str, names: &[&str]) -> Vec<(String, Vec<String>)> {
    let curves = group.scenes.iter().flat_map(|scene| &scene.methods).filter(|curve| curve.method == method);
    let rates = unique(curves.flat_map(|curve| &curve.rates).map(|rate| rate.name));
    let cell = |name: &str, rate: &str| {
        let scene = group.scenes.iter().find(|scene| scene.name == name)?;
        let curve = scene.methods.iter().find(|curve| curve.method == method)?;
        let rate = curve.rates.iter().find(|other| other.name == rate)?;
        let row = rate.mean()?;
        Some(figures(row.psnr_db, row.ssim, row.lpips, Some(row.size_bytes)))
    };
    let line = |rate: &str| {
        let cells = names.iter().map(|name| cell(name, rate).unwrap_or_else(|| NOT_RUN.to_owned()));
        (called(group, method, rate), cells.collect())
    };
    rates.into_iter().map(line).collect()
}

fn called(group: &Group<'_>, method: &str, rate: &str) -> String {
    let sizes = group.sizes_px();
    let size = if sizes.is_empty() { String::new() } else { format!(", {sizes} px") };
    format!("**ours: {method} {rate}{size}**")
}

/// Published rows by name, a cell for each of `columns`.
fn table_of<'a>(
    rows: impl Iterator<Item = &'a PublishedRow>,
    columns: &[&str],
    column: fn(&PublishedRow) -> &str,
) -> Vec<(String, Vec<String>)> {
    let mut table: Vec<(String, Vec<String>)> = Vec::new();
    for row in rows {
        let Some(at) = columns.iter().position(|name| *name == column(row)) else { continue };
        let cell = figures(row.psnr_db, row.ssim, row.lpips, row.size_bytes);
        let is_free = |(name, cells): &&mut (String, Vec<String>)| *name == row.name() && cells[at] == NOT_GIVEN;
        match table.iter_mut().find(is_free) {
            Some((_, cells)) => cells[at] = cell,
            None => {
                let mut cells = vec![NOT_GIVEN.to_owned(); columns.len()];
                cells[at] = cell;
                table.push((row.name(), cells));
            }
        }
    }
    table
}

fn figures(psnr_db: f64, ssim: Option<f64>, lpips: Option<f64>, size_bytes: Option<f64>) -> String {
    let or_dash = |value: Option<String>| value.unwrap_or_else(|| NOT_GIVEN.to_owned());
    let [ssim, lpips] = [ssim, lpips].map(|value| or_dash(value.map(|value| format!("{value:.3}"))));
    format!("{psnr_db:.2} / {ssim} / {lpips} / {}", or_dash(size_bytes.map(|bytes| format!("{:.2}", bytes / 1e6))))
}

fn table(corner: &str, heads: &[String], rows: impl IntoIterator<Item = (String, Vec<String>)>) -> String {
    let mut text = format!("| {corner} | {} |\n|---|{}\n", heads.join(" | "), "---|".repeat(heads.len()));
    for (name, cells) in rows {
        text += &format!("| {name} | {} |\n", cells.join(" | "));
    }
    text
}
