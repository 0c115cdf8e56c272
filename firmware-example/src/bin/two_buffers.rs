//! Drawing and sending at the same time: while an interrupt sends a tile from one buffer, the next tile is drawn into the other.
//!
//! Two queues carry the buffers to the bus and back: each buffer has one owner at a time, and drawing never waits on a lock. SysTick
//! stands for the interrupt of a DMA channel and takes a row of a tile each time. At the end every pixel is compared with what `render`
//! draws.
#![no_std]
#![no_main]

#[path = "../stop.rs"]
mod stop;

use core::cell::RefCell;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::Peripherals;
use cortex_m::asm::wfi;
use cortex_m::interrupt::{self, Mutex};
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::{entry, exception};
use defmt_semihosting as _;
use heapless::spsc::{Consumer, Producer, Queue};
use pocketsplat_core::{Budget, Bundle, ByteOrder, DecodeError, Decoder, Overflow, Plan, Rounding, Tile, TileSink};
use static_cell::ConstStaticCell;

/// What build.rs writes; this program uses the sizes alone.
mod settings {
    #![expect(dead_code, reason = "the other program uses all")]
    use pocketsplat_core::{Budget, Camera, Quality};
    include!(concat!(env!("OUT_DIR"), "/settings.rs"));
}
use settings::{HEIGHT_PX, SCRATCH_LEN, WIDTH_PX};

/// Ticks of the 25 MHz clock between two interrupts: 16 pixels of 16 bits at about 50 Mbit/s.
const TICKS_PER_ROW: u32 = 128;
/// Bytes of a tile's pixels.
const TILE_LEN: usize = 2 * 16 * 16;
/// A queue of heapless keeps one place free.
const N_PLACES: usize = 3;

type Buffer = &'static mut [u8; TILE_LEN];
/// Two bytes a pixel, `[height, width]`.
type Panel = [[[u8; 2]; WIDTH_PX]; HEIGHT_PX];

/// A tile on its way to the display.
struct Parcel {
    corner_px: [u16; 2],
    size_px: [u16; 2],
    buffer: Buffer,
}

/// The sending end, which the interrupt has.
struct Bus {
    full: Consumer<'static, Parcel>,
    empty: Producer<'static, Buffer>,
    /// What is being sent, and how many of its rows are.
    current: Option<(Parcel, u16)>,
    panel: &'static mut Panel,
}

impl Bus {
    /// Sends the next row of a tile, and gives its buffer back after the last.
    fn send_row(&mut self) {
        let Some((parcel, row)) = self.current.take().or_else(|| Some((self.full.dequeue()?, 0))) else { return };
        let ([x, y], [width, height]) = (parcel.corner_px.map(usize::from), parcel.size_px);
        let width = usize::from(width);
        let pixels = parcel.buffer.as_chunks().0.chunks(width).nth(usize::from(row));
        let shown = self.panel.get_mut(y + usize::from(row)).and_then(|line| line.get_mut(x..x + width));
        if let (Some(pixels), Some(shown)) = (pixels, shown) {
            shown.copy_from_slice(pixels);
        }
        N_ROWS.fetch_add(1, Ordering::Relaxed);
        if row + 1 < height {
            self.current = Some((parcel, row + 1));
        } else {
            // It has places for all buffers.
            let _ = self.empty.enqueue(parcel.buffer);
        }
    }
}

static BUNDLE: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/bundle.psb"));
/// The statics of this program are 1.5 KiB more than the other's.
static SCRATCH: ConstStaticCell<[u8; SCRATCH_LEN - 1536]> = ConstStaticCell::new([0; SCRATCH_LEN - 1536]);
static BUFFERS: ConstStaticCell<[[u8; TILE_LEN]; 2]> = ConstStaticCell::new([[0; TILE_LEN]; 2]);
static FULL: ConstStaticCell<Queue<Parcel, N_PLACES>> = ConstStaticCell::new(Queue::new());
static EMPTY: ConstStaticCell<Queue<Buffer, N_PLACES>> = ConstStaticCell::new(Queue::new());
static BUS: Mutex<RefCell<Option<Bus>>> = Mutex::new(RefCell::new(None));
/// Rows sent since the start.
static N_ROWS: AtomicU32 = AtomicU32::new(0);

/// Not RAM of the device: memory that on a board is beyond the display's bus.
#[expect(unsafe_code, reason = "the linker puts the display's memory outside the device's RAM")]
#[unsafe(link_section = ".panel")]
static PANEL: ConstStaticCell<Panel> = ConstStaticCell::new([[[0; 2]; WIDTH_PX]; HEIGHT_PX]);

#[exception]
fn SysTick() {
    interrupt::free(|section| {
        if let Some(bus) = BUS.borrow(section).borrow_mut().as_mut() {
            bus.send_row();
        }
    });
}

