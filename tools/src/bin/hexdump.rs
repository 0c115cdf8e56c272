//! Prints a bundle byte by byte, every byte with the field it belongs to.
//!
//! With `--check FORMAT.md` it compares the example of the format document, and `example.psb` beside it, with the dump and
//! the bytes of a scene made by hand; with `--write FORMAT.md` it puts them there.

use std::path::PathBuf;

use anyhow::{Context, Result, bail, ensure};
use clap::Parser;
use glam::{DMat3, DVec3};
use pocketsplat::bundle::{self, BundleInfo, QuantisationSteps, annotate::annotate};
use pocketsplat::camera::Camera;
use pocketsplat::dataset::Normalisation;
use pocketsplat::scene::{Anchors, Heads, ModelShape, Scene};

/// The document when none is named.
const FORMAT_DOC: &str = "decoder-core/src/bundle/FORMAT.md";
/// Before the dump in the document.
const BEGIN: &str = "<!-- hexdump begin -->\n";
/// After the dump in the document.
const END: &str = "<!-- hexdump end -->\n";

/// Annotates a bundle, or the format document's example.
#[derive(Parser)]
struct Args {
    /// The bundle to print; without it, the example.
    bundle: Option<PathBuf>,
    /// Compare the example in this document and fail on a difference.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = FORMAT_DOC)]
    #[arg(conflicts_with_all = ["bundle", "write"])]
    check: Option<PathBuf>,
    /// Put the example into this document.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = FORMAT_DOC, conflicts_with = "bundle")]
    write: Option<PathBuf>,
}

fn main() -> Result<()> {
    let args = Args::parse();
    let bytes = match &args.bundle {
        Some(path) => std::fs::read(path).with_context(|| format!("{}: can not be read", path.display()))?,
        None => example()?,
    };
    let dump = annotate(&bytes).context("not a sound bundle")?;
    let Some(document) = args.check.as_ref().or(args.write.as_ref()) else {
        print!("{dump}");
        return Ok(());
    };
    let text = std::fs::read_to_string(document).with_context(|| format!("{}: can not be read", document.display()))?;
    let fresh = with_example(&text, &dump).with_context(|| format!("{}: no place for the dump", document.display()))?;
    let bundle_path = document.with_file_name("example.psb");
    if args.check.is_some() {
        ensure!(
            text == fresh && std::fs::read(&bundle_path).is_ok_and(|stored| stored == bytes),
            "{0}: the example or its bundle differs from the writer's bytes; run `cargo run -p tools --bin hexdump -- --write {0}` and read the change",
            document.display()
        );
        return Ok(());
    }
    std::fs::write(&bundle_path, bytes).with_context(|| format!("{}: can not be written", bundle_path.display()))?;
    std::fs::write(document, fresh).with_context(|| format!("{}: can not be written", document.display()))
}

/// The document with the text between its markers replaced.
fn with_example(text: &str, dump: &str) -> Result<String> {
    let Some((before, rest)) = text.split_once(BEGIN) else { bail!("marker {BEGIN:?} missing") };
    let Some((_, after)) = rest.split_once(END) else { bail!("marker {END:?} missing") };
    Ok(format!("{before}{BEGIN}```text\n{dump}```\n{END}{after}"))
}

/// Two anchors, one with a value so far out that it takes the escape.
fn example() -> Result<Vec<u8>> {
    let shape = ModelShape {
        feature_dim: 2,
        n_offsets: 1,
        view_direction: false,
        view_distance: false,
        dilation_compensation: true,
    };
    let mut heads = Heads::filled(&shape, 0.25);
    heads.opacity.b2[0] = 1.0;
    heads.colour.b2[0] = 2.0;
    let scene = Scene {
        shape,
        voxel_size: 0.125,
        anchors: Anchors {
            lattice: vec![[-3, 0, 5], [2, 1, 5]],
            features: vec![0.5, -0.25, 0.75, -50.0],
            log_scales: vec![-1.0, -1.0, -1.0, -1.5, -1.5, -2.0, -1.0, -1.0, -1.25, -1.5, -1.5, -1.5],
            offsets: vec![0.25, 0.0, -0.5, 0.0, 0.5, 0.25],
            mask_logits: vec![1.0; 2],
        },
        heads,
        context: None,
    };
    let info = BundleInfo {
        normalisation: Normalisation { centre: DVec3::new(1.0, 2.0, -0.5), scale: 2.0 },
        background: [0, 0, 64],
        training_px: [32, 24],
        preview: Camera {
            rotation: DMat3::IDENTITY,
            translation: DVec3::new(0.0, 0.0, 2.0),
            focal_px: [32.0, 32.0],
            principal_px: [16.0, 12.0],
            width_px: 32,
            height_px: 24,
        },
    };
    let steps = QuantisationSteps { feature: 0.25, log_scale: 0.25, offset: 0.25 };
    bundle::write(&scene, &info, &steps).context("the example can not be written")
}
