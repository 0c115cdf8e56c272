//! What a file of Gaussians holds.

use anyhow::{Result, bail};
use pocketsplat_gaussians::{Account, Format, Gaussians, SpzAxes};
use serde::Serialize;

use super::super::gaussians::{GaussiansFile, VERTICAL_AXIS};
use super::super::output;
use super::Args;

/// Shares of the Gaussians at which numbers are given: from the 1st to the 99th percentile.
const SHARES: [f64; 5] = [0.01, 0.1, 0.5, 0.9, 0.99];
/// A stray is farther from the median centre than so many times the median distance.
const STRAY: f64 = 10.0;
/// Opacities below and above it are called faint and opaque.
const FAINT: f64 = 0.1;
const OPAQUE: f64 = 0.9;

/// What a file of Gaussians holds; lengths are in units of the file.
#[derive(Debug, Serialize)]
struct Facts {
    format: String,
    bytes: usize,
    n_gaussians: usize,
    sh_degree: usize,
    /// Whether opacities are to be scaled by what the dilation adds to a splat.
    compensation: bool,
    bytes_per_gaussian: f64,
    /// Least and largest coordinate of each axis.
    least: [f32; 3],
    largest: [f32; 3],
    /// At [`SHARES`], each axis by itself.
    x_percentiles: [f64; 5],
    y_percentiles: [f64; 5],
    z_percentiles: [f64; 5],
    /// Gaussians farther from the median centre than ten times the median distance.
    n_strays: usize,
    deviation_percentiles: [f64; 5],
    opacity_percentiles: [f64; 5],
    faint_percent: f64,
    opaque_percent: f64,
    /// Which axis points up, as far as the file says.
    up: String,
    /// A point of the scene is `frame_offset` + `frame_scale` · the file's.
    frame_offset: [f64; 3],
    frame_scale: f64,
    /// What a .spz of it would not hold.
    spz_would_lose: Vec<String>,
    comments: Vec<String>,
    /// What the file holds besides Gaussians.
    ignored: Vec<String>,
    /// What was not read as it stands.
    warnings: Vec<String>,
}

/// The values at [`SHARES`] of all; 0 of none.
fn percentiles(values: impl Iterator<Item = f64>) -> [f64; 5] {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_unstable_by(f64::total_cmp);
    SHARES.map(|share| {
        let last = sorted.len().saturating_sub(1);
        sorted.get((share * last as f64).round() as usize).copied().unwrap_or(0.0)
    })
}

fn percent(count: usize, of: usize) -> f64 {
    100.0 * count as f64 / of.max(1) as f64
}

/// What the file says of its axes.
fn up(file: &GaussiansFile) -> String {
    let comment = file.notes.comments.iter().find_map(|comment| comment.strip_prefix(VERTICAL_AXIS));
    match (comment, file.notes.spz_axes) {
        (Some(axis), _) => format!("a comment says that the vertical axis is {}", axis.trim()),
        (None, Some(SpzAxes::AsDescribed)) => "-y, if its axes are as the description of .spz has them".to_owned(),
        _ => "the file does not say; most programs that train splats have -y".to_owned(),
    }
}

fn facts(file: &GaussiansFile, account: &Account) -> Facts {
    let (gaussians, notes) = (&file.gaussians, &file.notes);
    let n = gaussians.len();
    let axis = |axis: usize| percentiles(gaussians.centres.iter().map(|centre| f64::from(centre[axis])));
    let bounds = |start: f32, of: fn(f32, f32) -> f32| {
        let start = if n == 0 { 0.0 } else { start };
        gaussians
            .centres
            .iter()
            .fold([start; 3], |best, centre| std::array::from_fn(|axis| of(best[axis], centre[axis])))
    };
    let [x_percentiles, y_percentiles, z_percentiles] = [0, 1, 2].map(axis);
    let opacities = || gaussians.opacity_logits.iter().map(|logit| 1.0 / (1.0 + f64::from(-logit).exp()));
    let deviations = gaussians.log_scales.iter().flatten().map(|scale| f64::from(*scale).exp());
    Facts {
        format: account.format.clone(),
        bytes: file.n_bytes,
        n_gaussians: n,
        sh_degree: gaussians.degree.number(),
        compensation: notes.compensation,
        bytes_per_gaussian: file.n_bytes as f64 / n.max(1) as f64,
        least: bounds(f32::INFINITY, f32::min),
        largest: bounds(f32::NEG_INFINITY, f32::max),
        n_strays: n_strays(gaussians, [x_percentiles[2], y_percentiles[2], z_percentiles[2]]),
        x_percentiles,
        y_percentiles,
        z_percentiles,
        deviation_percentiles: percentiles(deviations),
        opacity_percentiles: percentiles(opacities()),
        faint_percent: percent(opacities().filter(|opacity| *opacity < FAINT).count(), n),
        opaque_percent: percent(opacities().filter(|opacity| *opacity > OPAQUE).count(), n),
        up: up(file),
        frame_offset: notes.frame.offset,
        frame_scale: notes.frame.scale,
        spz_would_lose: match Format::Spz.write(gaussians, notes) {
            Ok(written) => written.warnings,
            Err(fault) => vec![fault.to_string()],
        },
        comments: notes.comments.clone(),
        ignored: notes.ignored.clone(),
        warnings: notes.warnings.clone(),
    }
}

