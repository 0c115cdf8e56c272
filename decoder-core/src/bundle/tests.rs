//! Bundles made by hand come back as what went into them.

mod builder;
mod emit;
mod places;

use core::convert::Infallible;
use std::vec;
use std::vec::Vec;

use builder::{Anchor, C, F, ORIGIN, STEP, Variant, bundle, cell, hidden, tiers, weight};

use crate::arena::Arena;
use crate::bundle::{AnchorRecords, AnchorSite, Bundle, Coder, RecordMemory, Tables, crc32};
use crate::context::{Context, Group};
use crate::entropy::NormalModel;
use crate::error::{DecodeError, ErrorClass, Field, SectionKind};
use crate::{Budget, Decoder, FrameReport, MaxSplats, Overflow, Residency, ScratchShape, Strips, Tile, TileSink};

fn variants() -> impl Iterator<Item = Variant> {
    (0..3 << 5).map(|bits| {
        let [masks, context, coded_heads, unknown_section, detail] = [1, 2, 4, 8, 16].map(|bit| bits & bit != 0);
        let (n_taps, levels) = (2 * u8::from(bits >> 5 == 1), bits >> 5 == 2);
        Variant { masks, context, n_taps, levels, coded_heads, unknown_section, detail }
    })
}

/// Decodes every chunk of a file: sites and symbols, chunk by chunk.
fn symbols(bundle: &Bundle<'_>) -> Vec<(Vec<AnchorSite>, Vec<i16>)> {
    let mut scratch = vec![u32::MAX; bundle.anchor_scratch_words()];
    let mut models = bundle.anchor_models(&mut scratch).expect("enough memory");
    let decoded = bundle.chunks().map(|chunk| {
        let n = usize::from(chunk.n_anchors());
        let (mut sites, mut symbols) = (vec![AnchorSite::default(); n], vec![-1; n * C]);
        chunk.decode_symbols(&mut models, &mut sites, &mut symbols).expect("a sound chunk");
        (sites, symbols)
    });
    decoded.collect()
}

fn expected(chunks: &[Vec<Anchor>]) -> Vec<(Vec<AnchorSite>, Vec<i16>)> {
    let chunk = |anchors: &Vec<Anchor>| {
        let sites = anchors.iter().map(|anchor| AnchorSite { lattice: cell(anchor.code), mask: anchor.mask });
        (sites.collect(), anchors.iter().flat_map(|anchor| anchor.symbols).collect())
    };
    chunks.iter().map(chunk).collect()
}

#[test]
fn anchors_come_back_whatever_the_features() {
    for variant in variants() {
        let bytes = bundle(variant);
        let bundle = Bundle::parse(&bytes).unwrap_or_else(|error| panic!("{variant:?}: {error}"));
        assert_eq!(symbols(&bundle), expected(&tiers(variant).concat()), "{variant:?}");
        assert_eq!((bundle.n_tiers(), bundle.n_chunks(), bundle.n_anchors()), (3, 5, 15), "{variant:?}");
        assert_eq!(bundle.sections().count(), 6 + usize::from(variant.masks) + usize::from(variant.unknown_section));
    }
}

#[test]
fn another_version_is_refused_before_anything_else() {
    let mut bytes = bundle(variants().next().expect("some"));
    for found in [0, 1, 2, 3, 5, 255] {
        bytes[8] = found;
        let expected = DecodeError::UnsupportedVersion { found: found.into(), supported: 4 };
        assert_eq!(Bundle::parse(&bytes).err(), Some(expected));
    }
}

#[test]
fn a_colour_behind_a_scene_without_a_background_is_refused() {
    let mut bytes = bundle(variants().next().expect("some"));
    bytes[17] &= !1;
    let crc_at = usize::from(u16::from_le_bytes([bytes[10], bytes[11]])) - 4;
    let crc = crc32(&bytes[..crc_at]).to_le_bytes();
    bytes[crc_at..][..4].copy_from_slice(&crc);
    let expected = DecodeError::OutOfRange { field: Field::Background, found: 10, limit: 0 };
    assert_eq!(Bundle::parse(&bytes).err(), Some(expected));
}

