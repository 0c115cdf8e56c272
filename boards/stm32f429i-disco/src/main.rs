//! Draws an orbit around the scene of a bundle on an STM32F429I Discovery with its ILI9341 display of 240 × 320 pixels on SPI.
//!
//! Flashing: `boards/README.md`. Built in CI, not yet run on hardware.
#![no_std]
#![no_main]

use core::f32::consts::TAU;

use cortex_m::peripheral::DWT;
use defmt::Display2Format;
use defmt_rtt as _;
use embedded_hal_bus::spi::ExclusiveDevice;
use mipidsi::interface::SpiInterface;
use mipidsi::models::ILI9341Rgb565;
use mipidsi::options::{ColorOrder, Orientation, Rotation};
use panic_probe as _;
use pocketsplat_core::{Budget, Bundle, Decoder, Overflow, Plan};
use static_cell::ConstStaticCell;
use stm32f4xx_hal::gpio::{PinState, Speed};
use stm32f4xx_hal::pac::{CorePeripherals, Peripherals, SPI5};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Config;
use stm32f4xx_hal::spi::{Mode, Phase, Polarity, Spi};

/// The panel, pixels, as it lies: its long side across.
const PANEL_PX: (u16, u16) = (320, 240);
/// The ILI9341 is specified for 10 MHz; the bus has 5.625 and 11.25 MHz.
const SPI_HZ: u32 = 5_625_000;
/// The crystal of the board.
const CRYSTAL_HZ: u32 = 8_000_000;
/// Frames of a turn around the scene.
const N_FRAMES: u16 = 120;
/// Frames at first whose cycles are counted.
const N_COUNTED: u16 = 4;
/// RAM of the chip beside the core-coupled memory, less 2 KiB for other statics; the linker refuses when it does not fit.
const SCRATCH_LEN: usize = (192 - 2) * 1024;

static BUNDLE: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/bundle.psb"));
static SCRATCH: ConstStaticCell<[u8; SCRATCH_LEN]> = ConstStaticCell::new([0; SCRATCH_LEN]);
/// Pixels on their way to the bus.
static SPI_BUFFER: ConstStaticCell<[u8; 512]> = ConstStaticCell::new([0; 512]);

#[cortex_m_rt::entry]
fn main() -> ! {
    let chip = defmt::unwrap!(Peripherals::take());
    let mut core = defmt::unwrap!(CorePeripherals::take());
    // The processor at 180 MHz.
    let mut rcc = chip.RCC.freeze(Config::hse(CRYSTAL_HZ.Hz()).sysclk(180.MHz()));
    let mut delay = core.SYST.delay(&rcc.clocks);
    let mut timer = chip.TIM2.counter_us(&mut rcc);

    let (port_c, port_d, port_f) = (chip.GPIOC.split(&mut rcc), chip.GPIOD.split(&mut rcc), chip.GPIOF.split(&mut rcc));
    // The gyroscope hangs on the same bus.
    let _gyroscope = port_c.pc1.into_push_pull_output_in_state(PinState::High);
    let (command, select) = (port_d.pd13.into_push_pull_output(), port_c.pc2.into_push_pull_output());
    let mode = Mode { polarity: Polarity::IdleLow, phase: Phase::CaptureOnFirstTransition };
    let clock = port_f.pf7.into_alternate::<5>().speed(Speed::High);
    let data = port_f.pf9.into_alternate::<5>().speed(Speed::High);
    let pins = (Some(clock), SPI5::NoMiso, Some(data));
    let bus = Spi::new(chip.SPI5, pins, mode, SPI_HZ.Hz(), &mut rcc);
    let bus = ExclusiveDevice::new_no_delay(bus, select).unwrap_or_else(stop);
    let mut display = mipidsi::Builder::new(ILI9341Rgb565, SpiInterface::new(bus, command, SPI_BUFFER.take()))
        // The glass shows the rows of an ILI9341's memory from right to left.
        .orientation(Orientation { rotation: Rotation::Deg90, mirrored: true })
        .color_order(ColorOrder::Bgr)
        .init(&mut delay)
        .unwrap_or_else(|_| defmt::panic!("the display does not take its set-up"));

    let bundle = Bundle::parse(BUNDLE).unwrap_or_else(stop);
    let camera = pocketsplat_panel::fitted(&bundle.header().preview, PANEL_PX.0, PANEL_PX.1);
    let budget = Budget::for_frame(camera.width_px, camera.height_px).in_bytes(SCRATCH_LEN);
    // A scene that no pruning rate makes small enough still fits in slabs of depth, which take longer.
    let plan = Plan::new(&bundle, &budget)
        .or_else(|_| Plan::new(&bundle, &budget.with_overflow(Overflow::Slabs)))
        .unwrap_or_else(stop);
    defmt::info!("{}", plan);
    let mut decoder = Decoder::bind(&bundle, plan, SCRATCH.take()).unwrap_or_else(stop);

    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    for frame in 0..N_COUNTED {
        let view = camera.orbited(TAU * f32::from(frame) / f32::from(N_COUNTED));
        let start = DWT::cycle_count();
        let report = pocketsplat_panel::draw_unseen(&mut decoder, &view).unwrap_or_else(stop);
        defmt::info!("one core, without display: {} cycles, {}", DWT::cycle_count().wrapping_sub(start), report);
    }

    pocketsplat_panel::blank(&mut display).unwrap_or_else(|_| defmt::panic!("the bus of the display failed"));
    loop {
        for frame in 0..N_FRAMES {
            let view = camera.orbited(TAU * f32::from(frame) / f32::from(N_FRAMES));
            // Counts from nothing; no frame takes an hour.
            timer.start(3600.secs()).unwrap_or_else(|_| defmt::panic!("the timer does not start"));
            let report = pocketsplat_panel::draw(&mut decoder, &view, &mut display).unwrap_or_else(stop);
            defmt::info!("frame {}: {} ms, {}", frame, timer.now().duration_since_epoch().to_millis(), report);
        }
    }
}

/// Ends with what went wrong in the log.
fn stop<T>(error: impl core::fmt::Display) -> T {
    defmt::panic!("{}", Display2Format(&error))
}
