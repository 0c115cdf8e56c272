//! Two cores draw a frame together; the pixels are compared with those of one core, which are written to files, and the
//! plugin in `../../cycles/` counts the instructions of each.
#![no_std]
#![no_main]

#[path = "../board/second_core.rs"]
mod second_core;
#[path = "../stack.rs"]
mod stack;
#[path = "../stop.rs"]
mod stop;

use core::convert::Infallible;
use core::f32::consts::TAU;
use core::ffi::CStr;
use core::sync::atomic::{AtomicU8, Ordering};

use cortex_m_rt::entry;
use defmt_semihosting as _;
use pocketsplat_core::{Bundle, Camera, DecodeError, Decoder, Part, Plan, RenderError, Tile, TileSink};
use second_core::SecondCore;
use semihosting::{fs, io, io::Write as _};
use static_cell::ConstStaticCell;

/// What build.rs writes.
mod settings {
    #![expect(dead_code, reason = "the other program uses all")]
    use pocketsplat_core::{Budget, Camera, Quality};
    include!(concat!(env!("OUT_DIR"), "/settings.rs"));
    pub(crate) fn budget(width_px: u16, height_px: u16, bytes: usize) -> Budget {
        asked(Budget::for_frame(width_px, height_px).in_bytes(bytes))
    }
    pub(crate) type Arithmetic = Chosen;
    pub(crate) const STACK: usize = STACK_LEN;
}
use settings::{Arithmetic, HEIGHT_PX, N_FRAMES, SCRATCH_LEN, STACK, WIDTH_PX, budget};

/// Written by both cores at once, each in its rows of tiles, which every frame decides.
type Pixels = [[AtomicU8; 3]; WIDTH_PX * HEIGHT_PX];

static BUNDLE: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/bundle.psb"));
static SCRATCH: ConstStaticCell<[u8; SCRATCH_LEN]> = ConstStaticCell::new([0; SCRATCH_LEN]);
/// The second core's, as long as the first one's.
static STACK_OF_SECOND: ConstStaticCell<[u64; STACK / 8]> = ConstStaticCell::new([0; STACK / 8]);
/// What one core draws, and what two draw: memory that a display has.
#[expect(unsafe_code, reason = "the linker puts the display's memory outside the device's RAM")]
#[unsafe(link_section = ".panel")]
static PANEL: [Pixels; 2] = [const { [const { [const { AtomicU8::new(0) }; 3] }; WIDTH_PX * HEIGHT_PX] }; 2];

/// Why there is no picture.
#[derive(defmt::Format)]
enum Failure {
    /// The bundle, or the memory for it.
    Decode(DecodeError),
    /// The host does not take a file.
    File,
    /// So many pixels of a frame differ.
    Pixels(usize),
}

impl From<DecodeError> for Failure {
    fn from(error: DecodeError) -> Self {
        Self::Decode(error)
    }
}

impl From<RenderError<Infallible>> for Failure {
    fn from(error: RenderError<Infallible>) -> Self {
        Self::Decode(error.into())
    }
}

impl From<io::Error> for Failure {
    fn from(_: io::Error) -> Self {
        Self::File
    }
}

/// Puts tiles where they belong.
struct Screen<'p>(&'p Pixels);

impl TileSink for Screen<'_> {
    type Error = Infallible;

    fn tile(&mut self, Tile { x_px, y_px, width, rgb, .. }: Tile<'_>) -> Result<(), Infallible> {
        let [x, y, width] = [x_px, y_px, width].map(usize::from);
        let lines = self.0.chunks_exact(WIDTH_PX).skip(y);
        for (line, drawn) in lines.zip(rgb.chunks_exact(width.max(1))) {
            for (pixel, drawn) in line.iter().skip(x).zip(drawn) {
                pixel.iter().zip(drawn).for_each(|(to, from)| to.store(*from, Ordering::Relaxed));
            }
        }
        Ok(())
    }
}

/// Draws, compares, and ends.
#[entry]
fn main() -> ! {
    let _ = stack::paint();
    let second = SecondCore::start(STACK_OF_SECOND.take());
    match draw_orbit(second, SCRATCH.take()) {
        Ok(()) => {
            defmt::info!("stack: {} bytes used of {}", stack::most_used(), stack::len());
            defmt::info!("stack of the second core: {} bytes used", second_core::most_used());
            stop::success()
        }
        Err(failure) => {
            defmt::error!("{}", failure);
            stop::failure()
        }
    }
}

