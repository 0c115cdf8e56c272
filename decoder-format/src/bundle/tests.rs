//! Bundles made by hand come back as what went into them.

mod builder;
mod emit;
mod places;

use std::vec;
use std::vec::Vec;

use builder::{Anchor, C, F, ORIGIN, STEP, Variant, bundle, cell, hidden, tiers, variants, weight};

use crate as format;
use crate::bundle::{AnchorRecords, AnchorSite, Bundle, Coder, RecordLayout, RecordMemory, Tables, crc32};
use crate::context::{Context, Group};
use crate::entropy::{NormalModel, testing};
use crate::error::{DecodeError, ErrorClass, Field, SectionKind};

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

#[test]
fn anchors_in_memory_have_the_values_of_the_file() {
    for variant in variants() {
        let bytes = bundle(variant);
        let bundle = Bundle::parse(&bytes).expect("sound");
        let header = bundle.header();
        let masked_offsets = if bundle.masks().is_some() { header.n_offsets } else { 0 };
        let layout = RecordLayout::new(
            header.feature_dim,
            header.n_log_scales(),
            header.n_offsets,
            header.symbol_bits,
            bundle.lattice().bits,
            masked_offsets,
            variant.context,
        );
        let n_anchors = bundle.n_anchors() as usize;
        let mut scratch = vec![u32::MAX; bundle.anchor_scratch_words()];
        let mut models = bundle.anchor_models(&mut scratch).expect("enough memory");
        let mut memory = RecordMemory {
            records: &mut vec![0xA5A5; n_anchors * layout.n_words()],
            damaged: &mut [u32::MAX],
            scales: &mut vec![[f32::NAN; 2]; bundle.tables().map_or(0, Tables::len)],
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
                let (mut row, n_features) = ([f32::NAN; C], usize::from(bundle.header().feature_dim));
                assert_eq!(records.without_features().read(index, &mut row), Some(site));
                assert!(row[..n_features].iter().all(|x| x.is_nan()), "{variant:?}: features of anchor {index}");
                assert_eq!(row[n_features..], expected[n_features..], "{variant:?}: the rest of anchor {index}");
                index += 1;
            }
        }
        assert_eq!(index as usize, n_anchors, "{variant:?}: all of them");
    }
}
