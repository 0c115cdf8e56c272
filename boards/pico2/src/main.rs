//! Draws an orbit around the scene of a bundle on a Raspberry Pi Pico 2 with an ST7789 display of 240 × 240 pixels on SPI.
//!
//! Both cores draw, each half of the scene and then half of the tiles, where there is memory for that; a tile goes out when the bus is free.
//! Wiring and flashing: `boards/README.md`. Built in CI, not yet run on hardware.
#![no_std]
#![no_main]

mod second_core;

use core::convert::Infallible;
use core::f32::consts::TAU;

use cortex_m::peripheral::DWT;
use defmt::Display2Format;
use defmt_rtt as _;
use embedded_hal::digital::OutputPin as _;
use embedded_hal::spi::MODE_0;
use embedded_hal_bus::spi::ExclusiveDevice;
use mipidsi::interface::SpiInterface;
use mipidsi::models::ST7789;
use mipidsi::options::ColorInversion;
use panic_probe as _;
use pocketsplat_core::{Budget, Bundle, Camera, Decoder, Overflow, Plan, Tile, TileSink};
use rp235x_hal::clocks::{Clock as _, init_clocks_and_plls};
use rp235x_hal::fugit::RateExtU32 as _;
use rp235x_hal::gpio::Pins;
use rp235x_hal::{self as hal, Sio, Spi, Timer, Watchdog};
use second_core::{ByTurns, SecondCore};
use static_cell::ConstStaticCell;

/// The panel, pixels; 320 high fits as well.
const PANEL_PX: (u16, u16) = (240, 240);
/// The ST7789 takes up to 62.5 MHz; the bus runs at the nearest rate below: 37.5 MHz.
const SPI_HZ: u32 = 40_000_000;
/// The crystal of the Pico 2.
const CRYSTAL_HZ: u32 = 12_000_000;
/// Frames of a turn around the scene.
const N_FRAMES: u16 = 120;
/// Frames at first whose cycles are counted.
const N_COUNTED: u16 = 4;
/// RAM of the chip, less 26 KiB for stacks and other statics; the linker refuses when it does not fit.
const SCRATCH_LEN: usize = (520 - 26) * 1024;

static BUNDLE: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/bundle.psb"));
static SCRATCH: ConstStaticCell<[u8; SCRATCH_LEN]> = ConstStaticCell::new([0; SCRATCH_LEN]);
/// Pixels on their way to the bus.
static SPI_BUFFER: ConstStaticCell<[u8; 512]> = ConstStaticCell::new([0; 512]);

/// Tells the boot ROM that this is a program.
#[expect(unsafe_code, reason = "the boot ROM finds it by its section")]
#[unsafe(link_section = ".start_block")]
#[used]
static IMAGE_DEF: hal::block::ImageDef = hal::block::ImageDef::secure_exe();

