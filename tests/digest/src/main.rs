//! Converts halves, computes layers, roots and rows of pixels, decodes and draws bundles, one of each coder and one of hard cases, and prints what came out as numbers: the
//! same on every target.
//!
//! `PSB_STATIC`, `PSB_CONTEXT` and `PSB_HARD` name the bundles when it is built.
#![cfg_attr(target_os = "none", no_std, no_main)]

mod digest;
mod frame;
mod halves;
mod kernels;

use core::fmt;

use pocketsplat_format::{Bundle, DecodeError};

static BUNDLES: [(&str, &[u8]); 3] = [
    ("static", include_bytes!(env!("PSB_STATIC"))),
    ("context", include_bytes!(env!("PSB_CONTEXT"))),
    ("hard", include_bytes!(env!("PSB_HARD"))),
];

/// Words that the models of an anchor may take.
const SCRATCH_WORDS: usize = 16 * 1024;
/// Bytes that a frame may take.
const SCRATCH_BYTES: usize = 512 * 1024;

/// Hands `print` a line for the conversions, one for what else may be assembly, and one for each bundle.
fn run(print: impl Fn(fmt::Arguments<'_>)) -> Result<(), DecodeError> {
    let mut scratch = [0; SCRATCH_WORDS];
    let mut memory = [0; SCRATCH_BYTES];
    print(format_args!("halves: {:016x}", halves::digest().0));
    print(format_args!("layers, roots, rows: {:016x}", kernels::digest().0));
    for (name, bytes) in BUNDLES {
        let bundle = Bundle::parse(bytes)?;
        let [symbols, values] = digest::digests(&bundle, &mut scratch)?;
        let [frame, with_halves, without_fpu] = frame::frame_digests(&bundle, &mut memory)?;
        print(format_args!(
            "{name}: {} anchors, symbols {:016x}, values {:016x}, frame {:016x}, with halves {:016x}, without FPU {:016x}",
            bundle.n_anchors(),
            symbols.0,
            values.0,
            frame.0,
            with_halves.0,
            without_fpu.0
        ));
    }
    Ok(())
}

#[cfg(not(target_os = "none"))]
fn main() -> Result<(), DecodeError> {
    run(|line| println!("{line}"))
}

#[cfg(target_os = "none")]
mod bare {
    use core::panic::PanicInfo;

    #[cfg(target_arch = "arm")]
    use cortex_m_rt::entry;
    #[cfg(target_arch = "riscv32")]
    use riscv_rt::entry;
    use semihosting::{println, process};

    #[entry]
    fn main() -> ! {
        match super::run(|line| println!("{line}")) {
            Ok(()) => process::exit(0),
            Err(error) => {
                println!("{error}");
                process::exit(1)
            }
        }
    }

    #[panic_handler]
    fn panic(info: &PanicInfo<'_>) -> ! {
        println!("{info}");
        process::exit(1)
    }
}
