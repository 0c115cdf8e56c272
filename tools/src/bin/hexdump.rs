//! Prints a bundle byte by byte, every byte with the field it belongs to.
//!
//! With `--check FORMAT.md` it compares the examples of the format document, and their bundles beside it, with the dumps and
//! the bytes of scenes made by hand; with `--write FORMAT.md` it puts them there.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::Parser;
use glam::{DMat3, DVec3};
use pocketsplat_capture::camera::Camera;
use pocketsplat_capture::dataset::Normalisation;
use pocketsplat_codec::bundle::{self, BundleInfo, ChannelCoding, WriteOptions, annotate::annotate};
use pocketsplat_format::context::{GridFrame, GridLevel, LevelKind};
use pocketsplat_kernels::scene::QuantisationSteps;
use pocketsplat_kernels::scene::{Anchors, ContextModel, Heads, ModelShape, Scene};

/// The document when none is named.
const FORMAT_DOC: &str = "decoder-format/src/bundle/FORMAT.md";
/// Steps of the example with tables.
const STEPS: QuantisationSteps = QuantisationSteps { feature: 0.25, log_scale: 0.25, offset: 0.25 };
/// The examples: name in the document's markers, coding, bundle beside the document.
const EXAMPLES: [(&str, ChannelCoding, &str); 2] = [
    ("static", ChannelCoding::Tables(STEPS), "example.psb"),
    ("context", ChannelCoding::Context, "example-context.psb"),
];

/// Annotates a bundle, or the format document's examples.
#[derive(Parser)]
struct Args {
    /// The bundle to print; without it, the examples.
    bundle: Option<PathBuf>,
    /// Compare the examples in this document and fail on a difference.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = FORMAT_DOC)]
    #[arg(conflicts_with_all = ["bundle", "write"])]
    check: Option<PathBuf>,
    /// Put the examples into this document.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = FORMAT_DOC, conflicts_with = "bundle")]
    write: Option<PathBuf>,
}

fn main() -> Result<()> {
    let args = Args::parse();
    if let Some(path) = &args.bundle {
        let bytes = std::fs::read(path).with_context(|| format!("{}: cannot be read", path.display()))?;
        print!("{}", dump(&bytes)?);
        return Ok(());
    }
    let Some(document) = args.check.as_ref().or(args.write.as_ref()) else {
        for (name, channels, _) in EXAMPLES {
            println!("{name}\n{}", dump(&example(channels)?)?);
        }
        return Ok(());
    };
    let text = std::fs::read_to_string(document).with_context(|| format!("{}: cannot be read", document.display()))?;
    let mut fresh = text.clone();
    for (name, channels, file) in EXAMPLES {
        let bytes = example(channels)?;
        fresh = with_example(&fresh, name, &dump(&bytes)?)
            .with_context(|| format!("{}: no place for the dump", document.display()))?;
        let bundle = document.with_file_name(file);
        if args.check.is_some() {
            ensure!(std::fs::read(&bundle).is_ok_and(|stored| stored == bytes), differs(document, &bundle));
        } else {
            std::fs::write(&bundle, bytes).with_context(|| format!("{}: cannot be written", bundle.display()))?;
        }
    }
    if args.check.is_some() {
        ensure!(text == fresh, differs(document, document));
        return Ok(());
    }
    std::fs::write(document, fresh).with_context(|| format!("{}: cannot be written", document.display()))
}

fn dump(bytes: &[u8]) -> Result<String> {
    annotate(bytes, usize::MAX).context("not a sound bundle")
}

fn differs(document: &Path, file: &Path) -> String {
    format!(
        "{}: the example differs from the writer's bytes; run `cargo run -p tools --bin hexdump -- --write {}` and read the \
         change",
        file.display(),
        document.display()
    )
}

