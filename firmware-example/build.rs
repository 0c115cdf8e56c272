//! Puts a bundle into flash and sizes the static buffers for its preview view, which the build machine draws once.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::{env, fs};

use pocketsplat_core::{Budget, Bundle, Decoder, MaxSplats, Residency, Strips, TileSink};

fn main() {
    let here = env::var("CARGO_MANIFEST_DIR").expect("cargo sets CARGO_MANIFEST_DIR");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=memory.x");
    println!("cargo::rerun-if-env-changed=PSB_BUNDLE");
    // For memory.x.
    println!("cargo::rustc-link-search={here}");
    // Here and not in .cargo/config.toml, where a RUSTFLAGS of the environment would replace them.
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    println!("cargo::rustc-link-arg-bins=-Tdefmt.x");
    let Some(path) = env::var_os("PSB_BUNDLE").map(PathBuf::from) else {
        println!("cargo::error=PSB_BUNDLE is not set: set it to the absolute path of a bundle, as README.md shows");
        return;
    };
    println!("cargo::rerun-if-changed={}", path.display());
    if let Err(error) = embed(&path, &out) {
        println!("cargo::error=bundle {}: {error}", path.display());
    }
}

/// Copies the bundle to where `include_bytes!` finds it, and writes the sizes of the buffers as constants.
fn embed(path: &Path, out: &Path) -> Result<(), Box<dyn Error>> {
    let bytes = fs::read(path)?;
    let bundle = Bundle::parse(&bytes)?;
    let camera = bundle.header().preview;
    let mut budget = Budget::for_frame(camera.width_px, camera.height_px)
        .with_max_splats(MaxSplats::Worst)
        .with_residency(Residency::Streamed)
        .with_strips(Strips::Exactly(1));
    // Memory for every splat of the scene is more than a microcontroller has to spare: the firmware draws one view, so
    // it gets what this view needs.
    let plan = bundle.plan(&budget)?;
    let mut scratch = vec![0; plan.scratch_len()];
    let report = Decoder::bind(&bundle, plan, &mut scratch)?.render(&camera, &mut Nowhere)?;
    budget.max_splats = MaxSplats::AtMost(report.max_splats);
    let scratch_len = bundle.plan(&budget)?.scratch_len();
    let sizes = format!(
        "const WIDTH_PX: usize = {};\nconst HEIGHT_PX: usize = {};\nconst MAX_SPLATS: u32 = {};\nconst SCRATCH_LEN: usize = {scratch_len};\n",
        camera.width_px, camera.height_px, report.max_splats,
    );
    fs::write(out.join("bundle.psb"), &bytes)?;
    fs::write(out.join("sizes.rs"), sizes)?;
    Ok(())
}

/// Takes tiles and forgets them.
struct Nowhere;

impl TileSink for Nowhere {
    fn tile(&mut self, _x_px: u16, _y_px: u16, _width: u16, _height: u16, _rgb: &[[u8; 3]]) {}
}
