//! How much stack each call of the decoder takes: before each, what is free is painted; how deep the call went shows in the paint.
//!
//! Anchors are resident, with or without sums, streamed, or in a scene that is the same from everywhere evaluated once; of those that the
//! bundle allows, the most counts. `../../stack.sh` prints it for several ways to build.
#![no_std]
#![no_main]

#[path = "../board/mod.rs"]
#[allow(dead_code, unused_imports, reason = "the other program counts instructions")]
mod board;
#[path = "../stack.rs"]
mod stack;
#[path = "../stop.rs"]
mod stop;

use core::convert::Infallible;
use core::hint::black_box;

#[cfg(target_arch = "arm")]
use cortex_m as _;
use defmt_semihosting as _;
use pocketsplat_core::{Budget, Bundle, DecodeError, Decoder, Plan, Residency, Tile, TileSink};
#[cfg(target_arch = "riscv32")]
use riscv as _;
use static_cell::ConstStaticCell;

/// What build.rs writes; this program uses the sizes alone.
mod settings {
    #![expect(dead_code, reason = "the other program uses all")]
    use pocketsplat_core::{Budget, Camera, Quality};
    include!(concat!(env!("OUT_DIR"), "/settings.rs"));
}

static BUNDLE: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/bundle.psb"));
static SCRATCH: ConstStaticCell<[u8; settings::SCRATCH_LEN]> = ConstStaticCell::new([0; settings::SCRATCH_LEN]);

/// The calls, in their order.
const CALLS: [&str; 6] = ["parse", "plan", "bind", "render", "begin", "next_tile"];

/// Measures, and ends.
#[board::entry]
fn main() -> ! {
    match measure() {
        Ok(most) => {
            for (call, bytes) in CALLS.into_iter().zip(most) {
                defmt::info!("stack of {=str}: {=usize}", call, bytes);
            }
            stop::success()
        }
        Err(error) => {
            defmt::error!("{}", error);
            stop::failure()
        }
    }
}

/// Bytes of each of [`CALLS`].
fn measure() -> Result<[usize; CALLS.len()], DecodeError> {
    let scratch = SCRATCH.take();
    let mut most = [0; CALLS.len()];
    let [parse, plan, bind, render, begin, next_tile] = &mut most;
    let bundle = of(parse, || Bundle::parse(BUNDLE))?;
    let camera = bundle.header().preview;
    for residency in [Residency::AutoWithSums, Residency::Resident, Residency::Streamed, Residency::Baked] {
        let budget = Budget::for_frame(camera.width_px, camera.height_px).with_residency(residency);
        let Ok(planned) = of(plan, || Plan::new(&bundle, &budget.in_bytes(scratch.len()))) else { continue };
        let mut decoder = of(bind, || Decoder::bind(&bundle, planned, &mut *scratch))?;
        of(render, || decoder.render(&camera, &mut Display))?;
        let mut drawing = of(begin, || decoder.begin(&camera))?;
        while of(next_tile, || drawing.next_tile().map(|tile| black_box(tile).is_some()))? {}
    }
    Ok(most)
}

/// What `call` returns; `most` becomes the bytes of stack that it took, if they are more.
#[inline(never)]
fn of<T>(most: &mut usize, call: impl FnOnce() -> T) -> T {
    let before = stack::paint();
    let returned = apart(call);
    *most = (*most).max(stack::most_used().saturating_sub(before));
    returned
}

/// A stack frame for what is inlined of `call`.
#[inline(never)]
fn apart<T>(call: impl FnOnce() -> T) -> T {
    call()
}

/// A display that keeps nothing.
struct Display;

impl TileSink for Display {
    type Error = Infallible;

    fn tile(&mut self, Tile { x_px, y_px, width, height, rgb, .. }: Tile<'_>) -> Result<(), Infallible> {
        black_box((x_px, y_px, width, height, rgb));
        Ok(())
    }
}
