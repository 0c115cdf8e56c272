#![doc = include_str!("../README.md")]
#![no_std]
#![no_main]

mod board;
mod instructions;
mod panel;
mod stack;
mod stop;

use core::f32::consts::TAU;

// For its critical section, which the logger takes.
#[cfg(target_arch = "arm")]
use cortex_m as _;
use defmt_semihosting as _;
use embedded_graphics::geometry::Point;
use instructions::{Instructions, Table};
use panel::{PANEL, Panel, write_ppm};
use pocketsplat_core::{Budget, Bundle, Camera, DecodeError, Decoder, Overflow, Quality, Stage, Stopwatch as _};
use pocketsplat_core::{DisplaySink, Plan};
#[cfg(target_arch = "riscv32")]
use riscv as _;
use semihosting::io;
use static_cell::ConstStaticCell;

// BOARD, RAM_KIB, STACK_LEN, SCRATCH_LEN, WIDTH_PX, HEIGHT_PX, N_FRAMES, VIEWS, asked, Chosen.
include!(concat!(env!("OUT_DIR"), "/settings.rs"));
static BUNDLE: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/bundle.psb"));

/// All RAM that stack and other statics leave.
static SCRATCH: ConstStaticCell<[u8; SCRATCH_LEN]> = ConstStaticCell::new([0; SCRATCH_LEN]);

/// Why there is no picture.
#[derive(defmt::Format)]
enum Failure {
    /// The bundle, or the memory for it.
    Decode(DecodeError),
    /// The host does not take a file.
    File,
    /// The stack came nearer to its end than it may, bytes.
    Stack { used: usize, most: usize },
}

impl From<DecodeError> for Failure {
    fn from(error: DecodeError) -> Self {
        Self::Decode(error)
    }
}

impl From<io::Error> for Failure {
    fn from(_: io::Error) -> Self {
        Self::File
    }
}

/// Draws, looks at the stack, and ends.
#[board::entry]
fn main() -> ! {
    let _ = stack::paint();
    board::start();
    let drawn = draw_orbit(PANEL.take(), SCRATCH.take()).and_then(|()| check_stack());
    match drawn {
        Ok(()) => stop::success(),
        Err(failure) => {
            defmt::error!("{}", failure);
            stop::failure()
        }
    }
}

/// Draws the frames of an orbit, or the views that were asked for, on the panel, and sends each and the instructions that it took to the host.
fn draw_orbit(panel: &mut Panel, scratch: &mut [u8]) -> Result<(), Failure> {
    let bundle = Bundle::parse(BUNDLE)?;
    let header = bundle.header();
    defmt::info!("{=str}: {=usize} KiB of RAM in all, {=usize} bytes of stack", BOARD, RAM_KIB, stack::len());
    defmt::info!("bundle: {} bytes, {} anchors of {} splats", BUNDLE.len(), header.n_anchors, header.n_offsets);

    // The build script's sizes fit these types, or the panel would not exist.
    let preview = header.preview.resized(WIDTH_PX as u16, HEIGHT_PX as u16);
    let budget = asked(Budget::for_frame(preview.width_px, preview.height_px).in_bytes(scratch.len()));
    // A scene that no pruning rate makes small enough still fits in slabs of depth, which take longer.
    let plan = Plan::new(&bundle, &budget).or_else(|_| Plan::new(&bundle, &budget.with_overflow(Overflow::Slabs)))?;
    defmt::info!("scratch: {} bytes, of which the plan takes {}", scratch.len(), plan.scratch_len());
    defmt::info!(
        "plan: {} of {} tiers, pruning rate {}, resident {}, {} strips of at most {} slabs of at most {} splats, {}",
        plan.n_tiers(),
        bundle.n_tiers(),
        plan.pruning_rate(),
        plan.is_resident(),
        plan.n_strips(),
        plan.n_slabs(),
        plan.max_splats(),
        plan.work()
    );
    let before = board::instructions();
    let mut decoder = Decoder::bind_in::<Chosen>(&bundle, plan, scratch)?;
    let mut table = Table::create(board::instructions() - before)?;
    for frame in 0..N_FRAMES {
        let orbited = || preview.orbited(TAU * f32::from(frame) / f32::from(N_FRAMES));
        let camera = VIEWS.get(usize::from(frame)).copied().unwrap_or_else(orbited);
        let mut display = DisplaySink::new(panel, Point::zero());
        let mut instructions = Instructions::start();
        // The panel has no errors; those of a display would come back from here.
        let report = decoder.render_watched(&camera, &mut display, &mut instructions).map_err(DecodeError::from)?;
        instructions.enter(Stage::Output);
        defmt::info!("frame {}: {}", frame, report);
        defmt::info!("instructions: {}", instructions.spent);
        table.add(frame, &instructions)?;
        write_ppm(panel, frame)?;
    }
    Ok(())
}

/// A tenth of the stack is to stay untouched.
fn check_stack() -> Result<(), Failure> {
    let (used, most) = (stack::most_used(), STACK_LEN * 9 / 10);
    defmt::info!("stack: {} bytes used, {} may be", used, most);
    if used > most { Err(Failure::Stack { used, most }) } else { Ok(()) }
}
