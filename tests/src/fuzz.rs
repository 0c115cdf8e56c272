//! The bodies of the fuzz targets, as plain functions: any bytes go in, and a law that does not hold panics.
//!
//! `fuzz/` drives them with libFuzzer, the suite `fuzzing` with a seeded walk.

use pocketsplat_core::bundle::{AnchorSite, Section};
use pocketsplat_core::entropy::{AnsReader, NormalModel};
use pocketsplat_core::{
    Bundle, DecodeError, Decoder, ErrorClass, Field, FrameReport, MaxSplats, Residency, SectionKind, Strips,
};

use crate::frame::{Frame, budget_for};
use crate::seal::reseal;

/// Frames are drawn no larger than this, pixels: what is looked for does not depend on it, the time does.
const MAX_FRAME_PX: u16 = 48;

/// Everything that can be asked of a bundle without decoding has an answer or an error.
pub fn parse(bytes: &[u8]) {
    let bundle = match Bundle::parse(bytes) {
        Ok(bundle) => bundle,
        Err(error) => return check_blame(&error),
    };
    let header = bundle.header();
    let in_file = |section: Section| section.offset + section.len <= header.file_len;
    // A file that was cut has not all chunks.
    assert!(
        bundle.sections().all(|section| section.kind == SectionKind::Chunks || in_file(section)),
        "sections in the file"
    );
    assert!(bundle.sections().all(|section| section.offset.is_multiple_of(4)), "sections are aligned");
    assert!(bundle.n_tiers() >= 1 && bundle.n_tiers() <= header.n_tiers, "{} tiers", bundle.n_tiers());
    let chunks: Vec<_> = bundle.chunks().collect();
    assert_eq!(chunks.len(), bundle.n_chunks() as usize, "the directory holds what the tiers say");
    assert_eq!(chunks.iter().map(|chunk| u32::from(chunk.n_anchors())).sum::<u32>(), bundle.n_anchors(), "anchors");
    for (index, chunk) in (0..).zip(&chunks) {
        assert_eq!(bundle.chunk(index).map(|found| found.offset()), Ok(chunk.offset()), "chunk {index}");
        let (low, high) = chunk.ink_box();
        assert!(low.iter().zip(high).all(|(low, high)| *low <= high), "ink box of chunk {index}");
    }
    for tier in 0..header.n_tiers {
        assert!(bundle.tier(tier).is_some() && bundle.measures(tier).is_some(), "tier {tier}");
    }
    let mut weights = bundle.heads().weights();
    assert!((0..10).all(|_| weights.next_layer().all(f32::is_finite)), "weights are finite");
}

/// A bundle draws or is refused, and with damage left out it draws or is refused for another reason.
///
/// Checksums are made right first, so that damage gets behind them. Where anchors wait changes nothing.
pub fn draw(bytes: &[u8]) {
    let mut bytes = bytes.to_vec();
    reseal(&mut bytes);
    let Ok(bundle) = Bundle::parse(&bytes) else { return };
    for n_strips in [1, 2, 8] {
        let [streamed, resident] = [Residency::Streamed, Residency::Resident].map(|residency| {
            draw_either(&bundle, residency, n_strips)
                .map(|(frame, report)| (frame, report.splats, report.splats_dropped, report.first_damaged))
        });
        assert!(streamed == resident, "{n_strips} strips: where anchors wait changes nothing");
        if bundle.n_gaussians(0).is_none() {
            continue;
        }
        let baked = draw_either(&bundle, Residency::Baked, n_strips)
            .map(|(frame, report)| (frame, report.splats, report.splats_dropped, report.first_damaged));
        // Or the file says too few.
        let refused = matches!(baked, Err(DecodeError::OutOfRange { field: Field::TierGaussians, .. }));
        assert!(refused || baked == streamed, "{n_strips} strips: nor does it when Gaussians are kept");
    }
}

/// Draws with damage left out and, if there is none, without leave.
fn draw_either(bundle: &Bundle<'_>, residency: Residency, n_strips: u8) -> Result<(Frame, FrameReport), DecodeError> {
    let strict = draw_one(bundle, residency, n_strips, false);
    let skipping = draw_one(bundle, residency, n_strips, true);
    match (strict, &skipping) {
        (Ok(strict), Ok(skipping)) => {
            assert!(strict == *skipping, "without damage both draw the same");
            assert_eq!(skipping.1.chunks_damaged, 0, "nothing is left out in silence");
        }
        (Err(DecodeError::ChunkStream { chunk, .. }), Ok((_, report))) if residency == Residency::Streamed => {
            assert!(report.first_damaged.is_some_and(|first| first <= chunk), "{report:?} against chunk {chunk}");
            assert!(report.chunks_damaged > 0, "{report:?}");
        }
        // A damaged chunk may be out of view: checksums are compared, and chunks in memory decoded, when bound.
        (Err(DecodeError::ChunkChecksum { chunk, .. } | DecodeError::ChunkStream { chunk, .. }), Ok((_, report))) => {
            let named = report.first_damaged <= Some(chunk) || residency != Residency::Streamed;
            assert!(named, "{report:?} against chunk {chunk}");
        }
        (Err(strict), Err(skipping)) => assert_eq!(strict.class(), skipping.class(), "{strict} against {skipping}"),
        (strict, skipping) => panic!("{:?} against {:?}", strict.err(), skipping.as_ref().err()),
    }
    skipping
}

