//! Puts a bundle into flash, and lays out the memory of the board and of the device class that the firmware is built for.
//!
//! | variable | what | without it |
//! |---|---|---|
//! | `PSB_BUNDLE` | absolute path of the bundle | an error |
//! | `BOARD` | `mps2-an385`, `mps2-an386`, `mps2-an500`, `mps2-an521`, or `virt` and `virt-fpu` for RISC-V | `mps2-an386`; for RISC-V `virt` |
//! | `RAM_KIB` | RAM in all: statics, scratch memory, stack | what README.md has of the board |
//! | `STACK_KIB` | of which the stack's, for each core | 10; with two cores 16 |
//! | `SIZE` | frames, `WIDTHxHEIGHT` | the preview's |
//! | `FRAMES` | frames of the orbit, at most 10 | 4 |
//! | `VIEWS` | absolute path of cameras to draw instead, at most 10: a line each of the numbers of a `Camera`, in its order | an orbit |
//! | `QUALITY` | `EXACT`, `BALANCED` or `DRAFT` | `EXACT` |
//! | `BUDGET` | what else is asked of the `Budget`, in Rust: `.with_tiers(2)` | nothing |
//! | `ARITHMETIC` | `ReferenceArithmetic` or `WithoutFpu` | `ReferenceArithmetic` |

use std::error::Error;
use std::path::{Path, PathBuf};
use std::{env, fs};

use pocketsplat_core::Bundle;

/// KiB reserved for the stack, and with two cores for each one's; the firmware fails when it comes near.
const STACK_KIB: usize = 10;
const STACK_KIB_OF_TWO: usize = 16;
/// The board with two cores, each of which has a stack.
const TWO_CORES: &str = "mps2-an521";
/// Bytes of all statics beside the scratch memory, which gets the rest: the logger's and the flags of the cells.
const OTHER_STATICS: usize = 512;

/// A board: its name, the architecture of its processor, RAM of its usual device class in KiB, memory.
const BOARDS: [(&str, &str, usize, &str); 6] = [
    ("mps2-an386", "arm", 256, include_str!("src/board/mps2-an386.x")),
    ("mps2-an385", "arm", 256, include_str!("src/board/mps2-an386.x")),
    ("mps2-an500", "arm", 1024, include_str!("src/board/mps2-an500.x")),
    ("mps2-an521", "arm", 520, include_str!("src/board/mps2-an521.x")),
    ("virt", "riscv32", 512, include_str!("src/board/virt.x")),
    ("virt-fpu", "riscv32", 512, include_str!("src/board/virt.x")),
];

