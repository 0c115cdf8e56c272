use std::convert::Infallible;

use pocketsplat_core::{
    Budget, Bundle, DecodeError, Decoder, ErrorClass, Field, MaxSplats, Plan, Region, Tile, TileSink,
};

use super::{SMALL, TABLES, info, options, random_scene, write_random};
use crate::bundle::{ChannelCoding, WriteOptions, write};
use pocketsplat_kernels::scene::ModelShape;

/// The smallest model, so that every bit of its bundle can be tried.
const TINY: ModelShape = ModelShape { feature_dim: 1, n_offsets: 1, ..SMALL };

struct NoSink;

impl TileSink for NoSink {
    type Error = Infallible;

    fn tile(&mut self, _: Tile<'_>) -> Result<(), Infallible> {
        Ok(())
    }
}

/// Everything a device does with a bundle.
fn parse_and_draw(bytes: &[u8]) -> Result<(), DecodeError> {
    let bundle = Bundle::parse(bytes)?;
    let plan = Plan::new(&bundle, &Budget::for_frame(64, 48))?;
    let mut scratch = vec![0; plan.scratch_len()];
    let mut decoder = Decoder::bind(&bundle, plan, &mut scratch)?;
    decoder.render(&bundle.header().preview.resized(64, 48), &mut NoSink)?;
    Ok(())
}

/// A tiny bundle of two tiers.
fn tiny(coder: ChannelCoding) -> Vec<u8> {
    let scene = super::with_context(random_scene(TINY, 7, 21), 22);
    let importance = Some(vec![1.0, 7.0, 3.0, 2.0, 5.0, 6.0, 4.0]);
    let options = WriteOptions { importance, pruning_rates: vec![0.5, 0.0], ..options(coder, 3) };
    let mut scene = scene;
    scene.anchors.mask_logits.fill(1.0);
    write(&scene, &info(), &options).expect("a sound scene").bytes
}

#[test]
fn every_truncation_is_an_error_or_a_smaller_scene() {
    let bytes = tiny(TABLES);
    parse_and_draw(&bytes).expect("the whole bundle");
    let bundle = Bundle::parse(&bytes).expect("a sound bundle");
    let end = |tier: u8| bundle.tier(tier).expect("a tier").end as usize;
    let smaller = bytes.len() - end(1) + end(0);
    for len in 0..bytes.len() {
        match parse_and_draw(&bytes[..len]) {
            Ok(()) => assert_eq!(len, smaller, "cut at the end of a tier"),
            Err(error) => assert_eq!(error.class(), ErrorClass::Malformed, "{len} bytes: {error}"),
        }
    }
    assert_eq!(Bundle::parse(&bytes[..smaller]).map(|bundle| bundle.n_tiers()), Ok(1), "one tier of two");
}

#[test]
fn every_flipped_bit_is_an_error_and_damaged_chunks_are_named() {
    for coder in [TABLES, ChannelCoding::Context] {
        let mut bytes = tiny(coder);
        let bundle = Bundle::parse(&bytes).expect("a sound bundle");
        let lens: Vec<usize> = bundle.chunks().map(|chunk| chunk.n_bytes().next_multiple_of(4)).collect();
        let chunks_start = bytes.len() - lens.iter().sum::<usize>();
        for bit in 0..8 * bytes.len() {
            bytes[bit / 8] ^= 1 << (bit % 8);
            let error = parse_and_draw(&bytes).expect_err("a damaged bundle");
            if bit / 8 >= chunks_start {
                let mut end = chunks_start;
                let before = lens.iter().take_while(|&len| {
                    end += len;
                    end <= bit / 8
                });
                let damaged = before.count() as u32;
                // The bytes up to the next chunk have no checksum, they are 0.
                let named = match error {
                    DecodeError::ChunkChecksum { chunk, .. } => chunk == damaged,
                    DecodeError::OutOfRange { field, .. } => field == Field::Padding,
                    _ => false,
                };
                assert!(named, "{coder:?}: bit {bit} lies in chunk {damaged}: {error}");
            }
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
    }
}

#[test]
fn bytes_after_the_end_are_ignored() {
    let mut bytes = tiny(ChannelCoding::Context);
    bytes.extend([0xFF; 100]);
    parse_and_draw(&bytes).expect("a flash partition longer than its bundle");
}

#[test]
fn scratch_one_byte_short_names_the_need() {
    let (_, bytes) = write_random(TABLES, SMALL, 50, 22, 16);
    let bundle = Bundle::parse(&bytes).expect("a sound bundle");
    let plan = Plan::new(&bundle, &Budget::for_frame(64, 48)).expect("a plan");
    let mut scratch = vec![0; plan.scratch_len() - 1];
    let error = Decoder::bind(&bundle, plan, &mut scratch).expect_err("one byte short");
    let needed = plan.scratch_len() as u32;
    assert_eq!(error, DecodeError::ScratchTooSmall { region: Region::Fast, needed, available: needed - 1 }, "{error}");
}

#[test]
fn too_many_splats_are_counted_and_that_many_then_suffice() {
    let (_, bytes) = write_random(TABLES, SMALL, 50, 22, 16);
    let bundle = Bundle::parse(&bytes).expect("a sound bundle");
    let draw = |most| {
        let plan =
            Plan::new(&bundle, &Budget::for_frame(64, 48).with_max_splats(MaxSplats::AtMost(most))).expect("a plan");
        let mut scratch = vec![0xA5; plan.scratch_len()];
        let mut decoder = Decoder::bind(&bundle, plan, &mut scratch).expect("planned memory");
        let report = decoder.render(&bundle.header().preview, &mut NoSink).expect("drawn");
        (report.splats, report.splats_dropped, report.max_splats)
    };
    let (1, dropped, needed) = draw(1) else { panic!("one splat is drawn") };
    assert_eq!(draw(needed), (1 + dropped, 0, needed), "the number named");
    assert_eq!(draw(needed - 1), (dropped, 1, needed), "one fewer");
}
