//! `pocketsplat inspect`: what a bundle or a file of Gaussians holds and where its bytes went.

mod splats;

use std::path::PathBuf;

use anyhow::Result;
use pocketsplat_codec::bundle::annotate::annotate;
use pocketsplat_codec::bundle::{SizePart, SizeReport, decoded_scene};
use pocketsplat_format::Bundle;
use pocketsplat_format::bundle::TierMeasures;
use pocketsplat_instructions::level::Profile;
use pocketsplat_kernels::camera::host_camera;
use serde_json::{Value, json};

use super::bundle::BundleFile;
use super::gaussians::{AxesArgs, GaussiansFile};
use super::output;
use super::render::CameraRecord;

/// Show what a bundle or a file of Gaussians holds.
///
/// Of a bundle the header, the tiers, and the bytes part by part.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The bundle, or a file of Gaussians: .ply, .spz, .sog, .glb or .splat.
    bundle: PathBuf,
    #[command(flatten)]
    axes: AxesArgs,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
    /// Print the file byte by byte with the meaning of each, long arrays abbreviated.
    #[arg(long, conflicts_with = "json")]
    hexdump: bool,
    /// Largest number of lines of an array in the dump.
    #[arg(long, value_name = "N", default_value_t = 4, requires = "hexdump")]
    lines: usize,
}

pub(crate) fn run(args: &Args) -> Result<()> {
    if GaussiansFile::is_one(&args.bundle) {
        return splats::run(args);
    }
    args.axes.refuse_unless(false, &args.bundle)?;
    let file = BundleFile::read(&args.bundle)?;
    let bundle = file.parse()?;
    if args.hexdump {
        return output::print_text(&annotate(&file.bytes, args.lines)?);
    }
    let size = SizeReport::of(&bundle)?;
    let (mut facts, parts, tiers) = (facts(&bundle, &size)?, size.parts(), tiers(&bundle));
    if args.json {
        facts["preview"] = serde_json::to_value(CameraRecord::of(&host_camera(&bundle.header().preview)))?;
        facts["parts"] = serde_json::to_value(parts)?;
        facts["tiers"] = tiers.iter().map(Tier::facts).collect();
        return output::print(&facts, true);
    }
    output::print(&facts, false)?;
    output::print_text(&format!("\n{}\n{}", parts_table(&parts, &size), tiers_table(&tiers)))
}

/// What a bundle is.
fn facts(bundle: &Bundle<'_>, size: &SizeReport) -> Result<Value> {
    let header = bundle.header();
    let effects = header.features.effects;
    let anchors = size.n_anchors.max(1) as f64;
    let ideal_bytes = size.ideal.total() / 8.0;
    let scene = decoded_scene(bundle)?;
    Ok(json!({
        "format_version": pocketsplat_format::bundle::VERSION,
        "profile": Profile::of(&header.features).to_string(),
        "coder": if header.features.context { "context" } else { "static" },
        "n_anchors": size.n_anchors,
        "n_chunks": bundle.n_chunks(),
        "max_chunk_anchors": header.max_chunk_anchors,
        "n_tiers": bundle.n_tiers(),
        "n_tiers_written": header.n_tiers,
        "feature_dim": header.feature_dim,
        "n_offsets": header.n_offsets,
        "drawn_offsets_per_anchor": size.n_drawn_offsets as f64 / anchors,
        "view_colour": effects.view_colour,
        "view_geometry": effects.view_geometry,
        "view_distance": effects.view_distance,
        "dilation_compensation": effects.dilation_compensation,
        "anisotropic": effects.anisotropic,
        "training_px": header.training_px,
        "background_rgb8": header.background,
        "voxel_size": header.voxel_size,
        "normalisation_centre": header.normalisation_centre,
        "normalisation_scale": header.normalisation_scale,
        "total_bytes": size.total,
        "bytes_per_anchor": size.total as f64 / anchors,
        "container_percent": 100.0 * size.container() / size.total as f64,
        "stream_bytes": size.streams,
        "stream_ideal_bytes": ideal_bytes,
        "streams_over_ideal_percent": 100.0 * (size.streams as f64 / ideal_bytes.max(1.0) - 1.0),
        "position_bits_per_anchor": size.position_bits_per_anchor(),
        // Of a feature's channels over the anchors.
        "feature_deviation_min_median_max": deviations(&scene.anchors.features, scene.shape.feature_dim),
    }))
}