/// * `middle`: the median centre.
fn n_strays(gaussians: &Gaussians, middle: [f64; 3]) -> usize {
    let distance =
        |centre: &[f32; 3]| (0..3).map(|axis| (f64::from(centre[axis]) - middle[axis]).powi(2)).sum::<f64>().sqrt();
    let [_, _, median, ..] = percentiles(gaussians.centres.iter().map(distance));
    gaussians.centres.iter().filter(|centre| distance(centre) > STRAY * median).count()
}

/// `inspect` for a file of Gaussians.
pub(super) fn run(args: &Args) -> Result<()> {
    if args.hexdump {
        bail!("{} holds Gaussians and no bundle; leave out --hexdump", args.bundle.display());
    }
    let file = GaussiansFile::read(&args.bundle, args.axes)?;
    let account = pocketsplat_gaussians::account(&args.bundle)?;
    let facts = facts(&file, &account);
    if args.json {
        let mut json = serde_json::to_value(&facts)?;
        json["parts_packed_by"] = serde_json::to_value(account.packed_by)?;
        json["parts"] =
            account.parts.iter().map(|part| serde_json::json!({ "name": part.name, "bytes": part.bytes })).collect();
        return output::print(&json, true);
    }
    output::print_text(&format!("{}\n{}", words(&facts), table(&account)))
}

/// A line for each thing.
fn words(facts: &Facts) -> String {
    let numbers = |values: &[f64]| values.iter().map(|value| format!("{value:>12.4}")).collect::<String>();
    let mut text = format!(
        "{}: {} Gaussians of degree {}, {} bytes, {:.1} each\n",
        facts.format, facts.n_gaussians, facts.sh_degree, facts.bytes, facts.bytes_per_gaussian
    );
    let mut line = |name: &str, value: String| text += &format!("{name:<14}{value}\n");
    line("percentiles", ["1st", "10th", "median", "90th", "99th"].iter().map(|name| format!("{name:>12}")).collect());
    for (name, values) in [("x", &facts.x_percentiles), ("y", &facts.y_percentiles), ("z", &facts.z_percentiles)] {
        line(name, numbers(values));
    }
    line("deviations", numbers(&facts.deviation_percentiles));
    line("opacities", numbers(&facts.opacity_percentiles));
    let place = |values: [f32; 3]| values.map(|value| value.to_string()).join(" ");
    line("extent", format!("{} to {}", place(facts.least), place(facts.largest)));
    line("strays", format!("{} farther from the median than {STRAY} times the median distance", facts.n_strays));
    line("faint", format!("{:.1} % below {FAINT}, {:.1} % above {OPAQUE}", facts.faint_percent, facts.opaque_percent));
    line("up", facts.up.clone());
    if facts.compensation {
        line("compensation", "opacities are scaled by what the dilation adds (mip)".to_owned());
    }
    if facts.frame_scale != 1.0 || facts.frame_offset != [0.0; 3] {
        line("frame", format!("scene = file * {} + {:?}", facts.frame_scale, facts.frame_offset));
    }
    let spz = if facts.spz_would_lose.is_empty() {
        vec!["holds all within its steps".to_owned()]
    } else {
        facts.spz_would_lose.clone()
    };
    for (name, lines) in [("a .spz", &spz), ("comment", &facts.comments)] {
        lines.iter().for_each(|said| line(name, said.clone()));
    }
    text
}

fn table(account: &Account) -> String {
    let total: usize = account.parts.iter().map(|part| part.bytes).sum();
    let head = account.packed_by.map_or_else(|| "bytes".to_owned(), |packer| format!("before {packer}"));
    let mut text = format!("{:<32}{head:>14}{:>9}\n", "part", "%");
    for part in &account.parts {
        text += &format!("{:<32}{:>14}{:>9.2}\n", part.name, part.bytes, percent(part.bytes, total));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_of_what_there_is() {
        assert_eq!(percentiles((0..=100).rev().map(f64::from)), [1.0, 10.0, 50.0, 90.0, 99.0]);
        assert_eq!(percentiles([7.0].into_iter()), [7.0; 5]);
        assert_eq!(percentiles(std::iter::empty()), [0.0; 5]);
    }

    #[test]
    fn strays_are_counted_up_to_half_of_all() {
        let cluster = |i: usize| [(i as f32).sin(), (i as f32).cos(), (2.0 * i as f32).sin()];
        for n_strays_there in [0, 1, 10, 30] {
            let mut centres: Vec<[f32; 3]> = (0..100).map(cluster).collect();
            centres.iter_mut().take(n_strays_there).for_each(|centre| centre[0] = 1e6);
            let gaussians = Gaussians { centres, ..Gaussians::default() };
            let middle = [0, 1, 2].map(|axis| percentiles(gaussians.centres.iter().map(|c| f64::from(c[axis])))[2]);
            assert_eq!(n_strays(&gaussians, middle), n_strays_there);
        }
    }
}