/// The document with the text between an example's markers replaced.
fn with_example(text: &str, name: &str, dump: &str) -> Result<String> {
    let [begin, end] = ["begin", "end"].map(|edge| format!("<!-- hexdump {name} {edge} -->\n"));
    let (before, rest) = text.split_once(&begin).with_context(|| format!("marker {begin:?} missing"))?;
    let (_, after) = rest.split_once(&end).with_context(|| format!("marker {end:?} missing"))?;
    Ok(format!("{before}{begin}```text\n{dump}```\n{end}{after}"))
}

/// Three anchors in two tiers, one of them with a hidden offset, one with a value so far out that it takes the escape; the
/// other example has a context model of one level and two hidden units, coded heads, and a detail head of one unit.
fn example(channels: ChannelCoding) -> Result<Vec<u8>> {
    let has_context = channels == ChannelCoding::Context;
    let detail_hidden = usize::from(has_context);
    let shape = ModelShape { dilation_compensation: true, detail_hidden, ..ModelShape::plain(2, 2) };
    let mut heads = Heads::filled(&shape, 0.25);
    (heads.opacity.w1[0], heads.covariance.w2[3]) = (0.5, -0.25);
    (heads.opacity.b2[0], heads.colour.b2[0]) = (1.0, 2.0);
    let scene = Scene {
        shape,
        voxel_size: 0.125,
        anchors: Anchors {
            lattice: vec![[-3, 0, 5], [2, 1, 5], [2, 0, 5]],
            features: vec![0.5, -0.25, 0.75, -50.0, 0.5, 0.0],
            log_scales: [-1.0, -1.0, -1.0, -1.5, -1.5, -2.0].repeat(3),
            offsets: vec![
                0.25, 0.0, -0.5, 0.5, 0.5, 0.0, 0.0, 0.5, 0.25, 0.0, 0.0, 0.0, 0.25, 0.25, 0.0, -0.25, 0.0, 0.0,
            ],
            mask_logits: vec![1.0, 1.0, 1.0, -10.0, 1.0, 1.0],
            prune_rank: vec![],
            view_weights: vec![],
        },
        heads,
        context: has_context.then(|| context(&shape)),
    };
    let info = BundleInfo {
        normalisation: Normalisation { centre: DVec3::new(1.0, 2.0, -0.5), scale: 2.0 },
        background: [0, 0, 64],
        training_px: [32, 24],
        protocol: None,
        preview: Camera {
            rotation: DMat3::IDENTITY,
            translation: DVec3::new(0.0, 0.0, 2.0),
            focal_px: [32.0, 32.0],
            principal_px: [16.0, 12.0],
            width_px: 32,
            height_px: 24,
        },
    };
    let options = WriteOptions {
        channels,
        importance: Some(vec![3.0, 1.0, 2.0]),
        pruning_rates: vec![0.4, 0.0],
        head_fraction_bits: has_context.then_some([2, 2]),
        ..WriteOptions::default()
    };
    Ok(bundle::write(&scene, &info, &options).context("the example cannot be written")?.bytes)
}

/// Means at 0, deviations of one to four base steps, steps of a base step at one end of the x axis and half of one at the
/// other.
fn context(shape: &ModelShape) -> ContextModel<f32> {
    let frame = GridFrame::spanning([-3, 0, 5], [2, 1, 5]);
    let levels = vec![GridLevel { kind: LevelKind::Volume, resolution: 2, n_rows: 8 }];
    let mut model = ContextModel::filled(shape, frame, levels, 2, [0.25, 0.25, 0.25], 0.0);
    // x is the axis that changes fastest from row to row.
    for (row, signs) in model.rows.chunks_mut(4).enumerate() {
        signs.fill(if row % 2 == 1 { 1.0 } else { -1.0 });
    }
    model.networks[0].mlp.w1[0] = 1.0;
    let n_channels = shape.values_per_anchor();
    model.networks[0].mlp.b2[n_channels..2 * n_channels].fill(1.0);
    for output in n_channels..model.networks[0].mlp.n_out {
        model.networks[0].mlp.w2[2 * output] = if output < 2 * n_channels { 1.0 } else { -1.0 };
    }
    model
}