/// Least, median and largest standard deviation of the columns of `values`.
///
/// * `values`: `[n, n_columns]`.
fn deviations(values: &[f32], n_columns: usize) -> [f64; 3] {
    let n = (values.len() / n_columns).max(1) as f64;
    let deviation = |column: usize| {
        let column = || values.iter().skip(column).step_by(n_columns).map(|value| f64::from(*value));
        let mean = column().sum::<f64>() / n;
        (column().map(|value| (value - mean).powi(2)).sum::<f64>() / n).sqrt()
    };
    let mut sorted: Vec<f64> = (0..n_columns).map(deviation).collect();
    sorted.sort_by(f64::total_cmp);
    [0, n_columns / 2, n_columns - 1].map(|i| sorted[i])
}

/// The scene of one tier and those before it.
struct Tier {
    number: u8,
    content: pocketsplat_format::bundle::Tier,
    /// Length of the file cut here.
    bytes: u32,
    measures: TierMeasures,
}

fn tiers(bundle: &Bundle<'_>) -> Vec<Tier> {
    let chunks_start = bundle.sections().last().map_or(0, |section| section.offset);
    let tier = |number: u8| {
        let (content, measures) = (bundle.tier(number)?, bundle.measures(number)?);
        Some(Tier { number, content, bytes: chunks_start + content.end, measures })
    };
    (0..bundle.n_tiers()).filter_map(tier).collect()
}

impl Tier {
    fn facts(&self) -> Value {
        let measures = &self.measures;
        json!({
            "tier": self.number,
            "n_anchors": self.content.n_anchors,
            "n_chunks": self.content.n_chunks,
            "bytes": self.bytes,
            "level": measures.level,
            "psnr_db": measures.psnr_db,
            "n_views": measures.n_views,
            "n_cameras": measures.n_cameras,
            "max_decoded_anchors": measures.max_decoded_anchors,
            "max_visible_anchors": measures.max_visible_anchors,
            "max_splats": measures.max_splats,
            "max_strip_splats": measures.max_strip_splats,
            "max_strip_pairs": measures.max_strip_pairs,
            "max_head_kilo_macs": measures.max_head_kilo_macs,
            "max_kilo_pixels": measures.max_kilo_pixels,
        })
    }
}

/// The account of bytes, payload before container.
fn parts_table(parts: &[SizePart], size: &SizeReport) -> String {
    let line = |name: &str, bytes: f64| {
        let (bits, share) = (8.0 * bytes / size.n_anchors.max(1) as f64, 100.0 * bytes / size.total as f64);
        format!("{name:<22}{bytes:>12.1}{bits:>12.3}{share:>9.2}\n")
    };
    let mut text = format!("{:<22}{:>12}{:>12}{:>9}\n", "part", "bytes", "bits/anchor", "%");
    for container in [false, true] {
        for part in parts.iter().filter(|part| part.container == container && part.bytes != 0.0) {
            text += &line(part.name, part.bytes);
        }
        let sum = parts.iter().filter(|part| part.container == container).map(|part| part.bytes).sum();
        text += &line(if container { "= container" } else { "= payload" }, sum);
    }
    text + &line("= file", size.total as f64)
}

/// A line a tier: the file cut there, and what it was measured to take.
fn tiers_table(tiers: &[Tier]) -> String {
    let mut text = format!(
        "{:<6}{:>10}{:>10}{:>7}{:>9}{:>10}{:>10}{:>10}{:>12}{:>12}\n",
        "tiers", "anchors", "bytes", "level", "PSNR", "decoded", "visible", "splats", "tile pairs", "head kMACs"
    );
    for Tier { number, content, bytes, measures } in tiers {
        let psnr = measures.psnr_db.map_or_else(|| "-".to_owned(), |psnr| format!("{psnr:.2}"));
        let level = if measures.level == 0 { "-".to_owned() } else { measures.level.to_string() };
        text += &format!("{:<6}{:>10}{bytes:>10}{level:>7}{psnr:>9}", format!("0..={number}"), content.n_anchors);
        if measures.n_cameras == 0 {
            text += "  not measured\n";
            continue;
        }
        let TierMeasures { max_decoded_anchors, max_visible_anchors, max_splats, .. } = measures;
        let ([pairs, ..], kilo_macs) = (measures.max_strip_pairs, measures.max_head_kilo_macs);
        text +=
            &format!("{max_decoded_anchors:>10}{max_visible_anchors:>10}{max_splats:>10}{pairs:>12}{kilo_macs:>12}\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::deviations;

    #[test]
    fn deviations_are_of_each_column_around_its_own_mean() {
        // Columns of deviation 2, 0, 1, the last far from 0.
        let values = [2.0, 5.0, 101.0, -2.0, 5.0, 99.0, 2.0, 5.0, 99.0, -2.0, 5.0, 101.0];
        assert_eq!(deviations(&values, 3), [0.0, 1.0, 2.0]);
        assert_eq!(deviations(&[], 3), [0.0; 3]);
    }
}