/// Symbols decode, and to the same values however they are read.
///
/// Checksums are made right first.
pub fn symbols(bytes: &[u8]) {
    let mut bytes = bytes.to_vec();
    reseal(&mut bytes);
    let Ok(bundle) = Bundle::parse(&bytes) else { return };
    let mut scratch = vec![0; bundle.anchor_scratch_words()];
    let mut models = bundle.anchor_models(&mut scratch).expect("as many words as asked for");
    let n_channels = bundle.header().n_channels();
    for chunk in bundle.chunks() {
        let n = usize::from(chunk.n_anchors());
        let (mut sites, mut symbols) = (vec![AnchorSite::default(); n], vec![0; n * n_channels]);
        let found = chunk.decode_symbols(&mut models, &mut sites, &mut symbols);
        let (mut same_sites, mut values) = (sites.clone(), vec![0.0; n * n_channels]);
        assert_eq!(chunk.decode_values(&mut models, &mut same_sites, &mut values), found, "chunk {}", chunk.index());
        if let Err(error) = found {
            check_blame(&error);
            continue;
        }
        assert_eq!(same_sites, sites, "chunk {}", chunk.index());
        assert!(values.iter().all(|value| value.is_finite()), "values of chunk {}", chunk.index());
        // Without masks a cell cannot be listed twice; the trie has no place for it.
        assert!(sites.windows(2).all(|pair| pair[0].lattice != pair[1].lattice), "cells of chunk {}", chunk.index());
    }
}

/// Whatever words a Gaussian model reads symbols from, its slots for those symbols are where they were read.
pub fn normal(bytes: &[u8]) {
    let (head, words) = bytes.split_at(bytes.len().min(2));
    let [mean, scale] = [0, 1].map(|at| i32::from(head.get(at).copied().unwrap_or(0).cast_signed()));
    let model = NormalModel::new(mean, scale);
    let (words, _) = words.as_chunks();
    let mut reader = AnsReader::new(words);
    for _ in 0..words.len() {
        let mut copy = reader;
        let symbol = model.symbol(&mut reader);
        for &(start, frequency) in model.slots(symbol).as_slice() {
            let slot = Slot { start, frequency };
            assert!(copy.symbol(&slot), "symbol {symbol} under {model:?}: not in {start} + {frequency}");
        }
    }
}

/// A slot on its own: was the symbol that was read in it?
struct Slot {
    start: u16,
    frequency: u16,
}

impl pocketsplat_core::entropy::SymbolModel for Slot {
    type Symbol = bool;

    fn slot(&self, quantile: u16) -> pocketsplat_core::entropy::Slot<bool> {
        let inside = quantile >= self.start && quantile - self.start < self.frequency;
        pocketsplat_core::entropy::Slot { symbol: inside, start: self.start, frequency: self.frequency }
    }
}

fn draw_one(
    bundle: &Bundle<'_>,
    residency: Residency,
    n_strips: u8,
    skip_damage: bool,
) -> Result<(Frame, FrameReport), DecodeError> {
    let preview = bundle.header().preview;
    let camera = preview.resized(preview.width_px.min(MAX_FRAME_PX), preview.height_px.min(MAX_FRAME_PX));
    let budget = budget_for(&camera)
        .with_max_splats(MaxSplats::AtMost(100_000))
        .with_residency(residency)
        .with_strips(Strips::Exactly(n_strips));
    let plan = bundle.plan(&budget)?;
    let mut scratch = vec![0; plan.scratch_len()];
    let bind = if skip_damage { Decoder::bind_skipping_damage } else { Decoder::bind };
    let mut frame = Frame::new(camera.width_px, camera.height_px);
    let result = bind(bundle, plan, &mut scratch).and_then(|mut decoder| Ok(decoder.render(&camera, &mut frame)?));
    if let Err(error) = &result {
        check_blame(error);
    }
    result.map(|report| (frame, report))
}

/// Nothing in a file makes the decoder blame itself.
fn check_blame(error: &DecodeError) {
    assert_ne!(error.class(), ErrorClass::Internal, "{error}");
}