/// Draws the frames of an orbit by one core, then by two.
fn draw_orbit(mut second: SecondCore, scratch: &mut [u8]) -> Result<(), Failure> {
    let [alone, both] = &PANEL;
    let bundle = Bundle::parse(BUNDLE)?;
    // The build script's sizes fit these types.
    let preview = bundle.header().preview.resized(WIDTH_PX as u16, HEIGHT_PX as u16);
    let budget = budget(preview.width_px, preview.height_px, scratch.len());
    let (one, two) = (Plan::new(&bundle, &budget)?, Plan::new(&bundle, &budget.with_two_painters())?);
    for plan in [&one, &two] {
        let painter = plan.memory().find(|memory| memory.part == Part::SecondPainter).map_or(0, |part| part.n_bytes);
        defmt::info!(
            "plan: {} bytes, of which the second painter takes {}; {} of {} tiers, resident {}, baked {}, {} strips of {} splats",
            plan.scratch_len(),
            painter,
            plan.n_tiers(),
            bundle.n_tiers(),
            plan.is_resident(),
            plan.is_baked(),
            plan.n_strips(),
            plan.max_splats()
        );
    }
    for frame in 0..N_FRAMES {
        let camera = preview.orbited(TAU * f32::from(frame) / f32::from(N_FRAMES));
        by_one(&bundle, one, &camera, alone, scratch)?;
        write_ppm(alone, frame)?;
        by_two(&bundle, two, &camera, both, scratch, &mut second)?;
        let n_other = alone.iter().zip(both).filter(|(alone, both)| value(alone) != value(both)).count();
        if n_other > 0 {
            return Err(Failure::Pixels(n_other));
        }
    }
    Ok(())
}

/// Draws a frame by the first core.
// Not inlined, here and below: the caller's stack frame would keep its decoder.
#[inline(never)]
fn by_one(
    bundle: &Bundle<'_>,
    plan: Plan,
    camera: &Camera,
    pixels: &Pixels,
    scratch: &mut [u8],
) -> Result<(), Failure> {
    let mut decoder = Decoder::bind_in::<Arithmetic>(bundle, plan, scratch)?;
    let report = counted(|| decoder.render(camera, &mut Screen(pixels)))?;
    defmt::info!("one core: {}", report);
    Ok(())
}

/// Draws a frame by both.
#[inline(never)]
fn by_two(
    bundle: &Bundle<'_>,
    plan: Plan,
    camera: &Camera,
    pixels: &Pixels,
    scratch: &mut [u8],
    second: &mut SecondCore,
) -> Result<(), Failure> {
    pixels.as_flattened().iter().for_each(|byte| byte.store(0, Ordering::Relaxed));
    let mut painters = Decoder::bind_two::<Arithmetic>(bundle, plan, scratch)?;
    let [mut above, mut below] = [(); 2].map(|()| Screen(pixels));
    let reports = counted(|| {
        Decoder::render_by_two(&mut painters, camera, [&mut above, &mut below], |here, there| {
            // What the first core does alone ends; waiting does not count.
            stretch::<2>();
            second.meanwhile(&mut || counted(&mut *there), || counted(here));
            stretch::<1>();
        })
    })?;
    defmt::info!("two cores: {}", reports);
    Ok(())
}

/// Does something that the plugin counts.
#[inline(always)]
fn counted<T>(work: impl FnOnce() -> T) -> T {
    stretch::<1>();
    let done = work();
    stretch::<2>();
    done
}

/// Tells the plugin where a stretch of code begins (1) or ends (2); a processor does nothing.
#[inline(always)]
fn stretch<const END: u8>() {
    #[expect(unsafe_code, reason = "a hint")]
    // SAFETY: it changes nothing.
    unsafe {
        core::arch::asm!("dbg #{}", const END);
    }
}

/// Writes what one core drew to `frame0.ppm` and so on, in the folder in which QEMU runs.
///
/// * `frame`: 0 to 9.
fn write_ppm(pixels: &Pixels, frame: u8) -> io::Result<()> {
    let name = [b'f', b'r', b'a', b'm', b'e', b'0' + frame, b'.', b'p', b'p', b'm', 0];
    let mut file = fs::File::create(CStr::from_bytes_until_nul(&name).unwrap_or_default())?;
    write!(file, "P6\n{WIDTH_PX} {HEIGHT_PX}\n255\n")?;
    pixels.chunks(64).try_for_each(|pixels| {
        let mut bytes = [[0; 3]; 64];
        let bytes = &mut bytes[..pixels.len()];
        bytes.iter_mut().zip(pixels).for_each(|(to, from)| *to = value(from));
        file.write_all(bytes.as_flattened())
    })
}

/// What a pixel is.
fn value(pixel: &[AtomicU8; 3]) -> [u8; 3] {
    pixel.each_ref().map(|byte| byte.load(Ordering::Relaxed))
}
