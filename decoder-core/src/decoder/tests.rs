//! Frames of all sizes, and sinks that fail.

use core::convert::Infallible;
use core::task::Poll;
use std::vec;
use std::vec::Vec;

use pocketsplat_format::{Bundle, Camera, DecodeError, ErrorClass, Field, Rotation};

use super::render_error::RenderError;
use super::{ByteOrder, Decoder, PixelFormat, Rounding, Tile, TileRow, TileSink};
use crate::budget::{Budget, MaxSplats, Overflow, Plan, Residency, Strips};

const EXAMPLE: &[u8] = include_bytes!("../../examples/example.psb");

/// Counts pixels, keeps where each tile begins, and refuses one tile.
#[derive(Default)]
struct Tally {
    n_pixels: usize,
    corners: Vec<[u16; 2]>,
    /// Which tile is refused, from 0.
    refused: Option<usize>,
}

impl TileSink for Tally {
    type Error = &'static str;

    fn tile(&mut self, tile: Tile<'_>) -> Result<(), &'static str> {
        let Tile { x_px, y_px, width, height, rgb } = tile;
        assert_eq!(rgb.len(), usize::from(width) * usize::from(height), "the tile at ({x_px}, {y_px})");
        let refused = self.refused == Some(self.corners.len());
        self.corners.push([x_px, y_px]);
        self.n_pixels += rgb.len();
        if refused { Err("the bus hung") } else { Ok(()) }
    }
}

fn example() -> Bundle<'static> {
    Bundle::parse(EXAMPLE).expect("the example is sound")
}

fn draw(budget: &Budget, camera: &Camera, refused: Option<usize>) -> (Tally, Result<u32, RenderError<&'static str>>) {
    let bundle = example();
    let plan = Plan::new(&bundle, budget).expect("a plan");
    let mut scratch = vec![0; plan.scratch_len()];
    let mut tally = Tally { refused, ..Tally::default() };
    let mut decoder = Decoder::bind(&bundle, plan, &mut scratch).expect("planned memory");
    let drawn = decoder.render(camera, &mut tally).map(|report| report.splats);
    if drawn.is_err() {
        let mut again = Tally::default();
        decoder.render(&example().header().preview, &mut again).expect("the next frame is drawn");
        assert_eq!(again.n_pixels, 32 * 24, "the next frame is whole");
    }
    (tally, drawn)
}

/// Where overflow is checked, the number of a column beyond the last would panic.
#[test]
fn frames_of_the_largest_size_are_drawn_and_larger_ones_refused() {
    let preview = example().header().preview;
    let largest = Budget::MAX_FRAME_PX;
    for [width_px, height_px] in
        [[largest, 1], [largest - 15, 17], [largest - 16, 16], [1, largest], [largest, largest]]
    {
        for n_strips in [1, 8] {
            for overflow in [Overflow::LeaveOut, Overflow::Slabs] {
                // A canvas of 266 MB, which is the same in parts.
                if overflow == Overflow::Slabs && width_px == height_px {
                    continue;
                }
                let budget = Budget::for_frame(width_px, height_px)
                    .with_strips(Strips::Exactly(n_strips))
                    .with_overflow(overflow);
                let (tally, drawn) = draw(&budget, &preview.resized(width_px, height_px), None);
                assert!(drawn.is_ok_and(|n_splats| n_splats > 0), "{width_px}×{height_px}: {drawn:?}");
                assert_eq!(tally.n_pixels, usize::from(width_px) * usize::from(height_px), "{budget:?}");
                let last = [width_px, height_px].map(|size_px| (size_px - 1) / 16 * 16);
                assert_eq!(tally.corners.last(), Some(&last), "{budget:?}");
            }
        }
    }
    for (field, budget) in [
        (Field::FrameWidth, Budget::for_frame(largest + 1, 1)),
        (Field::FrameHeight, Budget::for_frame(1, largest + 1)),
    ] {
        let expected = DecodeError::OutOfRange { field, found: 4081, limit: 4080 };
        assert_eq!(Plan::new(&example(), &budget), Err(expected));
    }
}

/// Keeps tiles.
#[derive(Default)]
struct Tiles(Vec<([u16; 4], Vec<[u8; 3]>)>);

impl TileSink for Tiles {
    type Error = Infallible;

    fn tile(&mut self, tile: Tile<'_>) -> Result<(), Infallible> {
        self.0.push(([tile.x_px, tile.y_px, tile.width, tile.height], tile.rgb.to_vec()));
        Ok(())
    }
}

