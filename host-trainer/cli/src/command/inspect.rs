//! `pocketsplat inspect`: what a bundle holds and where its bytes went.

use std::path::PathBuf;

use anyhow::Result;
use pocketsplat_core::Bundle;
use pocketsplat_trainer::bundle::annotate::annotate;
use pocketsplat_trainer::bundle::{SizePart, SizeReport, decoded_scene};
use serde::Serialize;

use super::bundle::BundleFile;
use super::output;

/// Show a bundle's header, its tiers, and its bytes part by part.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The bundle.
    bundle: PathBuf,
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

/// What a bundle is.
#[derive(Serialize)]
struct Facts {
    format_version: u16,
    coder: &'static str,
    n_anchors: usize,
    n_chunks: u32,
    max_chunk_anchors: u16,
    n_tiers: u8,
    n_tiers_written: u8,
    feature_dim: u16,
    n_offsets: u16,
    drawn_offsets_per_anchor: f64,
    view_colour: bool,
    view_geometry: bool,
    view_distance: bool,
    dilation_compensation: bool,
    anisotropic: bool,
    training_px: [u16; 2],
    background_rgb8: [u8; 3],
    voxel_size: f32,
    normalisation_centre: [f64; 3],
    normalisation_scale: f64,
    total_bytes: usize,
    bytes_per_anchor: f64,
    container_percent: f64,
    stream_bytes: usize,
    stream_ideal_bytes: f64,
    streams_over_ideal_percent: f64,
    position_bits_per_anchor: f64,
    /// Of a feature's channels over the anchors.
    feature_deviation_min_median_max: [f64; 3],
}

/// The scene of one tier and those before it.
#[derive(Serialize)]
struct TierFacts {
    tier: u8,
    n_anchors: u32,
    n_chunks: u32,
    /// Length of the file cut here.
    bytes: u32,
    psnr_db: Option<f32>,
    n_views: u16,
    n_cameras: u16,
    max_decoded_anchors: u32,
    max_visible_anchors: u32,
    max_splats: u32,
    max_strip_splats: [u32; 4],
    max_strip_pairs: [u32; 4],
    max_head_kilo_macs: u32,
    max_kilo_pixels: u32,
}

#[derive(Serialize)]
struct Inspection {
    #[serde(flatten)]
    facts: Facts,
    parts: Vec<SizePart>,
    tiers: Vec<TierFacts>,
}

pub(crate) fn run(args: &Args) -> Result<()> {
    let file = BundleFile::read(&args.bundle)?;
    let bundle = file.parse()?;
    if args.hexdump {
        return output::print_text(&annotate(&file.bytes, args.lines)?);
    }
    let size = SizeReport::of(&bundle)?;
    let inspection = Inspection { facts: facts(&bundle, &size)?, parts: size.parts(), tiers: tiers(&bundle) };
    if args.json {
        return output::print(&inspection, true);
    }
    output::print(&inspection.facts, false)?;
    output::print_text(&format!("\n{}\n{}", parts_table(&inspection.parts, &size), tiers_table(&inspection.tiers)))
}

fn facts(bundle: &Bundle<'_>, size: &SizeReport) -> Result<Facts> {
    let header = bundle.header();
    let effects = header.features.effects;
    let anchors = size.n_anchors.max(1) as f64;
    let ideal_bytes = size.ideal.total() / 8.0;
    let scene = decoded_scene(bundle)?;
    Ok(Facts {
        format_version: pocketsplat_core::bundle::VERSION,
        coder: if header.features.context { "context" } else { "static" },
        n_anchors: size.n_anchors,
        n_chunks: bundle.n_chunks(),
        max_chunk_anchors: header.max_chunk_anchors,
        n_tiers: bundle.n_tiers(),
        n_tiers_written: header.n_tiers,
        feature_dim: header.feature_dim,
        n_offsets: header.n_offsets,
        drawn_offsets_per_anchor: size.n_drawn_offsets as f64 / anchors,
        view_colour: effects.view_colour,
        view_geometry: effects.view_geometry,
        view_distance: effects.view_distance,
        dilation_compensation: effects.dilation_compensation,
        anisotropic: effects.anisotropic,
        training_px: header.training_px,
        background_rgb8: header.background,
        voxel_size: header.voxel_size,
        normalisation_centre: header.normalisation_centre,
        normalisation_scale: header.normalisation_scale,
        total_bytes: size.total,
        bytes_per_anchor: size.total as f64 / anchors,
        container_percent: 100.0 * size.container() / size.total as f64,
        stream_bytes: size.streams,
        stream_ideal_bytes: ideal_bytes,
        streams_over_ideal_percent: 100.0 * (size.streams as f64 / ideal_bytes.max(1.0) - 1.0),
        position_bits_per_anchor: size.position_bits_per_anchor(),
        feature_deviation_min_median_max: deviations(&scene.anchors.features, scene.shape.feature_dim),
    })
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

fn tiers(bundle: &Bundle<'_>) -> Vec<TierFacts> {
    let chunks_start = bundle.sections().last().map_or(0, |section| section.offset);
    let tier = |tier: u8| {
        let (content, measures) = (bundle.tier(tier)?, bundle.measures(tier)?);
        Some(TierFacts {
            tier,
            n_anchors: content.n_anchors,
            n_chunks: content.n_chunks,
            bytes: chunks_start + content.end,
            psnr_db: measures.psnr_db,
            n_views: measures.n_views,
            n_cameras: measures.n_cameras,
            max_decoded_anchors: measures.max_decoded_anchors,
            max_visible_anchors: measures.max_visible_anchors,
            max_splats: measures.max_splats,
            max_strip_splats: measures.max_strip_splats,
            max_strip_pairs: measures.max_strip_pairs,
            max_head_kilo_macs: measures.max_head_kilo_macs,
            max_kilo_pixels: measures.max_kilo_pixels,
        })
    };
    (0..bundle.n_tiers()).filter_map(tier).collect()
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
fn tiers_table(tiers: &[TierFacts]) -> String {
    let mut text = format!(
        "{:<6}{:>10}{:>10}{:>9}{:>10}{:>10}{:>10}{:>12}{:>12}\n",
        "tiers", "anchors", "bytes", "PSNR", "decoded", "visible", "splats", "tile pairs", "head kMACs"
    );
    for tier in tiers {
        let psnr = tier.psnr_db.map_or_else(|| "-".to_owned(), |psnr| format!("{psnr:.2}"));
        text += &format!("{:<6}{:>10}{:>10}{psnr:>9}", format!("0..={}", tier.tier), tier.n_anchors, tier.bytes);
        if tier.n_cameras == 0 {
            text += "  not measured\n";
            continue;
        }
        let [decoded, visible, splats] = [tier.max_decoded_anchors, tier.max_visible_anchors, tier.max_splats];
        let [pairs, ..] = tier.max_strip_pairs;
        text += &format!("{decoded:>10}{visible:>10}{splats:>10}{pairs:>12}{:>12}\n", tier.max_head_kilo_macs);
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
