//! Bundles made by hand, with every feature and without: they draw alike in whatever way, and damage is named or left out.

use std::convert::Infallible;

use pocketsplat_core::{
    Budget, Decoder, FrameReport, MaxSplats, Overflow, Plan, Residency, ScratchShape, Strips, Tile, TileSink,
};
use pocketsplat_format as format;
use pocketsplat_format::bundle::{AnchorSite, crc32};
use pocketsplat_format::entropy::{FREQUENCY_TOTAL, PRECISION_BITS, Slot, SymbolModel};
use pocketsplat_format::{Bundle, DecodeError, Field};

use builder::{C, F, bundle, tiers, variants};

#[path = "../../decoder-format/src/bundle/tests/builder.rs"]
mod builder;
#[path = "../../decoder-format/src/entropy/testing.rs"]
mod testing;

/// Keeps all pixels.
#[derive(Default, PartialEq)]
struct Pixels(Vec<[u8; 3]>);

impl TileSink for Pixels {
    type Error = Infallible;

    fn tile(&mut self, tile: Tile<'_>) -> Result<(), Infallible> {
        self.0.extend_from_slice(tile.rgb);
        Ok(())
    }
}

/// One strip, anchors in the file, places for every splat.
const BUDGET: Budget = Budget::for_frame(32, 24)
    .with_max_splats(MaxSplats::Worst)
    .with_residency(Residency::Streamed)
    .with_strips(Strips::Exactly(1));

fn draw(bytes: &[u8], tiers: u8, skip_damage: bool) -> Result<(Pixels, FrameReport, u8), DecodeError> {
    draw_within(bytes, &BUDGET.with_tiers(tiers), skip_damage)
}

fn draw_within(bytes: &[u8], budget: &Budget, skip_damage: bool) -> Result<(Pixels, FrameReport, u8), DecodeError> {
    let bundle = Bundle::parse(bytes)?;
    let plan = Plan::new(&bundle, &if skip_damage { budget.skipping_damage() } else { *budget })?;
    let mut scratch = vec![0x5A; plan.scratch_len()];
    let mut pixels = Pixels::default();
    let report = Decoder::bind(&bundle, plan, &mut scratch)?.render(&bundle.header().preview, &mut pixels)?;
    Ok((pixels, report, plan.n_tiers()))
}

#[test]
fn a_budget_of_tiers_draws_what_a_cut_file_draws() {
    for variant in variants() {
        let bytes = bundle(variant);
        let whole = Bundle::parse(&bytes).expect("sound");
        let chunks_at = bytes.len() - whole.tier(2).expect("the last tier").end as usize;
        for n_tiers in 1..=3 {
            let cut = &bytes[..chunks_at + whole.tier(n_tiers - 1).expect("a tier").end as usize];
            let (planned, report, planned_tiers) = draw(&bytes, n_tiers, false).expect("drawn");
            let (short, short_report, short_tiers) = draw(cut, u8::MAX, false).expect("drawn");
            assert!(planned == short, "{variant:?}: the same picture with {n_tiers} tiers");
            assert_eq!((report, planned_tiers), (short_report, short_tiers), "{variant:?}");
            assert_eq!(report.chunks_decoded, [2, 3, 5][usize::from(n_tiers) - 1], "{variant:?}: all are in view");
        }
        let none = DecodeError::OutOfRange { field: Field::Tiers, found: 0, limit: 1 };
        assert_eq!(draw(&bytes, 0, false).map(|_| ()), Err(none), "a budget of no tiers");
    }
}

#[test]
fn a_damaged_chunk_is_named_or_left_out() {
    for variant in variants() {
        let sound = bundle(variant);
        let whole = Bundle::parse(&sound).expect("sound");
        let chunk = whole.chunk(3).expect("a chunk");
        let chunks_at = sound.len() - whole.tier(2).expect("the last tier").end as usize;
        let mut bytes = sound.clone();
        bytes[chunks_at + chunk.offset() as usize] ^= 4;
        let error = draw(&bytes, 3, false).err();
        assert!(matches!(error, Some(DecodeError::ChunkChecksum { chunk: 3, .. })), "{variant:?}: {error:?}");
        let (_, report, _) = draw(&bytes, 3, true).expect("the others draw");
        assert_eq!((report.chunks_damaged, report.first_damaged), (1, Some(3)), "{variant:?}");
        assert_eq!(report.anchors_decoded, 13, "{variant:?}: two of 15 are in the damaged chunk");
        assert_eq!(draw(&bytes, 2, false).err(), None, "{variant:?}: the first two tiers are sound");
    }
}

