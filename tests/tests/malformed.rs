//! A damaged bundle fails with an error that names the place, or draws without the damaged chunk and says which: never
//! another picture in silence, never a panic.

use conformance::bundles::{ALL_CODERS, chunks_offset, tier_ends, tiered};
use conformance::frame::{Frame, budget_for, bundle_of, draw, to_core};
use conformance::scenes::{CASES, Case, TINY, TINY_DETAILED, cameras, random_scene};
use conformance::seal::reseal;
use pocketsplat_core::{
    Bundle, Camera, DecodeError, Decoder, ErrorClass, Field, FrameReport, PixelFormat, Plan, SectionKind, Strips,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Anchors of a chunk of the small bundles: two or three chunks a tier.
const SMALL_CHUNK: u16 = 2;

fn small_camera() -> Camera {
    to_core(&cameras()[0].1).resized(24, 18)
}

/// A bundle of few bytes with all features, one for each coder, and one with as few features as possible.
fn small_bundles() -> Vec<Vec<u8>> {
    let case = Case { n_anchors: 12, ..TINY_DETAILED };
    let plain = bundle_of(&random_scene(&Case { n_anchors: 12, ..TINY }), &cameras()[0].1);
    ALL_CODERS.map(|coder| tiered(&case, coder, SMALL_CHUNK)).into_iter().chain([plain]).collect()
}

fn picture(bytes: &[u8], camera: &Camera) -> Result<Frame, DecodeError> {
    draw(&Bundle::parse(bytes)?, camera).map(|(frame, _)| frame)
}

/// Draws with damaged chunks left out.
fn picture_skipping(bytes: &[u8], camera: &Camera) -> Result<(Frame, FrameReport), DecodeError> {
    let bundle = Bundle::parse(bytes)?;
    let plan = Plan::new(&bundle, &budget_for(camera).skipping_damage())?;
    let mut scratch = vec![0; plan.scratch_len()];
    let mut frame = Frame::new(camera.width_px, camera.height_px);
    let report = Decoder::bind(&bundle, plan, &mut scratch)?.render(camera, &mut frame)?;
    Ok((frame, report))
}

/// The parts of a bundle: where each begins and ends in the file.
struct Layout {
    header_end: usize,
    /// Those before the chunks.
    sections: Vec<(SectionKind, usize, usize)>,
    chunks: Vec<(u32, usize, usize)>,
    tier_ends: Vec<usize>,
}

impl Layout {
    fn of(bytes: &[u8]) -> Self {
        let bundle = Bundle::parse(bytes).expect("the writer's bundle is sound");
        let mut sections: Vec<_> = bundle
            .sections()
            .map(|section| (section.kind, section.offset as usize, (section.offset + section.len) as usize))
            .collect();
        sections.pop();
        let first = chunks_offset(&bundle);
        let chunk = |chunk: pocketsplat_format::bundle::Chunk<'_>| {
            let start = first + chunk.offset() as usize;
            (chunk.index(), start, start + chunk.n_bytes())
        };
        Self {
            header_end: bundle.header().header_len.into(),
            sections,
            chunks: bundle.chunks().map(chunk).collect(),
            tier_ends: tier_ends(&bundle),
        }
    }

    fn section_at(&self, byte: usize) -> Option<SectionKind> {
        self.sections.iter().find(|(_, start, end)| (*start..*end).contains(&byte)).map(|section| section.0)
    }

    /// Whether a byte lies between two sections or chunks.
    fn is_padding(&self, byte: usize) -> bool {
        byte >= self.header_end && self.section_at(byte).is_none() && self.chunk_at(byte).is_none()
    }

    fn chunk_at(&self, byte: usize) -> Option<u32> {
        self.chunks.iter().find(|(_, start, end)| (*start..*end).contains(&byte)).map(|chunk| chunk.0)
    }
}

/// Fails unless a file cut to `len` bytes is refused with the section in which it ends, or is a smaller scene.
#[track_caller]
fn check_truncation(bytes: &[u8], len: usize, layout: &Layout) {
    let what = format!("cut to {len} of {} bytes", bytes.len());
    match Bundle::parse(&bytes[..len]) {
        Ok(bundle) => {
            let tier = layout.tier_ends.iter().rposition(|&end| end == len);
            assert_eq!(Some(usize::from(bundle.n_tiers())), tier.map(|tier| tier + 1), "{what}: tiers");
        }
        Err(DecodeError::NotABundle) => assert!(len < 8, "{what}"),
        Err(DecodeError::Truncated { section, .. }) => {
            // Bytes between two sections belong to neither, and the next one is missing.
            let missing = (len..bytes.len()).find(|&byte| !layout.is_padding(byte));
            let expected = match missing.and_then(|missing| layout.section_at(missing)) {
                _ if len < layout.header_end => SectionKind::Header,
                Some(section) => section,
                None => SectionKind::Chunks,
            };
            assert_eq!(section, expected, "{what}");
        }
        Err(error) => panic!("{what}: {error}"),
    }
}