#[test]
fn a_preview_that_is_no_rotation_is_refused() {
    let mut bytes = bundle(variants().next().expect("some"));
    let crc_at = usize::from(u16::from_le_bytes([bytes[10], bytes[11]])) - 4;
    // Each number of the matrix, moved by what is allowed and by more.
    for index in 0..9 {
        let place = 88 + 4 * index..92 + 4 * index;
        let number = f32::from_le_bytes(bytes[place.clone()].try_into().expect("four bytes"));
        for (moved, refused) in [(0.007, false), (0.04, true), (-0.04, true), (f32::INFINITY, true)] {
            bytes[place.clone()].copy_from_slice(&(number + moved).to_le_bytes());
            let crc = crc32(&bytes[..crc_at]).to_le_bytes();
            bytes[crc_at..][..4].copy_from_slice(&crc);
            let error = Bundle::parse(&bytes).err();
            assert_eq!(error.is_some(), refused, "number {index}, moved by {moved}: {error:?}");
            let Some(error) = error else { continue };
            assert_eq!(error.class(), ErrorClass::Malformed, "number {index}, moved by {moved}: {error}");
            let named =
                matches!(error, DecodeError::OutOfRange { field: Field::PreviewRotation, found: 301.., limit: 300 });
            assert!(named || moved == f32::INFINITY, "number {index}, moved by {moved}: {error}");
        }
        bytes[place].copy_from_slice(&number.to_le_bytes());
    }
}

#[test]
fn values_are_symbols_times_steps() {
    for variant in variants() {
        let bytes = bundle(variant);
        let bundle = Bundle::parse(&bytes).expect("sound");
        let mut scratch = vec![0; bundle.anchor_scratch_words()];
        let mut models = bundle.anchor_models(&mut scratch).expect("enough memory");
        for (chunk, anchors) in bundle.chunks().zip(tiers(variant).concat()) {
            let (mut sites, mut values) = (vec![AnchorSite::default(); anchors.len()], vec![9.0; anchors.len() * C]);
            chunk.decode_values(&mut models, &mut sites, &mut values).expect("a sound chunk");
            for (index, (anchor, row)) in anchors.iter().zip(values.chunks(C)).enumerate() {
                for (channel, (&symbol, &value)) in anchor.symbols.iter().zip(row).enumerate() {
                    let drawn = channel < F + 6 || anchor.mask >> ((channel - F - 6) / 3) & 1 == 1;
                    let expected = match bundle.coder() {
                        _ if !drawn => 0.0,
                        Coder::Static(_) => f32::from(symbol) * STEP + ORIGIN,
                        Coder::Context(context) => {
                            let (network, hidden) = hidden(context, &anchors, index);
                            f32::from(symbol) * network.steps(&hidden).value(context.group(channel))
                        }
                    };
                    assert_eq!(value, expected, "{variant:?}, channel {channel}");
                }
            }
        }
    }
}

/// Section 7 of FORMAT.md by hand, in numbers that cannot overflow.
#[test]
fn taps_move_the_means_of_features() {
    for variant in variants().filter(|variant| variant.context && variant.n_taps > 0) {
        let bytes = bundle(variant);
        let bundle = Bundle::parse(&bytes).expect("sound");
        let context = bundle.context().expect("one");
        let weights: Vec<i64> = (0..5).map(|i| i64::from((i * 59 + 40) as u8 as i8)).collect();
        let rows: [&[i64]; F] = [&[], &weights[..1], &weights[1..3], &weights[3..5]];
        for anchor in tiers(variant).concat().concat() {
            let (mut features, mut hidden) = (vec![0; context.n_inputs()], vec![0; context.n_hidden()]);
            context.features(cell(anchor.code), &mut features);
            let network = context.network(0);
            network.hidden(&features, &mut hidden);
            let steps = network.steps(&hidden);
            let q = steps.exponent(Group::Feature);
            let factor = (4096.0 * 2f64.powf(-f64::from(q & 7) / 8.0)).round() as i64 * (1 << -(q >> 3).min(0));
            let mut residuals: Vec<i16> = vec![];
            for (feature, (row, &symbol)) in rows.into_iter().zip(&anchor.symbols).enumerate() {
                let own8 = (i64::from(network.output(feature, &hidden)) * factor + (1 << 14)) >> 15;
                let before = &residuals[feature - row.len()..];
                let sum: i64 = row.iter().zip(before).map(|(weight, &residual)| weight * i64::from(residual)).sum();
                let mean8 = (own8 + 4 + ((64 + sum) >> 7)).clamp(-32768, 32767) - 4;
                let scale = i32::from(network.output(C + feature, &hidden)) - q + 32;
                let expected = NormalModel::new(mean8 as i32, scale);
                assert_eq!(network.model(feature, &steps, &hidden, &residuals), expected, "feature {feature}");
                residuals.push((8 * i64::from(symbol) - own8).clamp(-32768, 32767) as i16);
                let found = network.residual(feature, &steps, &hidden, symbol);
                assert_eq!(Some(&found), residuals.last(), "feature {feature}");
            }
        }
    }
}