/// The display's memory, and room for the stack; the symbols are those of the boards' start-up code.
const SECTIONS: &str = r#"
SECTIONS
{
  .panel : { *(.panel) } > PANEL
}
ASSERT(_stack_start - _stack_end >= STACK_LEN, "
ERROR(firmware-example): no room for the stack; OTHER_STATICS of build.rs is too small");
"#;

fn main() {
    if let Err(error) = prepare() {
        println!("cargo::error={error}");
    }
}

fn prepare() -> Result<(), Box<dyn Error>> {
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let arch = env::var("CARGO_CFG_TARGET_ARCH")?;
    println!("cargo::rerun-if-changed=build.rs");
    let usual = BOARDS.iter().find(|board| board.1 == arch).map(|board| board.0);
    let name = variable("BOARD").or(usual.map(Into::into)).ok_or("no board has this target's architecture")?;
    let (name, _, usual_ram_kib, memory) = BOARDS
        .into_iter()
        .find(|board| board.0 == name && board.1 == arch)
        .ok_or_else(|| format!("BOARD={name} is no board of architecture {arch}: see build.rs"))?;
    let (n_stacks, usual_stack_kib) = if name == TWO_CORES { (2, STACK_KIB_OF_TWO) } else { (1, STACK_KIB) };
    let ram_kib = variable("RAM_KIB").map_or(Ok(usual_ram_kib), |text| text.parse())?;
    let stack_len = variable("STACK_KIB").map_or(Ok(usual_stack_kib), |text| text.parse())? * 1024;
    lay_out(memory, ram_kib, stack_len, &out)?;

    let path = variable("PSB_BUNDLE")
        .ok_or("PSB_BUNDLE is not set: set it to the absolute path of a bundle, as README.md shows")?;
    println!("cargo::rerun-if-changed={path}");
    let bytes = fs::read(&path).map_err(|error| format!("bundle {path}: {error}"))?;
    let preview = Bundle::parse(&bytes).map_err(|error| format!("bundle {path}: {error}"))?.header().preview;
    fs::write(out.join("bundle.psb"), &bytes)?;
    let (width_px, height_px) = match variable("SIZE") {
        None => (preview.width_px, preview.height_px),
        Some(size) => {
            let (width, height) = size.split_once('x').ok_or("SIZE is not WIDTHxHEIGHT, for instance 160x120")?;
            (width.parse()?, height.parse()?)
        }
    };
    let views = variable("VIEWS").map_or(Ok(Vec::new()), |path| cameras(&path))?;
    let n_frames = match views.len() {
        0 => variable("FRAMES").map_or(Ok(4), |text| text.parse())?,
        n => n,
    };
    let quality = variable("QUALITY").unwrap_or_else(|| "EXACT".into());
    if !["EXACT", "BALANCED", "DRAFT"].contains(&quality.as_str()) {
        return Err(format!("QUALITY={quality} is none of EXACT, BALANCED, DRAFT").into());
    }
    // Names that are none are errors of the compiler's.
    let budget = variable("BUDGET").unwrap_or_default();
    let arithmetic = variable("ARITHMETIC").unwrap_or_else(|| "ReferenceArithmetic".into());
    let scratch_len = (ram_kib * 1024)
        .checked_sub(n_stacks * stack_len + OTHER_STATICS)
        .ok_or_else(|| format!("RAM_KIB={ram_kib} leaves no scratch memory beside {stack_len} bytes of stack"))?;
    let views = views.concat();
    let settings = format!(
        "const BOARD: &str = {name:?};\nconst RAM_KIB: usize = {ram_kib};\nconst STACK_LEN: usize = {stack_len};\n\
         pub(crate) const SCRATCH_LEN: usize = {scratch_len};\npub(crate) const WIDTH_PX: usize = {width_px};\n\
         pub(crate) const HEIGHT_PX: usize = {height_px};\npub(crate) const N_FRAMES: u8 = {n_frames};\n\
         const VIEWS: &[Camera] = &[{views}];\nconst QUALITY: Quality = Quality::{quality};\n\
         fn asked(budget: Budget) -> Budget {{ budget.with_quality(QUALITY){budget} }}\n\
         type Chosen = pocketsplat_core::{arithmetic};\n"
    );
    Ok(fs::write(out.join("settings.rs"), settings)?)
}

/// Writes the linker's `memory.x` and asks for it and the scripts of start-up code and logger.
fn lay_out(memory: &str, ram_kib: usize, stack_len: usize, out: &Path) -> Result<(), Box<dyn Error>> {
    // Numbers, because flip-link reads them too.
    let numbers = |text: &str| {
        text.replace("RAM_KIB * 1024", &(ram_kib * 1024).to_string()).replace("STACK_LEN", &stack_len.to_string())
    };
    fs::write(out.join("memory.x"), numbers(memory) + &numbers(SECTIONS))?;
    println!("cargo::rustc-link-search={}", out.display());
    // Here and not in .cargo/config.toml, where a RUSTFLAGS of the environment would replace them.
    if memory.contains("REGION_ALIAS") {
        println!("cargo::rustc-link-arg-bins=-Tmemory.x");
    }
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    println!("cargo::rustc-link-arg-bins=-Tdefmt.x");
    Ok(())
}

/// Each line of a file as a camera in Rust.
fn cameras(path: &str) -> Result<Vec<String>, Box<dyn Error>> {
    println!("cargo::rerun-if-changed={path}");
    let text = fs::read_to_string(path).map_err(|error| format!("views {path}: {error}"))?;
    let camera = |line: &str| -> Result<String, Box<dyn Error>> {
        let numbers: Vec<f32> = line.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
        let [rotation @ .., t0, t1, t2, fx, fy, cx, cy, width, height] = numbers.as_slice() else {
            return Err(format!("views {path}: a line of {} numbers; a camera has 18", numbers.len()).into());
        };
        Ok(format!(
            "Camera {{ rotation: pocketsplat_core::Rotation::new_unchecked({rotation:?}), translation: {:?}, \
             focal_px: {:?}, principal_px: {:?}, width_px: {width}, height_px: {height} }},",
            [t0, t1, t2],
            [fx, fy],
            [cx, cy]
        ))
    };
    text.lines().map(camera).collect()
}

/// A variable of the environment, which decides about this build.
fn variable(name: &str) -> Option<String> {
    println!("cargo::rerun-if-env-changed={name}");
    env::var(name).ok()
}