/// Fails unless the bit that is flipped in `bytes` is noticed, and its place named; tells the chunk that was left out.
#[track_caller]
fn check_flip(bytes: &[u8], byte: usize, layout: &Layout, camera: &Camera) -> Option<(Frame, FrameReport)> {
    let what = format!("a bit of byte {byte} flipped");
    let strict = picture(bytes, camera).err();
    let skipping = picture_skipping(bytes, camera);
    if let Some(index) = layout.chunk_at(byte) {
        let named = matches!(strict, Some(DecodeError::ChunkChecksum { chunk, .. }) if chunk == index);
        assert!(named, "{what} in chunk {index}: {strict:?}");
        let (frame, report) = skipping.unwrap_or_else(|error| panic!("{what} in chunk {index}: {error}"));
        assert_eq!((report.chunks_damaged, report.first_damaged), (1, Some(index)), "{what}");
        return Some((frame, report));
    }
    assert_eq!(skipping.err(), strict, "{what}: before the chunks nothing can be left out");
    let error = strict.unwrap_or_else(|| panic!("{what}: not noticed"));
    let named = match (layout.section_at(byte), error) {
        (Some(section), DecodeError::SectionChecksum { section: found, .. }) => found == section,
        (None, DecodeError::SectionChecksum { section, .. } | DecodeError::Truncated { section, .. }) => {
            section == SectionKind::Header
        }
        (None, DecodeError::OutOfRange { field, .. }) => {
            field == if layout.is_padding(byte) { Field::Padding } else { Field::HeaderLen }
        }
        (None, DecodeError::NotABundle | DecodeError::UnsupportedVersion { .. }) => true,
        _ => false,
    };
    assert!(named, "{what}: {error}, where it lies in {:?}", layout.section_at(byte));
    None
}

#[test]
fn every_truncation_names_the_section_or_is_a_smaller_scene() {
    for bytes in small_bundles() {
        let layout = Layout::of(&bytes);
        (0..=bytes.len()).for_each(|len| check_truncation(&bytes, len, &layout));
    }
}

#[test]
fn every_flipped_bit_names_the_section_or_the_chunk_that_is_left_out() {
    let camera = small_camera();
    for mut bytes in small_bundles() {
        let layout = Layout::of(&bytes);
        let (sound, sound_report) = picture_skipping(&bytes, &camera).expect("the writer's bundle is sound");
        assert_eq!(sound_report.chunks_decoded as usize, layout.chunks.len(), "the camera sees every chunk");
        let mut without: Vec<Option<(Frame, FrameReport)>> = vec![None; layout.chunks.len()];
        for byte in 0..bytes.len() {
            for bit in 0..8 {
                bytes[byte] ^= 1 << bit;
                if let Some(drawn) = check_flip(&bytes, byte, &layout, &camera) {
                    let index = drawn.1.first_damaged.expect("the chunk left out") as usize;
                    let first = without[index].get_or_insert_with(|| drawn.clone());
                    assert!(*first == drawn, "bit {bit} of byte {byte}: another picture without chunk {index}");
                }
                bytes[byte] ^= 1 << bit;
            }
        }
        // What is missing from the pictures is the chunks' own: together the whole scene.
        let missing = |count: fn(&FrameReport) -> u32| -> u32 {
            without.iter().flatten().map(|(_, report)| count(&sound_report) - count(report)).sum()
        };
        assert_eq!(missing(|report| report.anchors_decoded), sound_report.anchors_decoded, "anchors of all chunks");
        assert_eq!(missing(|report| report.splats), sound_report.splats, "splats of all chunks");
        assert!(without.iter().flatten().any(|(frame, _)| *frame != sound), "something is missing");
    }
}

#[test]
fn random_damage_of_a_large_bundle_names_the_place() {
    let camera = to_core(&cameras()[0].1).resized(40, 30);
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    for coder in ALL_CODERS {
        let mut bytes = tiered(&CASES[0], coder, 32);
        let layout = Layout::of(&bytes);
        for _ in 0..300 {
            check_truncation(&bytes, rng.random_range(0..bytes.len()), &layout);
            let (byte, bit) = (rng.random_range(0..bytes.len()), rng.random_range(0..8));
            bytes[byte] ^= 1 << bit;
            check_flip(&bytes, byte, &layout, &camera);
            bytes[byte] ^= 1 << bit;
        }
    }
}