/// Encoder and decoder limit a mean at the same place, which without taps is nowhere.
#[test]
fn means_at_the_end_of_their_range_are_the_same_at_both_ends() {
    for variant in variants().filter(|variant| variant.context && !variant.levels) {
        let mut section = builder::context_section(variant);
        let n_out = 2 * C + 3;
        // After the head, two levels and all shifts; the first mean's bias, then that of the features' step.
        let b2 = 40 + 2 * 8 + 3 + n_out + 3 * 4;
        for (output, bias) in [(0, 1_i32 << 29), (2 * C, -(1 << 29))] {
            section[b2 + 4 * output..][..4].copy_from_slice(&bias.to_le_bytes());
        }
        let context = Context::parse(&section, F, 6, C).expect("a sound section");
        let (network, hidden) = (context.network(0), [0; 3]);
        let steps = network.steps(&hidden);
        assert_eq!((network.output(0, &hidden), steps.exponent(Group::Feature)), (i16::MAX, -24));
        let step = steps.of(Group::Feature);
        let raised_mean = step.raised_mean(i16::MAX);
        assert!(raised_mean > i16::MAX.into(), "beyond it: {raised_mean}");
        let decoders = if variant.n_taps == 0 { raised_mean } else { context.moved(0, raised_mean, &[]) };
        let scale = network.output(C, &hidden);
        assert_eq!(network.model(0, &steps, &hidden, &[]), step.model(decoders, scale), "{variant:?}");
    }
}

#[test]
fn heads_come_back_raw_and_coded() {
    for variant in variants() {
        let bytes = bundle(variant);
        let bundle = Bundle::parse(&bytes).expect("sound");
        let mut weights = bundle.heads().weights();
        for layer in 0..6 + 2 * usize::from(variant.detail) {
            let found: Vec<f32> = weights.next_layer().collect();
            let expected: Vec<f32> = (0..found.len()).map(|index| weight(layer, index)).collect();
            assert_eq!(found, expected, "{variant:?}, layer {layer}");
        }
        assert_eq!(weights.next_layer().count(), 0, "there is no other");
        assert_eq!(bundle.heads().coded().is_some(), variant.coded_heads);
    }
}

#[test]
fn the_manifest_says_what_was_measured() {
    let plain = variants().next().expect("the first has nothing");
    let bytes = bundle(Variant { masks: true, ..plain });
    let bundle = Bundle::parse(&bytes).expect("sound");
    let [first, last] = [0, 2].map(|tier| bundle.measures(tier).expect("a tier"));
    assert_eq!((first.psnr_db, last.psnr_db), (None, Some(32.0)));
    assert_eq!((last.n_views, last.n_cameras, last.max_visible_anchors), (4, 9, 200));
    assert_eq!((last.max_strip_splats, last.max_strip_pairs), ([202, 203, 204, 205], [206, 207, 208, 209]));
    assert_eq!((last.max_head_kilo_macs, last.max_kilo_pixels, last.max_decoded_anchors), (210, 211, 212));
    assert_eq!((first.level, last.level), (0, 2), "the levels declared");
    assert_eq!(bundle.measures(3), None, "three tiers");
}