#[test]
fn symbols_beyond_the_bits_of_the_header_are_refused_wherever_they_are_decoded() {
    for variant in variants() {
        let whole = bundle(variant);
        let header_len = usize::from(Bundle::parse(&whole).expect("sound").header().header_len);
        let with_bits = |bits: u8| {
            let mut bytes = whole.clone();
            bytes[156..159].fill(bits);
            let crc = crc32(&bytes[..header_len - 4]);
            bytes[header_len - 4..header_len].copy_from_slice(&crc.to_le_bytes());
            bytes
        };
        let most = (tiers(variant).iter().flatten().flatten())
            .flat_map(|anchor| anchor.symbols)
            .map(|symbol| (0..16).find(|&bits| i32::from(symbol) >= -1 << bits && i32::from(symbol) < 1 << bits))
            .max();
        let most = 1 + most.flatten().expect("symbols have 16 bits") as u8;
        for residency in [Residency::Resident, Residency::Streamed] {
            let frame =
                |bytes: &[u8]| draw_within(bytes, &BUDGET.with_residency(residency), false).map(|(pixels, ..)| pixels);
            assert!(frame(&with_bits(most)) == frame(&whole), "{variant:?}: bits enough change nothing");
            let error = frame(&with_bits(most - 1)).err();
            assert!(matches!(error, Some(DecodeError::ChunkStream { .. })), "{variant:?}, {residency:?}: {error:?}");
        }
        // Of one group only, in the chunks that have such a symbol.
        for (group, channels) in [0..F, F..F + 6, F + 6..C].into_iter().enumerate() {
            for bits in 1..=16 {
                let mut bytes = with_bits(16);
                bytes[156 + group] = bits;
                let crc = crc32(&bytes[..header_len - 4]);
                bytes[header_len - 4..header_len].copy_from_slice(&crc.to_le_bytes());
                let file = Bundle::parse(&bytes).expect("sound");
                let mut scratch = vec![0; file.anchor_scratch_words()];
                let mut models = file.anchor_models(&mut scratch).expect("enough memory");
                for (chunk, anchors) in file.chunks().zip(tiers(variant).concat()) {
                    let (mut sites, mut found) = (vec![AnchorSite::default(); 5], vec![0; 5 * C]);
                    let beyond = anchors
                        .iter()
                        .flat_map(|anchor| &anchor.symbols[channels.clone()])
                        .any(|&symbol| !(-1 << (bits - 1)..1 << (bits - 1)).contains(&i32::from(symbol)));
                    let index = chunk.index();
                    let expected =
                        if beyond { Err(DecodeError::ChunkStream { chunk: index, left_bytes: 0 }) } else { Ok(()) };
                    let result = chunk.decode_symbols(&mut models, &mut sites, &mut found);
                    assert_eq!(result, expected, "{variant:?}: group {group} of {bits} bits, chunk {index}");
                }
            }
        }
        let error = Bundle::parse(&with_bits(17)).err();
        let expected = DecodeError::OutOfRange { field: Field::SymbolBits, found: 17, limit: 16 };
        assert_eq!(error, Some(expected), "{variant:?}");
    }
}

#[test]
fn damage_is_left_out_alike_wherever_anchors_wait_and_in_all_strips() {
    for variant in variants() {
        let sound = bundle(variant);
        let whole = Bundle::parse(&sound).expect("sound");
        let chunk = whole.chunk(1).expect("a chunk");
        let chunks_at = sound.len() - whole.tier(2).expect("the last tier").end as usize;
        let mut bytes = sound.clone();
        bytes[chunks_at + chunk.offset() as usize] ^= 4;
        let (expected, expected_report, _) = draw(&bytes, 3, true).expect("the others draw");
        let ways = [
            (Residency::Resident, 1, Overflow::LeaveOut),
            (Residency::Resident, 2, Overflow::LeaveOut),
            (Residency::Streamed, 2, Overflow::LeaveOut),
            (Residency::Resident, 1, Overflow::Slabs),
            (Residency::Streamed, 2, Overflow::Slabs),
        ];
        for (residency, n_strips, overflow) in ways {
            let budget =
                BUDGET.with_residency(residency).with_strips(Strips::Exactly(n_strips)).with_overflow(overflow);
            let few = MaxSplats::AtMost(expected_report.splats / 4);
            let budget = if overflow == Overflow::Slabs { budget.with_max_splats(few) } else { budget };
            let (pixels, report, _) = draw_within(&bytes, &budget, true).expect("the others draw");
            assert!(pixels == expected, "{variant:?}: {residency:?}, {n_strips} strips, {overflow:?}");
            assert_eq!(report.slabs > 2, overflow == Overflow::Slabs, "{variant:?}: {report:?}");
            let damage = |report: FrameReport| (report.chunks_damaged, report.first_damaged, report.splats);
            assert_eq!(
                damage(report),
                damage(expected_report),
                "{variant:?}: {residency:?}, {n_strips} strips, {overflow:?}"
            );
            let error = draw_within(&bytes, &budget, false).err();
            assert!(matches!(error, Some(DecodeError::ChunkChecksum { chunk: 1, .. })), "{variant:?}: {error:?}");
        }
    }
}

#[test]
fn the_largest_shape_suffices_for_every_plan() {
    for variant in variants() {
        let bytes = bundle(variant);
        let bundle = Bundle::parse(&bytes).expect("sound");
        for residency in [Residency::Resident, Residency::Streamed] {
            let plan = Plan::new(&bundle, &BUDGET.with_residency(residency)).expect("a plan");
            assert_eq!(plan.scratch_len(), plan.shape().scratch_len(), "{variant:?}: its own shape");
            let ScratchShape { model, resident, frame, .. } = *plan.shape();
            let most = ScratchShape { resident, frame, ..ScratchShape::most(model.feature_dim, model.n_offsets) };
            assert!(most.scratch_len() >= plan.scratch_len(), "{variant:?}, {residency:?}: {most:?}");
        }
    }
}