#[test]
fn tiles_that_are_asked_for_are_those_that_a_sink_gets() {
    let bundle = example();
    let camera = bundle.header().preview.resized(100, 75);
    let frame = Budget::for_frame(100, 75);
    let few = frame.with_max_splats(MaxSplats::AtMost(3));
    for n_strips in [1, 2, 8] {
        for budget in [frame, few, few.with_overflow(Overflow::Slabs)] {
            let plan = Plan::new(&bundle, &budget.with_strips(Strips::Exactly(n_strips))).expect("a plan");
            let mut scratch = vec![0; plan.scratch_len()];
            let mut decoder = Decoder::bind(&bundle, plan, &mut scratch).expect("planned memory");
            let mut expected = Tiles::default();
            let report = decoder.render(&camera, &mut expected).expect("drawn");
            // Dropped after so many tiles, and the last time not at all.
            for n_tiles in [0, 1, 9, 35] {
                let mut drawing = decoder.begin(&camera).expect("a sound camera");
                let mut found = Tiles::default();
                while found.0.len() < n_tiles
                    && let Some(tile) = drawing.next_tile().expect("drawn")
                {
                    found.tile(tile).expect("kept");
                }
                assert!(found.0 == expected.0[..n_tiles], "{n_strips} strips, {budget:?}: the first {n_tiles} tiles");
                if n_tiles == 35 {
                    for _ in 0..2 {
                        assert!(drawing.next_tile().expect("drawn").is_none(), "35 tiles are the frame");
                    }
                    assert_eq!(drawing.report(), report, "{n_strips} strips, {budget:?}");
                }
            }
        }
    }
}

/// The lines of `[height, width, bytes]` from row `y_px` on, each from column `x_px` on.
fn lines_of(frame: &[u8], width: usize, row: &TileRow<'_>) -> Vec<u8> {
    let bytes = row.bytes.len() / (usize::from(row.width) * usize::from(row.height));
    let [x, y] = [row.x_px, row.y_px].map(usize::from);
    let lines = frame.chunks_exact(width * bytes).skip(y).take(row.height.into());
    lines.flat_map(|line| line[x * bytes..].to_vec()).collect()
}

#[test]
fn rows_of_tiles_are_the_lines_of_the_frame() {
    let bundle = example();
    let (width, height) = (100, 75);
    let camera = bundle.header().preview.resized(width, height);
    let frame = Budget::for_frame(width, height);
    let in_slabs = frame.with_max_splats(MaxSplats::AtMost(3)).with_overflow(Overflow::Slabs);
    for budget in [frame, frame.with_strips(Strips::Exactly(8)), in_slabs, in_slabs.with_strips(Strips::Exactly(2))] {
        let plan = Plan::new(&bundle, &budget).expect("a plan");
        let mut scratch = vec![0; plan.scratch_len()];
        let mut decoder = Decoder::bind(&bundle, plan, &mut scratch).expect("planned memory");
        let mut tiles = Tiles::default();
        let report = decoder.render(&camera, &mut tiles).expect("drawn");
        let mut rgb = vec![[0; 3]; usize::from(width) * usize::from(height)];
        for ([x_px, y_px, tile_width, _], pixels) in &tiles.0 {
            let lines = rgb.chunks_exact_mut(width.into()).skip((*y_px).into());
            for (line, from) in lines.zip(pixels.chunks_exact((*tile_width).into())) {
                line[usize::from(*x_px)..][..from.len()].copy_from_slice(from);
            }
        }
        for format in FORMATS {
            // The pattern of one large tile is that of all small ones.
            let mut expected = rgb.clone();
            let expected = Tile { x_px: 0, y_px: 0, width, height, rgb: &mut expected }.into_bytes(format);
            // So many single tiles before each row.
            for n_single in [0, 1, 6, 8] {
                let mut drawing = decoder.begin(&camera).expect("a sound camera");
                let mut buffer = vec![0; 16 * usize::from(width) * format.bytes_per_pixel()];
                let mut places = Vec::new();
                loop {
                    for _ in 0..n_single {
                        drawing.next_tile().expect("drawn");
                    }
                    let Some(row) = drawing.next_tile_row(format, &mut buffer).expect("drawn") else { break };
                    assert!(*row.bytes == lines_of(expected, width.into(), &row), "{budget:?}, {format:?}: {row:?}");
                    places.push([row.x_px, row.y_px, row.width, row.height]);
                }
                let row = |x_px, y_px| [x_px, y_px, width - x_px, 16.min(height - y_px)];
                let few = match n_single {
                    0 => [0, 16, 32, 48, 64].map(|y_px| row(0, y_px)).to_vec(),
                    1 => [0, 16, 32, 48, 64].map(|y_px| row(16, y_px)).to_vec(),
                    6 => [0, 16, 32, 48, 64].map(|y_px| row(96, y_px)).to_vec(),
                    _ => vec![row(16, 16), row(16, 48)],
                };
                assert_eq!(places, few, "{budget:?}, {format:?}, {n_single} single tiles before each row");
                assert!(drawing.next_tile().expect("drawn").is_none(), "the rows are the frame");
                assert_eq!(drawing.report(), report, "{budget:?}, {format:?}");
            }
        }
    }
}

