//! Memory of the emulated boards, which `PSB_BOARD` names as QEMU does.

use std::path::PathBuf;
use std::{env, fs};

/// mps2-an386.
const CORTEX_M: &str = "MEMORY
{
  FLASH : ORIGIN = 0x00000000, LENGTH = 4M
  RAM   : ORIGIN = 0x20000000, LENGTH = 4M
}
";
/// mps2-an505, which starts in the secure state.
const CORTEX_M33: &str = "MEMORY
{
  FLASH : ORIGIN = 0x10000000, LENGTH = 4M
  RAM   : ORIGIN = 0x38000000, LENGTH = 4M
}
";
/// mps3-an547, as well; code is in the ITCM.
const CORTEX_M55: &str = "MEMORY
{
  FLASH : ORIGIN = 0x10000000, LENGTH = 512K
  RAM   : ORIGIN = 0x31000000, LENGTH = 2M
}
";
/// virt.
const RISC_V: &str = "MEMORY
{
  RAM : ORIGIN = 0x80000000, LENGTH = 16M
}
REGION_ALIAS(\"REGION_TEXT\", RAM);
REGION_ALIAS(\"REGION_RODATA\", RAM);
REGION_ALIAS(\"REGION_DATA\", RAM);
REGION_ALIAS(\"REGION_BSS\", RAM);
REGION_ALIAS(\"REGION_HEAP\", RAM);
REGION_ALIAS(\"REGION_STACK\", RAM);
";

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let cfg = |name: &str| env::var(name).unwrap_or_default();
    if cfg("CARGO_CFG_TARGET_OS") != "none" {
        return;
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    println!("cargo::rerun-if-env-changed=PSB_BOARD");
    let memory = match cfg("PSB_BOARD").as_str() {
        "mps2-an386" => CORTEX_M,
        "mps2-an505" => CORTEX_M33,
        "mps3-an547" => CORTEX_M55,
        "virt" => RISC_V,
        other => panic!("PSB_BOARD is {other:?}; it must be mps2-an386, mps2-an505, mps3-an547 or virt"),
    };
    fs::write(out.join("memory.x"), memory).expect("OUT_DIR can be written");
    println!("cargo::rustc-link-search={}", out.display());
    if memory == RISC_V {
        println!("cargo::rustc-link-arg-bins=-Tmemory.x");
    }
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
}
