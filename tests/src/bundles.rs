//! Bundles with everything that the format offers, of all coders.

use pocketsplat_capture::camera::Camera;
use pocketsplat_codec::bundle::{self, ChannelCoding, CodedScene, WriteOptions, mean_steps};
use pocketsplat_codec::manifest;
use pocketsplat_format::Bundle;

use crate::frame::info_for;
use crate::scenes::{Case, cameras, masked, random_scene, with_context, with_levels};

/// What codes the symbols of a test bundle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coder {
    /// Tables of the context's mean steps.
    Static,
    /// The context of a grid.
    Context,
    /// The context of anchors that follow anchors.
    Levels,
}

/// Those whose frames and digests are kept.
pub const CODERS: [Coder; 2] = [Coder::Static, Coder::Context];
/// All.
pub const ALL_CODERS: [Coder; 3] = [Coder::Static, Coder::Context, Coder::Levels];

/// The pruning rates of the tiers: half of the anchors, three quarters, all.
const PRUNING_RATES: [f32; 3] = [0.5, 0.25, 0.0];

/// A bundle of three tiers with masks, the later anchors of the scene in the earlier tiers.
///
/// * `chunk_anchors`: anchors of a chunk at most.
pub fn tiered(case: &Case, coder: Coder, chunk_anchors: u16) -> Vec<u8> {
    coded(case, coder, chunk_anchors).into_file(&[]).expect("the writer's bundle is sound").bytes
}

fn coded(case: &Case, coder: Coder, chunk_anchors: u16) -> CodedScene {
    let scene = masked(random_scene(case), case.seed);
    let scene = if coder == Coder::Levels { with_levels(scene, case.seed) } else { with_context(scene, case.seed) };
    let channels = match coder {
        Coder::Static => ChannelCoding::Tables(mean_steps(&scene).expect("a scene with a context")),
        Coder::Context | Coder::Levels => ChannelCoding::Context,
    };
    let options = WriteOptions {
        channels,
        importance: Some((0..scene.anchors.len()).map(|anchor| anchor as f32).collect()),
        pruning_rates: PRUNING_RATES.to_vec(),
        chunk_anchors,
        ..WriteOptions::default()
    };
    bundle::code(&scene, &info_for(&cameras()[0].1), &options).expect("a test scene can be written")
}

/// The same with chunks of 32 anchors and a manifest measured over `views`, which are of the size of the first test camera.
pub fn measured(case: &Case, coder: Coder, views: &[Camera]) -> Vec<u8> {
    let coded = coded(case, coder, 32);
    let measures = manifest::measure(&coded.bundle().expect("the writer's sections are sound"), views, &[]);
    coded.into_file(&measures.expect("sound chunks")).expect("the writer's bundle is sound").bytes
}

/// Where the chunks of a bundle begin, bytes from the start of its file.
pub fn chunks_offset(bundle: &Bundle<'_>) -> usize {
    bundle.sections().last().expect("a bundle has sections").offset as usize
}

/// The lengths at which a file of this bundle is a sound smaller scene or itself, one a tier.
pub fn tier_ends(bundle: &Bundle<'_>) -> Vec<usize> {
    let end = |tier| bundle.tier(tier).map(|tier| chunks_offset(bundle) + tier.end as usize);
    (0..bundle.header().n_tiers).filter_map(end).collect()
}