const FORMATS: [PixelFormat; 5] = [
    PixelFormat::Rgb888,
    PixelFormat::Rgb565(ByteOrder::BigEndian, Rounding::Nearest),
    PixelFormat::Rgb565(ByteOrder::BigEndian, Rounding::Dithered),
    PixelFormat::Rgb565(ByteOrder::LittleEndian, Rounding::Nearest),
    PixelFormat::Rgb565(ByteOrder::LittleEndian, Rounding::Dithered),
];

#[test]
fn a_buffer_too_short_for_a_row_of_tiles_is_refused_and_the_row_comes_later() {
    let bundle = example();
    let plan = Plan::new(&bundle, &Budget::for_frame(32, 24)).expect("a plan");
    let mut scratch = vec![0; plan.scratch_len()];
    let mut decoder = Decoder::bind(&bundle, plan, &mut scratch).expect("planned memory");
    for format in FORMATS {
        let mut drawing = decoder.begin(&bundle.header().preview).expect("a sound camera");
        for height in [16, 8] {
            let needed = 32 * height * format.bytes_per_pixel();
            let mut buffer = vec![0; needed];
            for available in [0, 1, needed - 1] {
                let error = drawing.next_tile_row(format, &mut buffer[..available]).expect_err("too short");
                let [needed, available] = [needed, available].map(|len| u32::try_from(len).expect("small"));
                assert_eq!(error, DecodeError::BufferTooShort { field: Field::RowBuffer, needed, available });
                assert_eq!(error.class(), ErrorClass::Misuse);
            }
            let row = drawing.next_tile_row(format, &mut buffer).expect("long enough").expect("a row");
            assert_eq!((usize::from(row.height), row.bytes.len()), (height, needed), "{format:?}");
        }
        assert_eq!(drawing.next_tile_row(format, &mut []), Ok(None), "after the last row no buffer is needed");
    }
}

/// At each of its calls a frame that advances may be asked for whole rows instead, and nothing is handed out twice or left out.
#[test]
fn rows_go_on_where_small_steps_came_to() {
    let bundle = example();
    let (width, height) = (100_u16, 75_u16);
    let camera = bundle.header().preview.resized(width, height);
    let frame = Budget::for_frame(width, height);
    let in_slabs = frame.with_max_splats(MaxSplats::AtMost(3)).with_overflow(Overflow::Slabs);
    for budget in [frame, frame.with_strips(Strips::Exactly(8)), in_slabs, in_slabs.with_strips(Strips::Exactly(2))] {
        let plan = Plan::new(&bundle, &budget).expect("a plan");
        let mut scratch = vec![0; plan.scratch_len()];
        let mut decoder = Decoder::bind(&bundle, plan, &mut scratch).expect("planned memory");
        let mut expected = Tiles::default();
        let report = decoder.render(&camera, &mut expected).expect("drawn");
        let mut n_steps = 0;
        loop {
            let mut drawing = decoder.begin(&camera).expect("a sound camera");
            let mut found = Tiles::default();
            let mut is_complete = false;
            for _ in 0..n_steps {
                match drawing.advance().expect("drawn") {
                    Poll::Pending => {}
                    Poll::Ready(Some(tile)) => found.tile(tile).expect("infallible"),
                    Poll::Ready(None) => is_complete = true,
                }
            }
            let n_tiles = found.0.len();
            assert_eq!(found.0, expected.0[..n_tiles], "{budget:?}: {n_steps} steps");
            let mut next = n_tiles;
            let mut buffer = vec![0; 16 * usize::from(width) * 3];
            while let Some(row) = drawing.next_tile_row(PixelFormat::Rgb888, &mut buffer).expect("drawn") {
                let ([x_px, y_px, ..], _) = expected.0[next];
                assert_eq!([row.x_px, row.y_px], [x_px, y_px], "{budget:?}: {n_steps} steps");
                next += usize::from(row.width.div_ceil(16));
            }
            assert!(drawing.next_tile().expect("drawn").is_none(), "the rows are the frame");
            assert_eq!((next, drawing.report()), (expected.0.len(), report), "{budget:?}: {n_steps} steps");
            if is_complete {
                break;
            }
            n_steps += 1;
        }
        // Its tiles, and at least once the beginning, the anchors and four digits of a sort.
        assert!(n_steps >= expected.0.len() + 6, "{budget:?}: {n_steps} steps are small ones");
    }
}