#[hal::entry]
fn main() -> ! {
    let mut chip = defmt::unwrap!(hal::pac::Peripherals::take());
    let mut core = defmt::unwrap!(cortex_m::Peripherals::take());
    let resets = &mut chip.RESETS;
    // The processor at 150 MHz.
    let mut watchdog = Watchdog::new(chip.WATCHDOG);
    let clocks =
        init_clocks_and_plls(CRYSTAL_HZ, chip.XOSC, chip.CLOCKS, chip.PLL_SYS, chip.PLL_USB, resets, &mut watchdog)
            .unwrap_or_else(|_| defmt::panic!("the clocks do not start"));
    let mut timer = Timer::new_timer0(chip.TIMER0, resets, &clocks);

    let mut sio = Sio::new(chip.SIO);
    let pins = Pins::new(chip.IO_BANK0, chip.PADS_BANK0, sio.gpio_bank0, resets);
    let (clock, data) = (pins.gpio10.into_function(), pins.gpio11.into_function());
    let (command, select) = (pins.gpio8.into_push_pull_output(), pins.gpio9.into_push_pull_output());
    let (reset, mut backlight) = (pins.gpio12.into_push_pull_output(), pins.gpio13.into_push_pull_output());
    let bus_hz = clocks.peripheral_clock.freq();
    let bus = Spi::<_, _, _, 8>::new(chip.SPI1, (data, clock)).init(resets, bus_hz, SPI_HZ.Hz(), MODE_0);
    let bus = ExclusiveDevice::new(bus, select, timer).unwrap_or_else(stop);
    let mut display = mipidsi::Builder::new(ST7789, SpiInterface::new(bus, command, SPI_BUFFER.take()))
        .display_size(PANEL_PX.0, PANEL_PX.1)
        .invert_colors(ColorInversion::Inverted)
        .reset_pin(reset)
        .init(&mut timer)
        .unwrap_or_else(|_| defmt::panic!("the display does not take its set-up"));

    let bundle = Bundle::parse(BUNDLE).unwrap_or_else(stop);
    let camera = pocketsplat_panel::fitted(&bundle.header().preview, PANEL_PX.0, PANEL_PX.1);
    let budget = Budget::for_frame(camera.width_px, camera.height_px).in_bytes(SCRATCH_LEN);
    // A scene that no pruning rate makes small enough still fits in slabs of depth, which take longer.
    let one = Plan::new(&bundle, &budget).or_else(|_| Plan::new(&bundle, &budget.with_overflow(Overflow::Slabs)));
    let (one, scratch) = (one.unwrap_or_else(stop), SCRATCH.take());
    // A second painter takes memory, but none of the scene's.
    let two = Plan::new(&bundle, &budget.with_two_painters()).ok();
    let two = two.filter(|two| two.pruning_rate() == one.pruning_rate() && two.head_weights() == one.head_weights());

    pocketsplat_panel::blank(&mut display).unwrap_or_else(|_| defmt::panic!("the bus of the display failed"));
    let orbit = |n: u16| (0..n).map(move |frame| (frame, camera.orbited(TAU * f32::from(frame) / f32::from(n))));
    let views = orbit(N_FRAMES).cycle();
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    // By one core, which does not sleep: what predictions are of.
    let mut alone = Decoder::bind(&bundle, one, &mut *scratch).unwrap_or_else(stop);
    for (_, view) in orbit(N_COUNTED) {
        let start = DWT::cycle_count();
        let report = pocketsplat_panel::draw_unseen(&mut alone, &view).unwrap_or_else(stop);
        defmt::info!("one core, without display: {} cycles, {}", DWT::cycle_count().wrapping_sub(start), report);
    }
    if let Some(plan) = two {
        defmt::info!("two cores: {}", plan);
        let mut second = defmt::unwrap!(SecondCore::start(&mut chip.PSM, &mut chip.PPB, &mut sio.fifo));
        let mut painters: [Decoder<'_, '_>; 2] = Decoder::bind_two(&bundle, plan, scratch).unwrap_or_else(stop);
        let display = ByTurns::new(display);
        for (frame, view) in views {
            let start = timer.get_counter();
            let send = |camera: &Camera, tile: Tile<'_>| {
                let sent = display.with(|display| pocketsplat_panel::send(display, camera, tile));
                sent.unwrap_or_else(|_| defmt::panic!("the bus of the display failed"));
            };
            let [mut above, mut below] = [(); 2].map(|()| Sending { camera: &view, send: &send });
            let reports = Decoder::render_by_two(&mut painters, &view, [&mut above, &mut below], |here, there| {
                second.meanwhile(here, there);
            });
            let reports = reports.unwrap_or_else(stop);
            defmt::info!("frame {}: {} ms, {}", frame, (timer.get_counter() - start).to_millis(), reports);
            backlight.set_high().unwrap_or_else(stop);
        }
    } else {
        defmt::info!("one core: {}", one);
        let mut decoder = Decoder::bind(&bundle, one, scratch).unwrap_or_else(stop);
        for (frame, view) in views {
            let start = timer.get_counter();
            let report = pocketsplat_panel::draw(&mut decoder, &view, &mut display).unwrap_or_else(stop);
            defmt::info!("frame {}: {} ms, {}", frame, (timer.get_counter() - start).to_millis(), report);
            backlight.set_high().unwrap_or_else(stop);
        }
    }
    defmt::panic!("views do not end")
}

/// Sends tiles from whichever core has them.
struct Sending<'s, F> {
    camera: &'s Camera,
    send: &'s F,
}

impl<F: Fn(&Camera, Tile<'_>)> TileSink for Sending<'_, F> {
    type Error = Infallible;

    fn tile(&mut self, tile: Tile<'_>) -> Result<(), Infallible> {
        (self.send)(self.camera, tile);
        Ok(())
    }
}

/// Ends with what went wrong in the log.
fn stop<T>(error: impl core::fmt::Display) -> T {
    defmt::panic!("{}", Display2Format(&error))
}