/// Draws, compares, and ends.
#[entry]
fn main() -> ! {
    match compare() {
        Ok([0, n_rows]) if n_rows > 0 => stop::success(),
        Ok([0, _]) => defmt::error!("no row was sent while a tile was drawn"),
        Ok([n_other, _]) => defmt::error!("{} pixels are not those of render", n_other),
        Err(error) => defmt::error!("{}", error),
    }
    stop::failure()
}

/// Draws a frame with two buffers; how many of its pixels are not those of `render`, and how many rows were sent while a tile was drawn.
fn compare() -> Result<[u32; 2], DecodeError> {
    let bundle = Bundle::parse(BUNDLE)?;
    // The build script's sizes fit these types.
    let camera = bundle.header().preview.resized(WIDTH_PX as u16, HEIGHT_PX as u16);
    let scratch = SCRATCH.take();
    let budget = Budget::for_frame(camera.width_px, camera.height_px).in_bytes(scratch.len());
    let plan = Plan::new(&bundle, &budget).or_else(|_| Plan::new(&bundle, &budget.with_overflow(Overflow::Slabs)))?;
    let mut decoder = Decoder::bind(&bundle, plan, scratch)?;

    let ((mut full, to_bus), (mut from_bus, mut empty)) = (FULL.take().split(), EMPTY.take().split());
    for buffer in BUFFERS.take() {
        let _ = from_bus.enqueue(buffer);
    }
    let bus = Bus { full: to_bus, empty: from_bus, current: None, panel: PANEL.take() };
    interrupt::free(|section| BUS.borrow(section).replace(Some(bus)));
    start_bus();

    let (mut n_tiles, mut n_while_drawing) = (0, 0);
    let mut drawing = decoder.begin(&camera)?;
    loop {
        let before = N_ROWS.load(Ordering::Relaxed);
        let Some(tile) = drawing.next_tile()? else { break };
        n_while_drawing += N_ROWS.load(Ordering::Relaxed) - before;
        let (corner_px, size_px) = ([tile.x_px, tile.y_px], [tile.width, tile.height]);
        let bytes = tile.into_rgb565(ByteOrder::BigEndian, Rounding::Dithered);
        let buffer = wait_for(&mut empty);
        buffer.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        // There are two buffers and two places.
        let _ = full.enqueue(Parcel { corner_px, size_px, buffer });
        n_tiles += 1;
    }
    // Both come back once all is sent.
    let _ = (wait_for(&mut empty), wait_for(&mut empty));
    defmt::info!(
        "{} tiles; {} of {} rows were sent while a tile was drawn",
        n_tiles,
        n_while_drawing,
        N_ROWS.load(Ordering::Relaxed)
    );

    let bus = interrupt::free(|section| BUS.borrow(section).take());
    let Some(Bus { panel, .. }) = bus else { return Err(DecodeError::Internal) };
    let mut comparison = Comparison { panel, n_other: 0 };
    decoder.render(&camera, &mut comparison)?;
    Ok([comparison.n_other, n_while_drawing])
}

/// The next empty buffer.
///
/// An interrupt may come between the look into the queue and `wfi`. SysTick comes again; where only the end of a transfer interrupts, look
/// and wait with interrupts masked, which `wfi` wakes from all the same.
fn wait_for(empty: &mut Consumer<'static, Buffer>) -> Buffer {
    loop {
        match empty.dequeue() {
            Some(buffer) => break buffer,
            None => wfi(),
        }
    }
}

/// From now on a row is sent at each interrupt.
fn start_bus() {
    let Some(mut peripherals) = Peripherals::take() else { return };
    peripherals.SYST.set_clock_source(SystClkSource::Core);
    peripherals.SYST.set_reload(TICKS_PER_ROW - 1);
    peripherals.SYST.clear_current();
    peripherals.SYST.enable_interrupt();
    peripherals.SYST.enable_counter();
}

/// Counts pixels of a frame that the panel does not show.
struct Comparison {
    panel: &'static mut Panel,
    n_other: u32,
}

impl TileSink for Comparison {
    type Error = core::convert::Infallible;

    fn tile(&mut self, Tile { x_px, y_px, width, height, rgb, .. }: Tile<'_>) -> Result<(), Self::Error> {
        let mut copy = [[0; 3]; 16 * 16];
        let (rgb_copy, _) = copy.split_at_mut(rgb.len());
        rgb_copy.copy_from_slice(rgb);
        let tile = Tile::new([x_px, y_px], [width, height], rgb_copy);
        let packed = tile.map(|tile| tile.into_rgb565(ByteOrder::BigEndian, Rounding::Dithered));
        let pixels = packed.unwrap_or_default().as_chunks().0;
        let [x, y, width] = [x_px, y_px, width].map(usize::from);
        for (line, drawn) in self.panel.iter().skip(y).zip(pixels.chunks(width)) {
            let shown = line.iter().skip(x);
            // At most 256.
            self.n_other += shown.zip(drawn).filter(|&(shown, drawn)| shown != drawn).count() as u32;
        }
        Ok(())
    }
}