#[test]
fn a_frame_that_takes_more_than_its_work_ends_and_the_next_does_not_mind() {
    let bundle = example();
    let preview = bundle.header().preview;
    let needed = {
        let plan = Plan::new(&bundle, &Budget::for_frame(32, 24)).expect("a plan");
        let mut scratch = vec![0; plan.scratch_len()];
        let report = Decoder::bind(&bundle, plan, &mut scratch).expect("bound").render(&preview, &mut Tally::default());
        report.expect("drawn").instructions(bundle.model_cost())
    };
    let drawn = |most_work| draw_all(&Budget::for_frame(32, 24).with_most_work(most_work));
    assert_eq!(drawn(needed), Ok(32 * 24), "exactly so much");
    for most_work in [0, 1, needed / 2, needed - 1] {
        let error = drawn(most_work).expect_err("too little");
        let limit = (most_work >> 10) as u32;
        assert!(matches!(error, DecodeError::TooMuchWork { limit: found, .. } if found == limit), "{error}");
        assert_eq!(error.class(), ErrorClass::OverBudget);
    }
}

/// Pixels of a frame of the example, twice where it fails.
fn draw_all(budget: &Budget) -> Result<usize, DecodeError> {
    let bundle = example();
    let plan = Plan::new(&bundle, budget).expect("a plan");
    let mut scratch = vec![0; plan.scratch_len()];
    let mut decoder = Decoder::bind(&bundle, plan, &mut scratch).expect("planned memory");
    let mut frame = || {
        let mut drawing = decoder.begin(&bundle.header().preview).expect("a sound camera");
        let mut n_pixels = 0;
        let end = loop {
            match drawing.next_tile() {
                Ok(Some(tile)) => n_pixels += tile.rgb.len(),
                Ok(None) => break Ok(n_pixels),
                Err(error) => break Err(error),
            }
        };
        assert!(drawing.next_tile().is_ok_and(|tile| tile.is_none()), "nothing comes after the end");
        end
    };
    let first = frame();
    assert_eq!(frame(), first, "frames do not depend on those before");
    first
}

#[test]
fn the_first_error_of_a_sink_ends_the_frame_and_is_returned() {
    let preview = example().header().preview;
    let in_slabs = Budget::for_frame(32, 24).with_overflow(Overflow::Slabs).with_max_splats(MaxSplats::AtMost(2));
    for budget in [Budget::for_frame(32, 24), Budget::for_frame(32, 24).with_strips(Strips::Exactly(2)), in_slabs] {
        for refused in 0..4 {
            let (tally, drawn) = draw(&budget, &preview, Some(refused));
            assert_eq!(drawn, Err(RenderError::Sink("the bus hung")), "tile {refused}");
            assert_eq!(tally.corners.len(), refused + 1, "no tile comes after the one refused");
        }
        assert!(draw(&budget, &preview, Some(4)).1.is_ok(), "there are four tiles");
    }
}

#[test]
fn an_unusable_camera_is_another_error_than_a_sinks() {
    let preview = example().header().preview;
    let wide = Camera { width_px: 33, ..preview };
    let (tally, drawn) = draw(&Budget::for_frame(32, 24), &wide, Some(0));
    let error = DecodeError::OutOfRange { field: Field::FrameWidth, found: 33, limit: 32 };
    assert_eq!((drawn, tally.n_pixels), (Err(RenderError::Decode(error)), 0));
    let nowhere = Camera { rotation: Rotation::new_unchecked([f32::NAN; 9]), ..preview };
    let (_, drawn) = draw(&Budget::for_frame(32, 24), &nowhere, None);
    assert_eq!(drawn, Err(RenderError::Decode(DecodeError::BadFloat { field: Field::CameraPose, index: 0 })));
    let mirrored = Rotation::new_unchecked([-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    let (_, drawn) = draw(&Budget::for_frame(32, 24), &Camera { rotation: mirrored, ..preview }, None);
    assert!(drawn.is_ok_and(|n_splats| n_splats > 0), "drawn unchecked: {drawn:?}");
}

#[test]
fn slabs_of_fewer_than_two_splats_are_refused() {
    let budget = Budget::for_frame(32, 24).with_residency(Residency::Streamed).with_overflow(Overflow::Slabs);
    for found in [0, 1] {
        let error = Plan::new(&example(), &budget.with_max_splats(MaxSplats::AtMost(found))).expect_err("too few");
        assert_eq!(error, DecodeError::OutOfRange { field: Field::SlabSplats, found, limit: 2 });
        assert_eq!(error.class(), ErrorClass::Misuse);
        let left_out = budget.with_overflow(Overflow::LeaveOut).with_max_splats(MaxSplats::AtMost(found));
        assert!(Plan::new(&example(), &left_out).is_ok(), "{found} places are fine where splats are left out");
    }
    let preview = example().header().preview;
    let (_, all) = draw(&budget, &preview, None);
    let within = |places| draw(&budget.with_max_splats(MaxSplats::AtMost(places)), &preview, None).1;
    assert_eq!((within(3), within(2)), (all, all.map(|n_splats| n_splats - 1)), "three of the five lie at one depth");
}
