//! A frame in small steps: how many instructions the longest of them takes, which is how long a watchdog or a bus has to wait.
//!
//! Fails where a step takes more than [`MOST`], or where the steps take a hundredth more than a frame at once.
#![no_std]
#![no_main]

#[path = "../board/mod.rs"]
mod board;
#[path = "../stop.rs"]
mod stop;

use core::convert::Infallible;
use core::f32::consts::TAU;
use core::task::Poll;

#[cfg(target_arch = "arm")]
use cortex_m as _;
use defmt_semihosting as _;
use pocketsplat_core::{Budget, Bundle, DecodeError, Decoder, Overflow, Plan, Tile, TileSink};
#[cfg(target_arch = "riscv32")]
use riscv as _;
use static_cell::ConstStaticCell;

/// What build.rs writes; this program uses the sizes alone.
mod settings {
    #![expect(dead_code, reason = "the other program uses all")]
    use pocketsplat_core::{Budget, Camera, Quality};
    include!(concat!(env!("OUT_DIR"), "/settings.rs"));
}
use settings::{HEIGHT_PX, N_FRAMES, SCRATCH_LEN, WIDTH_PX};

/// Instructions that a step may take: of two cycles each, 5 ms at 150 MHz.
const MOST: u64 = 375_000;

static BUNDLE: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/bundle.psb"));
static SCRATCH: ConstStaticCell<[u8; SCRATCH_LEN]> = ConstStaticCell::new([0; SCRATCH_LEN]);

/// Takes tiles and keeps none.
struct Nowhere;

impl TileSink for Nowhere {
    type Error = Infallible;

    fn tile(&mut self, _: Tile<'_>) -> Result<(), Infallible> {
        Ok(())
    }
}

/// Draws, compares, and ends.
#[board::entry]
fn main() -> ! {
    board::start();
    match measure() {
        Ok(true) => stop::success(),
        Ok(false) => defmt::error!("a step takes more than {} instructions, or steps cost more than a hundredth", MOST),
        Err(error) => defmt::error!("{}", error),
    }
    stop::failure()
}

/// Whether all steps of all frames are short, and all together little more than a frame at once.
fn measure() -> Result<bool, DecodeError> {
    let bundle = Bundle::parse(BUNDLE)?;
    // The build script's sizes fit these types.
    let preview = bundle.header().preview.resized(WIDTH_PX as u16, HEIGHT_PX as u16);
    let scratch = SCRATCH.take();
    let budget = Budget::for_frame(preview.width_px, preview.height_px).in_bytes(scratch.len());
    let plan = Plan::new(&bundle, &budget).or_else(|_| Plan::new(&bundle, &budget.with_overflow(Overflow::Slabs)))?;
    let mut decoder = Decoder::bind(&bundle, plan, scratch)?;
    let mut is_short = true;
    for frame in 0..N_FRAMES {
        let camera = preview.orbited(TAU * f32::from(frame) / f32::from(N_FRAMES));
        let start = board::instructions();
        begin_stretch();
        let report = decoder.render(&camera, &mut Nowhere).map_err(DecodeError::from)?;
        end_stretch();
        let at_once = board::instructions() - start;

        let start = board::instructions();
        let mut drawing = decoder.begin(&camera)?;
        let (mut n_steps, mut most, mut last) = (0_u32, 0, board::instructions());
        let begin = last - start;
        while !matches!(drawing.advance()?, Poll::Ready(None)) {
            let now = board::instructions();
            (n_steps, most, last) = (n_steps + 1, most.max(now - last), now);
        }
        let in_steps = last - start;
        let model = report.instructions(bundle.model_cost());
        defmt::info!(
            "frame {}: {} instructions at once, {} in {} steps of at most {}, after {} for begin; {} in the model",
            frame,
            at_once,
            in_steps,
            n_steps,
            most,
            begin,
            model
        );
        is_short &= most <= MOST && in_steps <= at_once + at_once / 100;
    }
    Ok(is_short)
}

/// Tells the plugin in `../../cycles/` where a stretch of code begins; a processor does nothing.
#[inline(always)]
fn begin_stretch() {
    #[cfg(target_arch = "arm")]
    #[expect(unsafe_code, reason = "a hint")]
    // SAFETY: it changes nothing.
    unsafe {
        core::arch::asm!("dbg #1");
    }
}

/// Where it ends.
#[inline(always)]
fn end_stretch() {
    #[cfg(target_arch = "arm")]
    #[expect(unsafe_code, reason = "a hint")]
    // SAFETY: it changes nothing.
    unsafe {
        core::arch::asm!("dbg #2");
    }
}
