//! `pocketsplat inspect`: what a bundle holds and where its bytes went.

use std::path::PathBuf;

use anyhow::Result;
use pocketsplat::bundle::SizeReport;
use serde::Serialize;

use super::bundle::BundleFile;
use super::output;

/// Show a bundle's header, dimensions, and its bytes part by part.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The bundle.
    bundle: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

/// Header and sizes of a bundle.
#[derive(Serialize)]
struct Inspection {
    format_version: u16,
    n_anchors: u32,
    n_chunks: u32,
    max_chunk_anchors: u16,
    feature_dim: u16,
    n_offsets: u16,
    view_direction: bool,
    view_distance: bool,
    dilation_compensation: bool,
    training_px: [u16; 2],
    background_rgb8: [u8; 3],
    voxel_size: f32,
    normalisation_centre: [f64; 3],
    normalisation_scale: f64,
    total_bytes: usize,
    header_bytes: usize,
    heads_bytes: usize,
    tables_bytes: usize,
    directory_bytes: usize,
    lattice_bytes: usize,
    symbols_bytes: usize,
    bytes_per_anchor: f64,
    lattice_bits_per_anchor: f64,
    feature_bits_per_anchor: f64,
    log_scale_bits_per_anchor: f64,
    offset_bits_per_anchor: f64,
    symbols_over_estimate: f64,
}

pub(crate) fn run(args: &Args) -> Result<()> {
    let file = BundleFile::read(&args.bundle)?;
    let bundle = file.parse()?;
    let (header, size) = (bundle.header(), SizeReport::of(&bundle)?);
    let per_anchor = |bits: f64| bits / size.n_anchors.max(1) as f64;
    let estimate_bits = size.feature_bits + size.log_scale_bits + size.offset_bits;
    let inspection = Inspection {
        format_version: pocketsplat_core::bundle::VERSION,
        n_anchors: header.n_anchors,
        n_chunks: header.n_chunks,
        max_chunk_anchors: header.max_chunk_anchors,
        feature_dim: header.feature_dim,
        n_offsets: header.n_offsets,
        view_direction: header.effects.view_direction,
        view_distance: header.effects.view_distance,
        dilation_compensation: header.effects.dilation_compensation,
        training_px: header.training_px,
        background_rgb8: header.background,
        voxel_size: header.voxel_size,
        normalisation_centre: header.normalisation_centre,
        normalisation_scale: header.normalisation_scale,
        total_bytes: size.total,
        header_bytes: size.header,
        heads_bytes: size.heads,
        tables_bytes: size.tables,
        directory_bytes: size.directory,
        lattice_bytes: size.lattice,
        symbols_bytes: size.symbols,
        bytes_per_anchor: size.bytes_per_anchor(),
        lattice_bits_per_anchor: per_anchor(8.0 * size.lattice as f64),
        feature_bits_per_anchor: per_anchor(size.feature_bits),
        log_scale_bits_per_anchor: per_anchor(size.log_scale_bits),
        offset_bits_per_anchor: per_anchor(size.offset_bits),
        symbols_over_estimate: 8.0 * size.symbols as f64 / estimate_bits.max(1.0),
    };
    output::print(&inspection, args.json)
}