#[test]
fn a_file_cut_where_a_tier_ends_is_a_smaller_scene_and_any_other_is_refused() {
    for variant in variants() {
        let bytes = bundle(variant);
        let whole = Bundle::parse(&bytes).expect("sound");
        let chunks_at = bytes.len() - whole.tier(2).expect("the last tier").end as usize;
        let ends: Vec<usize> = (0..3).map(|tier| chunks_at + whole.tier(tier).expect("a tier").end as usize).collect();
        for len in 0..=bytes.len() {
            match (Bundle::parse(&bytes[..len]), ends.iter().position(|&end| end == len)) {
                (Ok(bundle), Some(tier)) => {
                    assert_eq!(usize::from(bundle.n_tiers()), tier + 1, "cut to {len} bytes");
                    assert_eq!(symbols(&bundle), expected(&tiers(variant)[..=tier].concat()), "cut to {len} bytes");
                    assert_eq!(bundle.header().n_tiers, 3, "as written");
                }
                (Err(DecodeError::NotABundle), None) => assert!(len < 8, "cut to {len} bytes"),
                (Err(DecodeError::Truncated { section, .. }), None) => {
                    assert_eq!(section == SectionKind::Chunks, len >= chunks_at, "cut to {len} bytes: {section}");
                }
                (result, tier) => panic!("cut to {len} bytes: {tier:?}, {:?}", result.err()),
            }
        }
    }
}

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
    let plan = bundle.plan(&Budget { skips_damage: skip_damage, ..*budget })?;
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
fn anchors_in_memory_have_the_values_of_the_file() {
    for variant in variants() {
        let bytes = bundle(variant);
        let bundle = Bundle::parse(&bytes).expect("sound");
        let plan = bundle.plan(&BUDGET.with_residency(Residency::Resident)).expect("a plan");
        let (n_anchors, layout) = (bundle.n_anchors() as usize, plan.shape().record_layout());
        let mut scratch = vec![u32::MAX; bundle.anchor_scratch_words()];
        let mut models = bundle.anchor_models(&mut scratch).expect("enough memory");
        let mut memory = vec![0xA5; Arena::bytes_for(4000).expect("few")];
        let mut arena = Arena::new(&mut memory);
        let mut memory = RecordMemory {
            records: arena.take(n_anchors * layout.len()).expect("enough"),
            damaged: arena.take(1).expect("enough"),
            scales: arena.take(bundle.tables().map_or(0, Tables::len)).expect("enough"),
        };
        let n_chunks = bundle.n_chunks() as usize;
        let mut words = vec![u32::MAX; bundle.anchor_scratch_words()];
        memory.decode(&bundle, n_chunks, &layout, &mut [0.0; C], &mut words, false).expect("sound");
        let records = AnchorRecords::new(&bundle, layout, memory).expect("sound");
        let mut index = 0;
        for chunk in bundle.chunks() {
            let mut anchors = chunk.anchors(&mut models);
            for _ in 0..chunk.n_anchors() {
                let (site, mut expected, mut row) = (anchors.site(), [0.0; C], [f32::NAN; C]);
                anchors.values(&mut expected);
                assert_eq!(records.read(index, &mut row), Some(site), "{variant:?}: site of anchor {index}");
                assert_eq!(row.map(f32::to_bits), expected.map(f32::to_bits), "{variant:?}: values of anchor {index}");
                index += 1;
            }
        }
        assert_eq!(index as usize, n_anchors, "{variant:?}: all of them");
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
            let plan = bundle.plan(&BUDGET.with_residency(residency)).expect("a plan");
            assert_eq!(plan.scratch_len(), plan.shape().scratch_len(), "{variant:?}: its own shape");
            let ScratchShape { model, resident, frame, .. } = *plan.shape();
            let most = ScratchShape { resident, frame, ..ScratchShape::most(model.feature_dim, model.n_offsets) };
            assert!(most.scratch_len() >= plan.scratch_len(), "{variant:?}, {residency:?}: {most:?}");
        }
    }
}