#[test]
fn every_byte_set_to_a_border_value_is_noticed() {
    let camera = small_camera();
    for mut bytes in small_bundles() {
        for byte in 0..bytes.len() {
            let before = bytes[byte];
            for value in [0x00, 0x7f, 0x80, 0xff] {
                bytes[byte] = value;
                let noticed = picture(&bytes, &camera).is_err();
                assert_eq!(noticed, value != before, "byte {byte} set to {value:#04x}");
            }
            bytes[byte] = before;
        }
    }
}

#[test]
fn a_sound_bundle_stays_as_it_is_when_sealed_again() {
    for bytes in small_bundles() {
        let mut sealed = bytes.clone();
        reseal(&mut sealed);
        assert!(sealed == bytes, "the writer's checksums are the format's");
    }
}

/// With its checksums made right a damaged bundle may be another scene, but nothing worse: the tests are built with
/// overflow checks, and `Internal` is a mistake of the decoder.
#[test]
fn damage_behind_right_checksums_is_an_error_or_another_scene() {
    let camera = small_camera();
    for sound in small_bundles() {
        let mut n_refused = 0;
        for byte in 0..sound.len() {
            for damage in [1, 2, 4, 8, 16, 32, 64, 128, 0xff, sound[byte], !sound[byte], sound[byte] ^ 0x7f] {
                let mut bytes = sound.clone();
                bytes[byte] ^= damage;
                reseal(&mut bytes);
                if let Err(error) = picture(&bytes, &camera) {
                    n_refused += 1;
                    assert_ne!(error.class(), ErrorClass::Internal, "byte {byte} with {damage:#04x} flipped: {error}");
                }
            }
        }
        println!("{n_refused} of {} refused", 12 * sound.len());
        assert!(n_refused > sound.len(), "offsets, counts and limits are checked: {n_refused} refused");
    }
}

#[test]
fn optional_features_are_ignored_and_required_ones_are_refused_by_number() {
    let camera = small_camera();
    for sound in small_bundles() {
        let expected = picture(&sound, &camera).expect("the writer's bundle is sound");
        // Optional features, offset 20: bits without a meaning yet.
        let mut bytes = sound.clone();
        bytes[20..24].fill(0xFF);
        reseal(&mut bytes);
        assert_eq!(picture(&bytes, &camera).as_ref(), Ok(&expected), "optional features are ignored");
        // Required features, offset 16.
        let mut bytes = sound.clone();
        bytes[19] |= 0x40;
        reseal(&mut bytes);
        let error = DecodeError::UnsupportedFeatures { unknown_bits: 0x4000_0000 };
        assert_eq!(picture(&bytes, &camera), Err(error), "a required feature");
        assert_eq!(error.class(), ErrorClass::Unsupported);
    }
}

#[test]
fn what_follows_a_bundle_in_flash_is_ignored() {
    let camera = small_camera();
    for mut bytes in small_bundles() {
        let sound = picture(&bytes, &camera).expect("the writer's bundle is sound");
        bytes.extend([0xff; 100]);
        assert_eq!(picture(&bytes, &camera), Ok(sound), "erased flash after the bundle");
    }
}

#[test]
fn bytes_of_other_files_are_not_bundles() {
    for bytes in [&b""[..], b"PSB", b"\x89PNG\r\n\x1a\n with something after it", &[0; 4096], &[0xff; 4096]] {
        let error = Bundle::parse(bytes).err();
        assert_eq!(error.map(|e| e.class()), Some(ErrorClass::Malformed), "{} bytes", bytes.len());
    }
}

#[test]
fn no_tile_comes_after_a_chunk_that_no_writer_makes() {
    let mut n_refused = 0;
    for bytes in small_bundles() {
        let mut bytes = bytes;
        // The last byte of the last chunk.
        let &(_, _, end) = Layout::of(&bytes).chunks.last().expect("some");
        bytes[end - 1] ^= 0x10;
        reseal(&mut bytes);
        let bundle = Bundle::parse(&bytes).expect("its checksums are right");
        let camera = bundle.header().preview;
        let plan = Plan::new(&bundle, &budget_for(&camera).with_strips(Strips::Exactly(8))).expect("a plan");
        let mut scratch = vec![0; plan.scratch_len()];
        let mut decoder = Decoder::bind(&bundle, plan, &mut scratch).expect("its checksums are right");
        let mut drawing = decoder.begin(&camera).expect("a sound camera");
        loop {
            match drawing.next_tile() {
                Ok(Some(_)) => {}
                Ok(None) => break,
                Err(error) => {
                    assert!(matches!(error, DecodeError::ChunkStream { .. }), "{error}");
                    assert!(drawing.next_tile().is_ok_and(|tile| tile.is_none()), "a tile after the error");
                    let row = drawing.next_tile_row(PixelFormat::Rgb888, &mut []);
                    assert_eq!(row, Ok(None), "a row of tiles after the error");
                    n_refused += 1;
                    break;
                }
            }
        }
    }
    assert!(n_refused > 0, "some chunk's stream is damaged");
}
